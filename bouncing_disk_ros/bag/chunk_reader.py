"""Chunks decompressed within limits, and the messages and definitions in them, taken by numpy.

The mcap library reads the head of a chunk. It does not read the messages: it makes an object of
each, and trusts what lz4 data say of their own size.
"""

from __future__ import annotations

import functools
import zlib
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress

import lz4.frame
import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema
from numpy.typing import NDArray

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.records import HEAD, INDEX_HEAD, MESSAGE, PART, read, stretch
from bouncing_disk_ros.errors import BagError
from bouncing_disk_ros.regular_file import RegularFile

_MESSAGE_HEAD = np.dtype(
    [("channel", "<u2"), ("sequence", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8")]
)
"""What stands before the data of a message."""
_AT_ONCE = 8 * PART
"""Chunks up to this size are decompressed in one call, larger ones in parts."""
_BATCH = 1 << 14
"""Messages whose heads are taken together."""


# --- decompressing --------------------------------------------------------------------------------
LEAST_CHUNK = HEAD.size + 8 + 8 + 8 + 4 + 4 + 8
"""Bytes of a chunk record without compression and without records."""
MOST_CHUNK = LEAST_CHUNK + limits.CHUNK + (limits.CHUNK >> 4)
"""A record that is longer is not read."""


def chunk_at(file: RegularFile, offset: int, length: int) -> Chunk:
    """The chunk record of a file at `offset`; BagError when damaged, or too large to be read."""
    if length > MOST_CHUNK:
        raise BagError(f"a chunk of {length} bytes: at most {MOST_CHUNK} can be read")
    chunk = read(Chunk, stretch(file, offset + HEAD.size, length - HEAD.size))
    if length != chunk_length(chunk):
        raise BagError("its lengths contradict each other")
    if (size := chunk.uncompressed_size) > limits.CHUNK:
        most = limits.CHUNK // limits.MIB
        raise BagError(f"a chunk of {size} bytes: at most {most} MiB can be read")
    return chunk


def unpacked(chunk: Chunk) -> bytes:
    """The records of a chunk; BagError when damaged. Never makes more bytes than the chunk says."""
    try:
        data = _decompressed(chunk)
    except (zstandard.ZstdError, RuntimeError) as error:
        raise BagError(f"damaged: {error}") from None
    crc = chunk.uncompressed_crc
    if len(data) != chunk.uncompressed_size:
        raise BagError("damaged: the size is wrong")
    if crc and zlib.crc32(data) != crc:
        raise BagError("damaged: the checksum is wrong")
    return data


def chunk_length(chunk: Chunk) -> int:
    """Bytes of the record of a chunk."""
    return LEAST_CHUNK + len(chunk.compression.encode()) + len(chunk.data)


def _decompressed(chunk: Chunk) -> bytes:
    match chunk.compression:
        case "":
            return chunk.data
        case "zstd":
            return _zstd(chunk.data, chunk.uncompressed_size)
        case "lz4":
            return _lz4(chunk.data, chunk.uncompressed_size)
        case name:
            raise BagError(f"unknown compression {name!r} (known: none, lz4, zstd)")


def _zstd(stored: bytes, size: int) -> bytes:
    """The first `size` bytes of the frames; other bytes may follow them (MCAP writers add some)."""
    stated = zstandard.frame_content_size(stored)
    tool = zstandard.ZstdDecompressor(max_window_size=limits.CHUNK)
    if stated == size <= _AT_ONCE:
        return tool.decompress(stored, max_output_size=size, allow_extra_data=True)
    parts, made = [], 0
    with tool.stream_reader(stored, read_across_frames=True) as stream:
        while made < size and (part := stream.read(min(PART, size - made))):
            parts.append(part)
            made += len(part)
        with suppress(zstandard.ZstdError):  # bytes behind the frames
            if stream.read(1):
                raise BagError("it holds more data than its header says")
    return b"".join(parts)


def _lz4(stored: bytes, size: int) -> bytes:
    tool = lz4.frame.LZ4FrameDecompressor()
    parts = [tool.decompress(stored, max_length=min(size, PART) + 1)]
    made = len(parts[0])
    while made <= size and not tool.eof:
        part = tool.decompress(b"", max_length=min(size - made, PART) + 1)
        if not part:
            break
        parts.append(part)
        made += len(part)
    if made > size:
        raise BagError("it holds more data than its header says")
    return parts[0] if len(parts) == 1 else b"".join(parts)


# --- records in a chunk ---------------------------------------------------------------------------


class Inner:
    """The records of a chunk, or messages that stand in a file in a row; BagError when damaged."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self._definitions: list[tuple[int, int, int]] = []
        begins, lengths = array("I"), array("I")
        position, end = 0, len(data)
        unpack, size, message = HEAD.unpack_from, HEAD.size, int(Opcode.MESSAGE)
        while position + size <= end:
            opcode, length = unpack(data, position)
            whole = size + length
            if position + whole > end:
                break
            if opcode == message:
                begins.append(position)
                lengths.append(whole)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._definitions.append((opcode, position, whole))
                if len(self._definitions) > limits.DEFINED:
                    raise BagError(f"damaged: more than {limits.DEFINED} definitions")
            elif opcode < 0x80:
                raise BagError(f"damaged: a record of kind {opcode} is not allowed in a chunk")
            position += whole
        if position != end:
            raise BagError("damaged: a record goes beyond the end")
        self.places = np.frombuffer(begins, np.uint32)
        self._lengths = np.frombuffer(lengths, np.uint32)
        self._heads = self._read_heads()
        times = self._heads["log_time"], self._heads["publish_time"]
        if any(len(one) and one.max() > limits.TIME_NS for one in times):
            raise BagError("damaged: a message of a time beyond the year 2262")

    def _read_heads(self) -> NDArray[np.void]:
        if len(self._lengths) and self._lengths.min() < MESSAGE.size:
            raise BagError("damaged: a message is too short for its fields")
        raw, within = np.frombuffer(self.data, np.uint8), np.arange(HEAD.size, MESSAGE.size)
        heads = np.empty(len(self.places), _MESSAGE_HEAD)
        for first in range(0, len(heads), _BATCH):
            part = self.places[first : first + _BATCH, None].astype(np.intp)
            heads[first : first + _BATCH] = raw[part + within].view(_MESSAGE_HEAD)[:, 0]
        return heads

    @property
    def channels(self) -> NDArray[np.uint16]:
        """The channel of each message."""
        return self._heads["channel"]

    @property
    def times(self) -> NDArray[np.uint64]:
        """The time of reception of each message, ns."""
        return self._heads["log_time"]

    @functools.cached_property
    def counts(self) -> Counter[int]:
        """Messages of each channel."""
        numbers, counts = np.unique(self.channels, return_counts=True)
        return Counter(dict(zip(numbers.tolist(), counts.tolist(), strict=True)))

    @functools.cached_property
    def span(self) -> tuple[int, int]:
        """First and last time of reception in ns; 0 and 0 without messages."""
        times = self.times
        return (int(times.min()), int(times.max())) if len(times) else (0, 0)

    def chosen(self, channels: Iterable[int], low: int, high: int, sort: bool) -> NDArray[np.intp]:
        """Numbers of the messages of some channels from `low` to before `high` ns.

        In the order of storage, or (`sort`) of reception.
        """
        inside = np.isin(self.channels, np.fromiter(channels, np.uint16))
        inside &= (self.times >= np.uint64(low)) & (self.times < np.uint64(high))
        found = np.flatnonzero(inside)
        times = self.times[found]
        if sort and np.any(times[1:] < times[:-1]):
            return found[np.argsort(times, kind="stable")]
        return found

    def indices(self) -> Iterator[tuple[int, bytes]]:
        """Each channel with the message index record of it: time and place of each message."""
        order = np.argsort(self.channels, kind="stable")
        rows = np.empty(len(order), [("time", "<u8"), ("place", "<u8")])
        rows["time"], rows["place"] = self.times[order], self.places[order]
        numbers, firsts = np.unique(self.channels[order], return_index=True)
        for number, part in zip(numbers.tolist(), np.split(rows, firsts[1:]), strict=False):
            head = HEAD.pack(Opcode.MESSAGE_INDEX, INDEX_HEAD.size + part.nbytes)
            yield number, head + INDEX_HEAD.pack(number, part.nbytes) + part.tobytes()

    def messages(self, chosen: NDArray[np.intp]) -> Iterator[tuple[int, int, int, int, bytes]]:
        """Those messages, in that order: channel, times of reception and sending, number, data."""
        data, skip = self.data, MESSAGE.size
        for first in range(0, len(chosen), _BATCH):
            part = chosen[first : first + _BATCH]
            begins = self.places[part].astype(np.intp)
            ends = (begins + self._lengths[part]).tolist()
            begins += skip
            for (channel, sequence, log_time, publish_time), begin, end in zip(
                self._heads[part].tolist(), begins.tolist(), ends, strict=True
            ):
                yield channel, log_time, publish_time, sequence, data[begin:end]

    def definitions(self) -> Iterator[Schema | Channel]:
        """The message types and channels among the records; BagError when damaged."""
        for opcode, position, whole in self._definitions:
            content = self.data[position + HEAD.size : position + whole]
            yield read(Schema, content) if opcode == Opcode.SCHEMA else read(Channel, content)

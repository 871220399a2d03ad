"""Chunks, and the messages and definitions in them: checked, decompressed, taken by numpy.

The mcap library is not asked: it makes an object of each message, and trusts what lz4 data say of
their own size.
"""

from __future__ import annotations

import functools
import zlib
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from typing import NamedTuple

import lz4.frame
import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.records import (
    HEAD,
    INDEX_HEAD,
    PART,
    ChunkHead,
    chunk,
    definition,
    places,
)  # fmt: skip
from bouncing_disk_ros.errors import BagError

_MESSAGE_HEAD = np.dtype(
    [("channel", "<u2"), ("sequence", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8")]
)
"""What stands before the data of a message."""
_AT_ONCE = 8 * PART
"""Chunks up to this size are decompressed in one call, larger ones in parts."""
_BATCH = 1 << 14
"""Messages whose heads are taken together."""


class Stored(NamedTuple):
    """One message as it is stored."""

    channel: int
    log_time_ns: int
    publish_time_ns: int
    sequence: int
    data: bytes


# --- decompressing --------------------------------------------------------------------------------
def unpacked(content: memoryview) -> tuple[ChunkHead, bytes]:
    """Head and records of a chunk, from the content of its record; BagError when damaged.

    Never makes more bytes than the head says, and that within the limit.
    """
    head = chunk(content, len(content))
    try:
        data = _decompressed(head, content[head.records_at :])
    except (zstandard.ZstdError, RuntimeError, EOFError, ValueError) as error:
        raise BagError(f"damaged: {error}") from None
    if len(data) != head.size or (head.crc and zlib.crc32(data) != head.crc):
        raise BagError("damaged: the checksum is wrong")
    return head, data


def _decompressed(head: ChunkHead, stored: memoryview) -> bytes:
    match head.compression:
        case "":
            if len(stored) != head.size:
                raise BagError("its lengths contradict each other")
            return bytes(stored)
        case "zstd":
            return _zstd(stored, head.size)
        case "lz4":
            return _lz4(stored, head.size)
        case name:
            raise BagError(f"unknown compression {name!r} (known: none, lz4, zstd)")


def _zstd(stored: memoryview, size: int) -> bytes:
    """The first `size` bytes of the frames; other bytes may follow them (MCAP writers add some)."""
    stated = zstandard.frame_content_size(stored)
    if stated > size:
        raise BagError("its lengths contradict each other")
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


def _lz4(stored: memoryview, size: int) -> bytes:
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
    if not tool.eof:
        raise BagError("the compressed data end too early")
    return parts[0] if len(parts) == 1 else b"".join(parts)


# --- records in a chunk ---------------------------------------------------------------------------


class Inner:
    """The records of a chunk, or messages that stand in a file in a row; BagError when damaged."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self._definitions: list[tuple[int, int, int]] = []
        begins, lengths = array("I"), array("I")
        others = 0
        for row in places(data):
            opcode, position, whole = row
            if opcode == Opcode.MESSAGE:
                begins.append(position)
                lengths.append(whole)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._definitions.append(row)
                if len(self._definitions) > limits.DEFINED:
                    raise BagError(f"damaged: more than {limits.DEFINED} definitions")
            elif opcode < 0x80 or (others := others + 1) > limits.RECORDS:
                raise BagError(f"damaged: a record of kind {opcode} is not allowed in a chunk")
        self.places = np.frombuffer(begins, np.uint32)
        self._lengths = np.frombuffer(lengths, np.uint32)
        self._heads = self._read_heads()
        times = self._heads["log_time"], self._heads["publish_time"]
        if any(len(one) and one.max() > limits.TIME_NS for one in times):
            raise BagError("damaged: a message of a time beyond the year 2262")

    def _read_heads(self) -> NDArray[np.void]:
        least = HEAD.size + _MESSAGE_HEAD.itemsize
        if len(self._lengths) and self._lengths.min() < least:
            raise BagError("damaged: a message is too short for its fields")
        raw, within = np.frombuffer(self.data, np.uint8), np.arange(HEAD.size, least)
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

    @property
    def counts(self) -> Counter[int]:
        """Messages of each channel."""
        numbers, counts = np.unique(self.channels, return_counts=True)
        return Counter(dict(zip(numbers.tolist(), counts.tolist(), strict=True)))

    @property
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

    @functools.cached_property
    def indices(self) -> dict[int, bytes]:
        """The entries of the message index of each channel: time and place of each message."""
        order = np.argsort(self.channels, kind="stable")
        rows = np.empty(len(order), [("time", "<u8"), ("place", "<u8")])
        rows["time"], rows["place"] = self.times[order], self.places[order]
        numbers, firsts = np.unique(self.channels[order], return_index=True)
        parts = np.split(rows, firsts[1:])
        return {n: part.tobytes() for n, part in zip(numbers.tolist(), parts, strict=False)}

    def index_records(self) -> bytes:
        """The message indices of all channels, as they stand behind a chunk."""
        return b"".join(
            HEAD.pack(Opcode.MESSAGE_INDEX, INDEX_HEAD.size + len(entries))
            + INDEX_HEAD.pack(number, len(entries))
            + entries
            for number, entries in self.indices.items()
        )

    def messages(self, chosen: NDArray[np.intp]) -> Iterator[Stored]:
        """Those messages, in that order."""
        data, skip = self.data, HEAD.size + _MESSAGE_HEAD.itemsize
        for first in range(0, len(chosen), _BATCH):
            part = chosen[first : first + _BATCH]
            begins = self.places[part].astype(np.intp)
            ends = (begins + self._lengths[part]).tolist()
            begins += skip
            for (channel, sequence, log_time, publish_time), begin, end in zip(
                self._heads[part].tolist(), begins.tolist(), ends, strict=True
            ):
                yield Stored(channel, log_time, publish_time, sequence, data[begin:end])

    def definitions(self) -> Iterator[Schema | Channel]:
        """The message types and channels among the records; BagError when damaged."""
        for opcode, position, whole in self._definitions:
            yield definition(opcode, self.data[position + HEAD.size : position + whole])

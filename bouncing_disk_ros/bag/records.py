"""An .mcap file as bytes and as records; the mcap library reads those whose content fits.

The library trusts lengths. Here nothing is read beyond the end of a file or a record, and a record
must be what the library writes of it: lengths within it that contradict each other, and keys given
twice, are damage. Bytes after the known fields are left alone, as the format asks of readers.
Chunks and attachments may be long, so only their heads are read here.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import NamedTuple, TypeVar

from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import BagError
from bouncing_disk_ros.regular_file import open_regular

Content = bytes | memoryview
Whole = TypeVar(
    "Whole",
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
MAGIC = b"\x89MCAP0\r\n"
"""The first and the last bytes of a file."""
HEAD = struct.Struct("<BQ")
"""Opcode and length before the content of every record."""
PART = 1 << 20
"""Long stretches are read in parts of this size: Ctrl-C takes effect, and memory stays small."""
_PIECE = 16 * PART
Watch = Callable[[int, int], object]
"""Called now and then with the bytes passed and the bytes of the file; may raise to end a walk."""


def nothing(_passed: int, _size: int) -> None:
    """Watch nothing."""


# --- the file -------------------------------------------------------------------------------------
class RegularFile:
    """A regular file; `size` was taken when it was opened. Use it as a context, or `close` it."""

    def __init__(self, path: Path) -> None:
        """Open it; InputError when it is no regular file or cannot be read."""
        self.path = path
        self._number, self.size = open_regular("bag", path)

    def read(self, offset: int, length: int) -> bytes:
        """`length` bytes from `offset` on; BagError where the file does not hold them."""
        if offset < 0 or length < 0 or offset + length > self.size:
            raise BagError(f"damaged: {length} bytes at byte {offset} of {self.size}")
        parts = list(self._parts(offset, length, _PIECE))
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def _parts(self, offset: int, length: int, most: int) -> Iterator[bytes]:
        end = offset + length
        while offset < end:
            part = os.pread(self._number, min(end - offset, most), offset)
            if not part:
                raise BagError("it has become shorter while it was read")
            yield part
            offset += len(part)

    def parts(self, offset: int, length: int) -> Iterator[bytes]:
        """The same as `read`, bit by bit: for records of any length."""
        if offset + length > self.size:
            raise BagError(f"damaged: {length} bytes at byte {offset} of {self.size}")
        return self._parts(offset, length, PART)

    def checksum(self, offset: int, length: int) -> int:
        """CRC-32 of a stretch."""
        crc = 0
        for part in self.parts(offset, length):
            crc = zlib.crc32(part, crc)
        return crc

    def close(self) -> None:
        """Let go of the file."""
        if self._number >= 0:
            os.close(self._number)
            self._number = -1

    def __enter__(self) -> RegularFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


# --- records --------------------------------------------------------------------------------------
def places(data: Content) -> Iterator[tuple[int, int, int]]:
    """Opcode, place and whole length of each record in a row; BagError when they do not fit."""
    position, end = 0, len(data)
    while position + HEAD.size <= end:
        opcode, length = HEAD.unpack_from(data, position)
        whole = HEAD.size + length
        if position + whole > end:
            break
        yield opcode, position, whole
        position += whole
    if position != end:
        raise BagError("damaged: a record goes beyond the end")


class Stream(ReadDataStream):
    """The content of a record as the library reads it, never beyond its end."""

    def __init__(self, content: Content) -> None:
        super().__init__(BytesIO())
        self._content, self._count = content, 0

    def read(self, length: int) -> bytes:
        """So many bytes; BagError where the content ends before."""
        end = self._count + length
        if end > len(self._content):
            raise BagError("damaged: a length goes beyond the end of its record")
        found = bytes(self._content[self._count : end])
        self._count = end
        return found

    def read_prefixed_string(self) -> str:
        """A text after its length; BagError where it is none."""
        try:
            return super().read_prefixed_string()
        except UnicodeDecodeError:
            raise BagError("damaged: a text that is not UTF-8") from None

    def name(self) -> str:
        """A short text of one line."""
        return _name(self.read_prefixed_string())


def _name(text: str) -> str:
    """A short text of one line, fit to be shown; BagError for another."""
    if (length := len(text.encode())) > limits.NAME:
        raise BagError(f"damaged: a text of {length} bytes (at most {limits.NAME})")
    if not text.isprintable():
        raise BagError(f"damaged: a name with characters that cannot be shown: {text[:60]!r}")
    return text


def read(kind: type[Whole], content: Content) -> Whole:
    """A record of a kind from its content (what follows opcode and length); BagError: damaged."""
    if len(content) > limits.RECORD:
        raise BagError(f"a record of {len(content)} bytes (at most {limits.RECORD})")
    stream, builder = Stream(content), RecordBuilder()
    found = kind.read(stream)
    found.write(builder)
    if builder.end()[HEAD.size :] != content[: stream.count]:
        raise BagError("damaged: lengths within a record contradict each other, or a key is twice")
    _check(found)
    return found


def _check(found: McapRecord) -> None:
    """BagError where the values of a record cannot be."""
    if not isinstance(found, Header):
        for value in vars(found).values():
            for text in value if isinstance(value, dict) else (value,):
                if isinstance(text, str):
                    _name(text)
    match found:
        case Schema(id=0):
            raise BagError("damaged: a message type with the number 0")
        case Channel(topic=""):
            raise BagError("damaged: a topic without a name")
        case Statistics() if sum(found.channel_message_counts.values()) != found.message_count:
            raise BagError("damaged: the counts of messages contradict each other")
        case ChunkIndex(message_start_time=start, message_end_time=end):
            if start > end or end > limits.TIME_NS:
                raise BagError(f"damaged: a chunk from {start} to {end} ns")


def definition(opcode: int, content: Content) -> Schema | Channel:
    """A topic or a message type; BagError: damaged."""
    return read(Schema, content) if opcode == Opcode.SCHEMA else read(Channel, content)


class AttachmentHead(NamedTuple):
    """The fields of an attachment before its data."""

    log_time: int
    create_time: int
    name: str
    media_type: str
    data_length: int
    data_at: int  # from the beginning of the content

    @property
    def data_end(self) -> int:
        """Place of the checksum of all before it, from the beginning of the content."""
        return self.data_at + self.data_length


def attachment(content: Content, length: int) -> AttachmentHead:
    """The head of an attachment from the beginning of its content, which is `length` bytes long."""
    row = Stream(content)
    head = AttachmentHead(row.read8(), row.read8(), row.name(), row.name(), row.read8(), row.count)
    if head.data_end + 4 > length:
        raise BagError("damaged: a length goes beyond the end of its record")
    return head


def checked_attachment(file: RegularFile, offset: int, length: int) -> AttachmentHead:
    """The head of the attachment record at `offset`; BagError: damaged.

    One without a checksum (0) ends with it, else a damaged length would find zeros in its data.
    """
    start, length = offset + HEAD.size, length - HEAD.size
    head = attachment(file.read(start, min(length, ATTACHMENT_HEAD)), length)
    (crc,) = struct.unpack("<I", file.read(start + head.data_end, 4))
    is_checked = crc or head.data_end + 4 < length
    if is_checked and file.checksum(start, head.data_end) != crc:
        raise BagError("damaged attachment: the checksum is wrong")
    return head


ATTACHMENT_HEAD = 16 + 4 + limits.NAME + 4 + limits.NAME + 8
"""The head of an attachment is no longer than this."""


class ChunkHead(NamedTuple):
    """The fields of a chunk before its records."""

    start_ns: int
    end_ns: int
    size: int  # of its records, decompressed
    crc: int  # of them; 0: none
    compression: str
    stored: int  # bytes of its records as they are stored
    records_at: int  # from the beginning of the content


def chunk(content: Content, length: int) -> ChunkHead:
    """The head of a chunk from the beginning of its content, which is `length` bytes long."""
    row = Stream(content)
    head = ChunkHead(
        row.read8(), row.read8(), row.read8(), row.read4(), row.name(), row.read8(), row.count
    )
    if head.stored != length - head.records_at:
        raise BagError("its lengths contradict each other")
    if head.size > limits.CHUNK or head.stored > limits.CHUNK + (limits.CHUNK >> 4):
        most = limits.CHUNK // limits.MIB
        given = max(head.size, head.stored)
        raise BagError(f"a chunk of {given} bytes: at most {most} MiB can be read")
    return head


INDEX_HEAD = struct.Struct("<HI")
"""Channel and bytes before the entries of a message index, of 16 bytes each."""
TIMES = struct.Struct("<QQ")
"""First and last time of the messages, at the beginning of a chunk."""
CHUNK_HEAD = 8 + 8 + 8 + 4 + 4 + limits.NAME + 8
"""The head of a chunk is no longer than this."""
# --- repeats of latched messages ------------------------------------------------------------------
MARK = "repeated"
"""The key in a channel's metadata."""


def without_repeats(channels: Mapping[int, Channel]) -> dict[int, Channel]:
    """The ordinary ones of some channels by number."""
    return {number: row for number, row in channels.items() if MARK not in row.metadata}

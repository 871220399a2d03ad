"""Records of .mcap files: read by the mcap library, from bytes that hold the whole record.

The library trusts lengths and gives less where its stream ends. Here a record that is shorter than
its lengths say is damage. Bytes after the known fields are left alone, as the format asks of
readers. Attachments may be long, so only their heads are read here.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from io import BytesIO
from typing import TypeVar

from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    Chunk,
    Footer,
    Header,
    McapRecord,
    Metadata,
    Schema,
)

from bouncing_disk_ros import limits
from bouncing_disk_ros.errors import BagError
from bouncing_disk_ros.regular_file import RegularFile, reason

Content = bytes | memoryview
Kind = TypeVar("Kind", Channel, Chunk, Footer, Header, Metadata, Schema)
Checked = TypeVar("Checked", bound=McapRecord)
MAGIC = b"\x89MCAP0\r\n"
"""The first and the last bytes of a file."""
HEAD = struct.Struct("<BQ")
"""Opcode and length before the content of every record."""
_LENGTH = struct.Struct("<Q")
INDEX_HEAD = struct.Struct("<HI")
"""Channel and bytes before the entries of a message index, of 16 bytes each."""
MESSAGE = struct.Struct("<BQHIQQ")
"""A message before its data: opcode, length, channel, sequence, times of reception and sending."""
PART = 1 << 20
"""Long stretches are read in parts of this size: Ctrl-C takes effect, and memory stays small."""
MARK = "repeated"
"""The key in the metadata of a channel that repeats latched messages."""
Watch = Callable[[int, int], object]
"""Called now and then with the bytes passed and the bytes of the file; may raise to end a walk."""


def nothing(_passed: int, _size: int) -> None:
    """Watch nothing."""


def without_repeats(channels: Mapping[int, Channel]) -> dict[int, Channel]:
    """The ordinary ones of some channels by number."""
    return {number: row for number, row in channels.items() if MARK not in row.metadata}


# --- bytes of a file ------------------------------------------------------------------------------
def stretch(file: RegularFile, offset: int, length: int) -> bytes:
    """`length` bytes from `offset` on; BagError where the file does not hold them."""
    if length < 0 or offset + length > file.size:
        raise BagError(f"damaged: {length} bytes at byte {offset} of {file.size}")
    try:
        file.seek(offset)
        data = file.read(length)
    except OSError as error:
        raise BagError(f"{file.path.name} cannot be read: {reason(error)}") from None
    if len(data) < length:
        raise BagError("it has become shorter while it was read")
    return data


def content_at(file: RegularFile, offset: int, length: int) -> bytes:
    """The content of the record at `offset`, for `read`: no more than that takes."""
    return stretch(file, offset + HEAD.size, min(length - HEAD.size, limits.RECORD + 1))


def parts(file: RegularFile, offset: int, length: int) -> Iterator[bytes]:
    """The same bit by bit: for records of any length."""
    end = offset + length
    for start in range(offset, end, PART):
        yield stretch(file, start, min(PART, end - start))


# --- records --------------------------------------------------------------------------------------
class Whole(BytesIO):
    """The content of a record, or whole records; never read beyond their end."""

    def read(self, length: int | None = -1) -> bytes:
        """So many bytes; BagError where there are fewer."""
        if length is None or not 0 <= length <= self.getbuffer().nbytes - self.tell():
            raise BagError("damaged: a length goes beyond the end of its record")
        return super().read(length)


def read_name(row: ReadDataStream) -> str:
    """A name after its length; BagError where it is none."""
    try:
        return shown(row.read_prefixed_string())
    except UnicodeDecodeError:
        raise BagError("damaged: a text that is not UTF-8") from None


def stream(content: Content) -> ReadDataStream:
    """The content of a record as the library reads it; BagError where it ends too early."""
    return ReadDataStream(Whole(content))


def read(kind: type[Kind], content: Content) -> Kind:
    """A record of a kind from its content (what follows opcode and length); BagError: damaged."""
    if kind is not Chunk and len(content) > limits.RECORD:
        raise BagError(f"a record of more than {limits.RECORD} bytes")
    try:
        return checked(kind.read(stream(content)))
    except UnicodeDecodeError:
        raise BagError("damaged: a text that is not UTF-8") from None


def checked(found: Checked) -> Checked:
    """A record whose names can be shown; BagError where they cannot, or a number cannot be."""
    if not isinstance(found, Header):
        for value in vars(found).values():
            for one in value if isinstance(value, dict) else (value,):
                if isinstance(one, str):
                    shown(one)
    match found:
        case Schema(id=0):
            raise BagError("damaged: a message type with the number 0")
        case Channel(topic=""):
            raise BagError("damaged: a topic without a name")
    return found


def shown(text: str) -> str:
    """A name, which is a short text of one line; BagError for another."""
    if (length := len(text.encode())) > limits.NAME:
        raise BagError(f"damaged: a text of {length} bytes (at most {limits.NAME})")
    if not text.isprintable():
        raise BagError(f"damaged: a name with characters that cannot be shown: {text[:60]!r}")
    return text


_ATTACHMENT_HEAD = 16 + 4 + limits.NAME + 4 + limits.NAME + 8
"""What stands before the data of an attachment is no longer than this."""


def attachment(file: RegularFile, offset: int, length: int) -> tuple[AttachmentIndex, int]:
    """The attachment record at `offset` and where its data begin; BagError: damaged.

    One without a checksum (0) ends with it, else a damaged length would find zeros in its data.
    """
    begin = offset + HEAD.size
    row = stream(stretch(file, begin, min(length - HEAD.size, _ATTACHMENT_HEAD)))
    times = row.read8(), row.read8()
    names = read_name(row), read_name(row)
    size = row.read8()
    data, end = begin + row.count, begin + row.count + size
    if (left := offset + length - end) < 4:
        raise BagError("damaged: a length goes beyond the end of its record")
    (stored,), crc = struct.unpack("<I", stretch(file, end, 4)), 0
    if stored or left > 4:
        for part in parts(file, begin, end - begin):
            crc = zlib.crc32(part, crc)
    if crc != stored:
        raise BagError("damaged attachment: the checksum is wrong")
    return AttachmentIndex(offset, length, *times, size, *names), data


def record(row: McapRecord) -> bytes:
    """The bytes of a record."""
    builder = RecordBuilder()
    row.write(builder)
    return bytes(builder.end())


def chunk_record(chunk: Chunk) -> tuple[bytes, bytes]:
    """The bytes of the record of a chunk: what is before its data, and the data, not copied."""
    before = record(replace(chunk, data=b""))[HEAD.size : -_LENGTH.size]
    length = _LENGTH.pack(len(chunk.data))
    head = HEAD.pack(Opcode.CHUNK, len(before) + len(length) + len(chunk.data))
    return head + before + length, chunk.data

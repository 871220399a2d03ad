"""The fields of mcap records, read strictly: every length is checked before it is used.

Each function takes the content of a record (what follows its opcode and length) and raises
`BagError` where it is not that of its kind. Bytes after the known fields are left alone, as the
format asks of readers.
"""

from __future__ import annotations

import struct
from typing import Any, NamedTuple

from mcap.records import Channel, Metadata, Schema

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.formats import BagError

Content = bytes | memoryview
_TWO, _FOUR, _EIGHT = struct.Struct("<H"), struct.Struct("<I"), struct.Struct("<Q")
_TWO_TWO, _FOUR_EIGHTS, _TWO_EIGHTS = (
    struct.Struct("<HH"), struct.Struct("<QQQQ"), struct.Struct("<QQ")
)  # fmt: skip
_STATISTICS = struct.Struct("<QHIIIIQQ")
_COUNT = struct.Struct("<HQ")
_FOOTER = struct.Struct("<QQI")


class Fields:
    """Takes the fields of a record one by one."""

    def __init__(self, content: Content) -> None:
        self._data, self.position = content, 0

    def take(self, form: struct.Struct) -> tuple[Any, ...]:
        """Numbers."""
        end = self.position + form.size
        if end > len(self._data):
            raise BagError("damaged: a record is too short for its fields")
        values = form.unpack_from(self._data, self.position)
        self.position = end
        return values

    def bytes(self, length: int) -> bytes:
        """So many bytes."""
        end = self.position + length
        if end > len(self._data):
            raise BagError("damaged: a length goes beyond the end of its record")
        found = bytes(self._data[self.position : end])
        self.position = end
        return found

    def text(self, most: int = limits.RECORD) -> str:
        """A text after its length."""
        (length,) = self.take(_FOUR)
        if length > most:
            raise BagError(f"damaged: a text of {length} bytes (at most {most})")
        try:
            return self.bytes(length).decode()
        except UnicodeDecodeError:
            raise BagError("damaged: a text that is not UTF-8") from None

    def name(self) -> str:
        """A short text of one line, fit to be shown."""
        text = self.text(limits.NAME)
        if not text.isprintable():
            raise BagError(f"damaged: a name with characters that cannot be shown: {text[:60]!r}")
        return text

    def texts(self) -> dict[str, str]:
        """Texts by name."""
        (length,) = self.take(_FOUR)
        end = self.position + length
        if end > len(self._data):
            raise BagError("damaged: a length goes beyond the end of its record")
        found: dict[str, str] = {}
        while self.position < end:
            name = self.name()
            if name in found:
                raise BagError(f"damaged: the key {name!r} is given twice")
            found[name] = self.text()
        if self.position != end:
            raise BagError("damaged: lengths within a record contradict each other")
        return found


def schema(content: Content) -> Schema:
    """A message type and its definition."""
    fields = Fields(content)
    (number,) = fields.take(_TWO)
    name, encoding = fields.name(), fields.name()
    (length,) = fields.take(_FOUR)
    if number == 0:
        raise BagError("damaged: a message type with the number 0")
    return Schema(id=number, name=name, encoding=encoding, data=fields.bytes(length))


def channel(content: Content) -> Channel:
    """A topic, with its type, encoding and quality of service."""
    fields = Fields(content)
    number, schema_id = fields.take(_TWO_TWO)
    topic, encoding = fields.name(), fields.name()
    if not topic:
        raise BagError("damaged: a topic without a name")
    return Channel(
        id=number, topic=topic, message_encoding=encoding, metadata=fields.texts(),
        schema_id=schema_id,
    )  # fmt: skip


def metadata(content: Content) -> Metadata:
    """Named texts."""
    fields = Fields(content)
    return Metadata(name=fields.name(), metadata=fields.texts())


def header(content: Content) -> None:
    """Check the first record of a file: profile and library."""
    fields = Fields(content)
    fields.text(), fields.text()


class Footer(NamedTuple):
    """The last record of a file."""

    summary_start: int
    summary_offset_start: int
    summary_crc: int


def footer(content: Content) -> Footer:
    """The last record of a file."""
    return Footer(*Fields(content).take(_FOOTER))


class Statistics(NamedTuple):
    """How many there are of what."""

    messages: int
    schemas: int
    channels: int
    attachments: int
    metadata: int
    chunks: int
    counts: dict[int, int]  # messages by channel


def statistics(content: Content) -> Statistics:
    """How many there are of what; BagError when the counts do not add up."""
    fields = Fields(content)
    messages, schemas, channels, attachments, notes, chunks, *_ = fields.take(_STATISTICS)
    (length,) = fields.take(_FOUR)
    if length % _COUNT.size:
        raise BagError("damaged: lengths within a record contradict each other")
    counts = dict(_COUNT.iter_unpack(fields.bytes(length)))
    if len(counts) * _COUNT.size != length or sum(counts.values()) != messages:
        raise BagError("damaged: the counts of messages contradict each other")
    return Statistics(messages, schemas, channels, attachments, notes, chunks, counts)


class ChunkPlace(NamedTuple):
    """Where a chunk stands and what it holds, as the index says."""

    start_ns: int
    end_ns: int
    offset: int
    length: int
    size: int  # of its records, decompressed


def chunk_index(content: Content) -> ChunkPlace:
    """Where a chunk stands."""
    fields = Fields(content)
    start, end, offset, length = fields.take(_FOUR_EIGHTS)
    (indices,) = fields.take(_FOUR)
    fields.bytes(indices)
    fields.take(_EIGHT)  # length of the message indices
    fields.name()
    _stored, size = fields.take(_TWO_EIGHTS)
    if start > end or end > limits.TIME_NS:
        raise BagError(f"damaged: a chunk from {start} to {end} ns")
    return ChunkPlace(start, end, offset, length, size)


class RecordPlace(NamedTuple):
    """Where an attachment or a metadata record stands, as the index says."""

    offset: int
    length: int
    name: str


def attachment_index(content: Content) -> RecordPlace:
    """Where an attachment stands."""
    fields = Fields(content)
    offset, length = fields.take(_TWO_EIGHTS)
    fields.take(_TWO_EIGHTS), fields.take(_EIGHT)  # times and size of the data
    return RecordPlace(offset, length, fields.name())


def metadata_index(content: Content) -> RecordPlace:
    """Where a metadata record stands."""
    fields = Fields(content)
    offset, length = fields.take(_TWO_EIGHTS)
    return RecordPlace(offset, length, fields.name())


class AttachmentHead(NamedTuple):
    """What stands before the data of an attachment."""

    log_time: int
    create_time: int
    name: str
    media_type: str
    data_at: int  # from the beginning of the content
    data_length: int


def attachment(content: Content, length: int) -> AttachmentHead:
    """The head of an attachment from the beginning of its content, which is `length` bytes long."""
    fields = Fields(content)
    log_time, create_time = fields.take(_TWO_EIGHTS)
    name, media_type = fields.name(), fields.name()
    (size,) = fields.take(_EIGHT)
    if fields.position + size + 4 > length:
        raise BagError("damaged: a length goes beyond the end of its record")
    return AttachmentHead(log_time, create_time, name, media_type, fields.position, size)


ATTACHMENT_HEAD = 16 + 4 + limits.NAME + 4 + limits.NAME + 8
"""The head of an attachment is no longer than this."""


class ChunkHead(NamedTuple):
    """What stands before the records of a chunk."""

    start_ns: int
    end_ns: int
    size: int  # of its records, decompressed
    crc: int  # of them; 0: none
    compression: str
    records_at: int  # from the beginning of the content


_CHUNK = struct.Struct("<QQQI")


def chunk(content: Content, length: int) -> ChunkHead:
    """The head of a chunk from the beginning of its content, which is `length` bytes long."""
    fields = Fields(content)
    start, end, size, crc = fields.take(_CHUNK)
    name = fields.name()
    (stored,) = fields.take(_EIGHT)
    if stored != length - fields.position:
        raise BagError("its lengths contradict each other")
    if size > limits.CHUNK or stored > limits.CHUNK + (limits.CHUNK >> 4):
        most = limits.CHUNK // limits.MIB
        raise BagError(f"a chunk of {max(size, stored)} bytes: at most {most} MiB can be read")
    return ChunkHead(start, end, size, crc, name, fields.position)


CHUNK_HEAD = _CHUNK.size + 4 + limits.NAME + 8
"""The head of a chunk is no longer than this."""

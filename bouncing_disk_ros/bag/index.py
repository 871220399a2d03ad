"""The index of one .mcap file: what stands where in it, and which topics and types it defines.

A writer and a recovery build it from the records that they write, a reader from the summary of the
file or from a walk through it. A summary is taken only when nothing in it contradicts the file.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Mapping
from typing import Any

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag import records
from bouncing_disk_ros.bag.chunk_reader import Inner
from bouncing_disk_ros.bag.metadata import FileRow
from bouncing_disk_ros.bag.records import HEAD, INDEX_HEAD, MAGIC, RegularFile
from bouncing_disk_ros.bag.walk import record_name
from bouncing_disk_ros.errors import BagError, InputError

_FOOTER = HEAD.size + 20
_LEAST_MESSAGE = HEAD.size + 22


class PlainMessages(ChunkIndex):
    """Messages in a row outside of chunks, named as a chunk is."""


class Index:
    """The index of one .mcap file; `end` is where the next record of the data section goes."""

    def __init__(self) -> None:
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.chunks: list[ChunkIndex] = []
        self.attachments: list[AttachmentIndex] = []
        self.metadata: list[MetadataIndex] = []
        self.end = len(MAGIC)
        self.chunk_counts: list[Counter[int]] = []  # of a summary: one for all chunks
        self._sure: dict[tuple[type, int], Schema | Channel] = {}  # definitions in chunks

    # --- building ---------------------------------------------------------------------------------
    def add(self, data: bytes | memoryview, offset: int) -> None:
        """Take note of whole records at `offset` of the file, except definitions."""
        view = memoryview(data)
        for opcode, position, whole in records.places(view):
            content, at = view[position + HEAD.size : position + whole], offset + position
            match opcode:
                case Opcode.CHUNK:
                    self.add_chunk(content, at, Counter())
                case Opcode.MESSAGE_INDEX:
                    self._add_message_index(content, at)
                case Opcode.ATTACHMENT:
                    self.add_attachment(records.attachment(content, len(content)), at, whole)
                case Opcode.METADATA:
                    name = records.read(Metadata, content).name
                    self.metadata.append(MetadataIndex(at, whole, name))
        self.end = offset + len(view)

    def add_chunk(self, content: memoryview, offset: int, counts: Counter[int]) -> None:
        """Take note of a chunk; `counts` are the messages of each channel in it."""
        head = records.chunk(content, len(content))
        self.chunks.append(
            ChunkIndex(
                chunk_start_offset=offset,
                chunk_length=HEAD.size + len(content),
                message_start_time=head.start_ns,
                message_end_time=head.end_ns,
                message_index_offsets={},
                message_index_length=0,
                compression=head.compression,
                compressed_size=len(content) - head.records_at,
                uncompressed_size=head.size,
            )
        )
        self.chunk_counts.append(counts)

    def _add_message_index(self, content: memoryview, offset: int) -> None:
        channel, length = INDEX_HEAD.unpack_from(content)
        chunk = self.chunks[-1]
        chunk.message_index_offsets[channel] = offset
        chunk.message_index_length += HEAD.size + len(content)
        self.chunk_counts[-1][channel] += length // 16

    def add_messages(self, inner: Inner, offset: int) -> None:
        """Take note of messages in a row outside of chunks."""
        size, (first, last) = len(inner.data), inner.span
        self.chunks.append(PlainMessages(size, offset, "", size, last, 0, {}, first, size))
        self.chunk_counts.append(inner.counts)

    def add_attachment(self, head: records.AttachmentHead, offset: int, length: int) -> None:
        """Take note of an attachment, a record of `length` bytes."""
        self.attachments.append(
            AttachmentIndex(offset, length, head.log_time, head.create_time, head.data_length,
                            head.name, head.media_type)
        )  # fmt: skip
        self.end = offset + length

    def drop_last_chunk(self) -> None:
        """Forget the newest chunk and all that is after it."""
        chunk = self.chunks.pop()
        self.chunk_counts.pop()
        self.end = chunk.chunk_start_offset
        self.attachments = [row for row in self.attachments if row.offset < self.end]
        self.metadata = [row for row in self.metadata if row.offset < self.end]

    # --- definitions ------------------------------------------------------------------------------
    def define(self, row: Schema | Channel) -> None:
        """Take a definition that stands outside of chunks: those in chunks have a checksum."""
        if (type(row), row.id) not in self._sure:
            self.defined(row)[row.id] = row

    def define_all(self, inner: Inner) -> None:
        """Take those in a chunk; BagError when damaged, or unlike others in it or another chunk."""
        found: dict[tuple[type, int], Schema | Channel] = {}
        for row in inner.definitions():
            key = type(row), row.id
            if self._sure.get(key, row) != row or found.setdefault(key, row) != row:
                raise BagError(f"its definition of number {row.id} differs from an earlier one")
        self._sure.update(found)
        for row in found.values():
            self.defined(row)[row.id] = row

    def defined(self, row: Schema | Channel) -> dict[int, Any]:
        """The definitions of the kind of `row` by number."""
        return self.schemas if isinstance(row, Schema) else self.channels

    # --- reading ----------------------------------------------------------------------------------
    @property
    def counts(self) -> Counter[int]:
        """Messages of each channel."""
        return sum(self.chunk_counts, Counter())

    @property
    def span(self) -> tuple[int, int]:
        """First and last time of reception in ns; 0 and 0 without messages."""
        rows = self.chunks
        first = min((row.message_start_time for row in rows), default=0)
        return first, max((row.message_end_time for row in rows), default=0)

    @property
    def names(self) -> dict[int, str]:
        """Attachments and metadata records in words, by their offsets."""
        attachments = {row.offset: (Opcode.ATTACHMENT, row.name) for row in self.attachments}
        metadata = {row.offset: (Opcode.METADATA, row.name) for row in self.metadata}
        return {at: record_name(*row) for at, row in (attachments | metadata).items()}

    def file_row(self, name: str, channels: Mapping[int, Channel]) -> tuple[FileRow, Counter[str]]:
        """The file as metadata.yaml names it, and the messages of each topic of some channels."""
        counts, found = self.counts, Counter[str]()
        for number, channel in channels.items():
            found[channel.topic] += counts[number]
        return FileRow(name, *self.span, found.total()), found

    def ending(self, notes: Mapping[str, Mapping[str, str]]) -> bytes:
        """Notes, the end of the data section, summary and footer; the index stays as it is."""
        builder, places = RecordBuilder(), list(self.metadata)
        for name, values in notes.items():
            at = self.end + builder.count
            Metadata(name, dict(values)).write(builder)
            places.append(MetadataIndex(at, self.end + builder.count - at, name))
        DataEnd(0).write(builder)
        head = builder.end()
        start = self.end + len(head)
        groups = RecordBuilder()
        offsets = [
            self._group(groups, opcode, rows, start) for opcode, rows in self._groups(places)
        ]
        offsets_at = start + groups.count
        for row in offsets:
            if row is not None:
                row.write(groups)
        summary = groups.end()
        tail = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offsets_at)
        Footer(start, offsets_at, zlib.crc32(tail, zlib.crc32(summary))).write(builder)
        return bytes(head + summary + builder.end() + MAGIC)

    def _groups(self, metadata: list[MetadataIndex]) -> list[tuple[Opcode, list[McapRecord]]]:
        return [
            (Opcode.SCHEMA, list(self.schemas.values())),
            (Opcode.CHANNEL, list(self.channels.values())),
            (Opcode.STATISTICS, [self._statistics(len(metadata))]),
            (Opcode.CHUNK_INDEX, list(self.chunks)),
            (Opcode.ATTACHMENT_INDEX, list(self.attachments)),
            (Opcode.METADATA_INDEX, list(metadata)),
        ]

    @staticmethod
    def _group(
        builder: RecordBuilder, opcode: Opcode, rows: list[McapRecord], start: int
    ) -> SummaryOffset | None:
        first = builder.count
        for row in rows:
            row.write(builder)
        length = builder.count - first
        return SummaryOffset(opcode, start + first, length) if rows else None

    def _statistics(self, metadata: int) -> Statistics:
        counts, (first, last) = self.counts, self.span
        return Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=dict(counts),
            chunk_count=len(self.chunks),
            message_count=counts.total(),
            message_end_time=last,
            message_start_time=first,
            metadata_count=metadata,
            schema_count=len(self.schemas),
        )


# --- from the summary of a file -------------------------------------------------------------------
def index_of(file: RegularFile) -> Index | str:
    """The index by the summary of a file, or why there is none. InputError: the file is empty."""
    if not file.size:
        raise InputError("bag", str(file.path), "a readable .mcap file", "It is empty.")
    try:
        return _index_of(file)
    except BagError as error:
        return f"its index is damaged ({error})"


def _index_of(file: RegularFile) -> Index | str:
    none = "it has no index"
    if file.size < 2 * len(MAGIC) + _FOOTER or file.read(0, len(MAGIC)) != MAGIC:
        return none
    tail_at = file.size - _FOOTER - len(MAGIC)
    tail = file.read(tail_at, _FOOTER + len(MAGIC))
    if tail[-len(MAGIC) :] != MAGIC or HEAD.unpack_from(tail) != (Opcode.FOOTER, 20):
        return none
    footer = records.read(Footer, tail[HEAD.size :])
    start = footer.summary_start
    if not start:
        return none
    if not len(MAGIC) <= start <= tail_at:
        raise BagError("it begins outside of the file")
    content = file.read(start, tail_at - start)
    crc = zlib.crc32(tail[: HEAD.size + 16], zlib.crc32(content))
    if footer.summary_crc not in (0, crc):
        raise BagError("its checksum is wrong")
    found, statistics = _read(content)
    if statistics is None or not _names_all(found, statistics):
        return "it has no complete index"
    _check(found, statistics, start)
    return found


def _read(content: bytes) -> tuple[Index, Statistics | None]:
    """The records of a summary, each checked by itself."""
    found, statistics, view = Index(), None, memoryview(content)
    defined = others = 0
    for opcode, position, whole in records.places(content):
        row = view[position + HEAD.size : position + whole]
        match opcode:
            case Opcode.SCHEMA | Opcode.CHANNEL:
                found.define(records.definition(opcode, row))
                defined += 1
            case Opcode.STATISTICS if statistics is None:
                statistics = records.read(Statistics, row)
                found.chunk_counts = [Counter(statistics.channel_message_counts)]
            case Opcode.CHUNK_INDEX:
                found.chunks.append(records.read(ChunkIndex, row))
                found.chunks[-1].message_index_offsets = {}  # most of its memory, and not used
            case Opcode.ATTACHMENT_INDEX:
                found.attachments.append(records.read(AttachmentIndex, row))
            case Opcode.METADATA_INDEX:
                found.metadata.append(records.read(MetadataIndex, row))
            case _:
                others += 1
                is_known = opcode == Opcode.SUMMARY_OFFSET or opcode >= 0x80
                if not is_known or others > limits.RECORDS:
                    raise BagError(f"a record of kind {opcode} is not allowed in it")
        if defined > limits.DEFINED:
            raise BagError(f"it has more than {limits.DEFINED} definitions")
    return found, statistics


def _names_all(found: Index, statistics: Statistics) -> bool:
    """Whether an index has each group of records that it may leave out and the file needs."""
    types = {row.schema_id for row in found.channels.values()}
    return (
        bool(found.chunks or not (statistics.chunk_count or statistics.message_count))
        and bool(found.attachments or not statistics.attachment_count)
        and bool(found.metadata or not statistics.metadata_count)
        and statistics.channel_message_counts.keys() <= found.channels.keys()
        and types <= {0, *found.schemas}
    )


def _check(found: Index, statistics: Statistics, end: int) -> None:
    """BagError when the index contradicts itself or the file, whose data section ends at `end`."""
    chunks, passed = found.chunks, len(MAGIC)
    named = [(row.chunk_start_offset, row.chunk_length) for row in chunks]
    named += [(row.offset, row.length) for row in found.attachments]
    named += [(row.offset, row.length) for row in found.metadata]
    for offset, length in sorted(named):
        if offset < passed or length < HEAD.size or offset + length > end:
            raise BagError("it names records that overlap or lie outside of the file")
        passed = offset + length
    counted = statistics.chunk_count, statistics.attachment_count, statistics.metadata_count
    if counted != (len(chunks), len(found.attachments), len(found.metadata)):
        raise BagError("its counts of records differ from the records that it names")
    if statistics.message_count * _LEAST_MESSAGE > sum(row.uncompressed_size for row in chunks):
        raise BagError("it counts more messages than there is room for")

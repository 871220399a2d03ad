"""One .mcap file that is being written: its chunks, its index, its end, and the `Options`.

The mcap library makes the bytes. It keeps an index too, but only in its writer. With this one a
file can be closed in order after a failed write, and recovery can index the records that it copies.
"""

from __future__ import annotations

import errno
import math
import os
import struct
import time
import zlib
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

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
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from bouncing_disk_ros.bag import records
from bouncing_disk_ros.bag.metadata import FileRow, TopicRow, qos_text
from bouncing_disk_ros.bag.records import (
    ATTACHMENT_HEAD,
    HEAD,
    INDEX_HEAD,
    MAGIC,
    MARK,
    RegularFile,
    without_repeats,
)
from bouncing_disk_ros.bag.schema import ENCODING, schema_of
from bouncing_disk_ros.errors import InputError


class RecordStream:
    """What mcap's writer writes to: the file, unbuffered, and the index of what is whole in it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.file = path.open("xb", buffering=0)
        self.position = 0
        self.index = Index()

    def write(self, data: bytes) -> None:
        """Write whole records, or raise OSError; then the index still tells what is whole."""
        self.write_ending(data)
        if data != MAGIC:
            self.index.add(data, self.position)
        self.position += len(data)

    def copy_attachment(self, file: RegularFile, offset: int, length: int) -> None:
        """Copy an attachment record of another file, however long it is."""
        for part in file.parts(offset, length):
            self.write_ending(part)
        beginning = file.read(offset + HEAD.size, min(length - HEAD.size, ATTACHMENT_HEAD))
        self.index.add_attachment(beginning, self.position, length)
        self.position += length

    def write_ending(self, data: bytes) -> None:
        """Write bytes that do not belong to the data section."""
        view = memoryview(data)
        while view:
            view = view[self.file.write(view) or 0 :]

    def cut(self, end: int) -> None:
        """Throw away what is after `end`, and write the next record there."""
        self.file.truncate(end)
        self.file.seek(end)
        self.position = end

    def tell(self) -> int:
        """Where the next record goes."""
        return self.position

    def flush(self) -> None:
        """Nothing is held back."""


# --- the index ------------------------------------------------------------------------------------
class Index:
    """The index of one .mcap file; `end` is where the next record of the data section goes."""

    def __init__(self) -> None:
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.chunks: list[ChunkIndex] = []
        self.counts: list[Counter[int]] = []
        self.attachments: list[AttachmentIndex] = []
        self.metadata: list[MetadataIndex] = []
        self.end = len(MAGIC)

    # --- building ---------------------------------------------------------------------------------
    def add(self, data: bytes | memoryview, offset: int) -> None:
        """Take note of whole records at `offset` of the file."""
        view, position = memoryview(data), 0
        while position < len(view):
            opcode, length = HEAD.unpack_from(view, position)
            content = view[position + HEAD.size : position + HEAD.size + length]
            taker = self._handlers.get(opcode)
            if taker is not None:
                taker(self, content, offset + position)
            position += HEAD.size + length
        self.end = offset + len(view)

    def _chunk(self, content: memoryview, offset: int) -> None:
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
        self.counts.append(Counter())

    def _message_index(self, content: memoryview, offset: int) -> None:
        channel, length = INDEX_HEAD.unpack_from(content)
        chunk = self.chunks[-1]
        chunk.message_index_offsets[channel] = offset
        chunk.message_index_length += HEAD.size + len(content)
        self.counts[-1][channel] += length // 16

    def _attachment(self, content: memoryview, offset: int) -> None:
        self.add_attachment(content, offset, HEAD.size + len(content))

    def add_attachment(self, beginning: records.Content, offset: int, length: int) -> None:
        """Take note of an attachment, of which the beginning of the content is given."""
        row = records.attachment(beginning, length - HEAD.size)
        self.attachments.append(
            AttachmentIndex(offset, length, row.log_time, row.create_time, row.data_length,
                            row.name, row.media_type)
        )  # fmt: skip
        self.end = offset + length

    def _metadata(self, content: memoryview, offset: int) -> None:
        name = records.read(Metadata, content).name
        self.metadata.append(MetadataIndex(offset, HEAD.size + len(content), name))

    _handlers: Mapping[int, Callable[[Index, memoryview, int], None]] = {
        Opcode.CHUNK: _chunk,
        Opcode.MESSAGE_INDEX: _message_index,
        Opcode.ATTACHMENT: _attachment,
        Opcode.METADATA: _metadata,
    }

    def drop_last_chunk(self) -> None:
        """Forget the newest chunk and all that is after it."""
        chunk = self.chunks.pop()
        self.counts.pop()
        self.end = chunk.chunk_start_offset
        self.attachments = [row for row in self.attachments if row.offset < self.end]
        self.metadata = [row for row in self.metadata if row.offset < self.end]

    # --- reading ----------------------------------------------------------------------------------
    @property
    def channel_counts(self) -> Counter[int]:
        """Messages of each channel in the chunks."""
        return sum(self.counts, Counter())

    @property
    def span(self) -> tuple[int, int]:
        """First and last time of reception in ns; 0 and 0 without messages."""
        rows = self.chunks
        first = min((row.message_start_time for row in rows), default=0)
        return first, max((row.message_end_time for row in rows), default=0)

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
        counts, (first, last) = self.channel_counts, self.span
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


# --- the file -------------------------------------------------------------------------------------
PROFILE = "ros2"
COMPRESSIONS = {
    "zstd": CompressionType.ZSTD,
    "lz4": CompressionType.LZ4,
    "none": CompressionType.NONE,
}


@dataclass(frozen=True)
class Options:
    """Options of a bag writer; sizes in bytes, times in seconds, 0: no limit."""

    compression: str = "zstd"
    chunk_size: int = 1 << 20
    chunk_period: float = 1.0
    max_size: int = 0
    max_duration: float = 0.0
    max_chunks: int = 25_000
    """A file's index is held in memory, 2 kB for each chunk: a new file bounds it (50 MB)."""

    def __post_init__(self) -> None:
        if self.compression not in COMPRESSIONS:
            raise InputError("compression", self.compression, ", ".join(COMPRESSIONS))


class McapFile:
    """One file of a bag. Methods raise OSError when the disk takes no more; then `abandon` it."""

    def __init__(self, path: Path, options: Options, library: str) -> None:
        self.path = path
        self._stream = RecordStream(path)
        compression = COMPRESSIONS[options.compression]
        self._writer = McapWriter(self._stream, options.chunk_size, compression)  # type: ignore[arg-type, unused-ignore]
        self._writer.start(PROFILE, library)
        self._schemas: dict[str, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self.start_ns: int | None = None
        self._size = 0  # of the whole file, once it is closed
        self._period = options.chunk_period
        self.due = math.inf  # when the open chunk is to be closed, by the steady clock

    # --- content ----------------------------------------------------------------------------------
    def add_channel(self, topic: TopicRow, *, repeats: bool = False) -> int:
        """Register a topic, or a place for repeats of its messages; the number of the channel."""
        schema = self._schema(topic.type)
        texts = {"topic_type_hash": topic.type_hash}
        if repeats:
            texts[MARK] = "latched"
        else:
            texts["offered_qos_profiles"] = qos_text(topic.qos)
        number = self._writer.register_channel(topic.name, "cdr", schema.id, texts)
        self._channels[number] = Channel(number, topic.name, "cdr", texts, schema.id)
        self._define(self._channels[number])
        return number

    def _schema(self, kind: str) -> Schema:
        if kind not in self._schemas:
            text = schema_of(kind).text.encode()
            number = self._writer.register_schema(kind, ENCODING, text)
            self._schemas[kind] = Schema(number, text, ENCODING, kind)
            self._define(self._schemas[kind])
        return self._schemas[kind]

    def _define(self, record: McapRecord) -> None:
        """Write a definition at once, beside the copy that mcap puts into the next chunk.

        So a topic without messages is known after a crash, and a damaged chunk hides no topic.
        """
        builder = RecordBuilder()
        record.write(builder)
        self._stream.write(builder.end())

    def write(
        self, channel: int, log_time_ns: int, data: bytes, publish_time_ns: int, sequence: int
    ) -> bool:
        """Add one message to the open chunk; whether the chunk is full and written."""
        if self.start_ns is None:
            self.start_ns = log_time_ns
        stream = self._stream
        position = stream.position
        self._writer.add_message(channel, log_time_ns, data, publish_time_ns, sequence)
        if stream.position != position:
            self.due = math.inf
            return True
        if self.due == math.inf:
            self.due = time.monotonic() + self._period
        return False

    def attach(self, name: str, media_type: str, data: bytes, time_ns: int) -> None:
        """Add an attachment."""
        self._writer.add_attachment(time_ns, time_ns, name, media_type, data)

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record."""
        self._writer.add_metadata(name, dict(values))

    @property
    def is_in_place(self) -> bool:
        """Whether the file is still at its path: not deleted, moved or replaced."""
        try:
            return os.path.samestat(os.fstat(self._stream.file.fileno()), self.path.lstat())
        except OSError:
            return False

    def check_room(self) -> None:
        """OSError where messages wait to be written and the disk is full."""
        disk = os.fstatvfs(self._stream.file.fileno())
        free = disk.f_bavail if os.geteuid() else disk.f_bfree
        if self.due < math.inf and disk.f_blocks and not free:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def close_chunk(self) -> None:
        """Compress and write what is held in the open chunk."""
        self._writer.flush()
        self.due = math.inf

    # --- end --------------------------------------------------------------------------------------
    @property
    def chunks(self) -> int:
        """Chunks in the file."""
        return len(self._stream.index.chunks)

    @property
    def size(self) -> int:
        """Bytes in the file; the open chunk is not counted."""
        return self._size or self._stream.position

    @property
    def counts(self) -> dict[str, int]:
        """Messages of each topic in the file, without repeats of earlier ones."""
        counts, own = self._stream.index.channel_counts, without_repeats(self._channels)
        return {channel.topic: counts[number] for number, channel in own.items()}

    @property
    def filled(self) -> tuple[FileRow, dict[str, int]]:
        """The file as metadata.yaml names it, and `counts`."""
        counts = self.counts
        row = FileRow(self.path.name, *self._stream.index.span, sum(counts.values()))
        return row, counts

    def finish(self, notes: Mapping[str, Mapping[str, str]]) -> None:
        """Write notes, index and footer. `close` it after that."""
        self._stream.write_ending(self._ending(notes))

    def abandon(self, notes: Mapping[str, Mapping[str, str]]) -> None:
        """After a failed write: keep what is whole, give up chunks until the index has room.

        Raises OSError when that cannot be: the file cannot be cut, or the index needs more room
        than half of the chunks. It is then unfinished, holds all whole chunks, and can be read.
        """
        index = self._stream.index
        if index.chunks and not index.chunks[-1].message_index_offsets:
            index.drop_last_chunk()
        room = index.end - index.chunks[0].chunk_start_offset if index.chunks else 0
        while True:
            self._stream.cut(index.end)
            ending = self._ending(notes)
            try:
                self._stream.write_ending(ending)
                return
            except OSError:
                self._stream.cut(index.end)
                if not index.chunks or 2 * len(ending) > room:
                    raise
                index.drop_last_chunk()

    def abandon_with(
        self, notes: Callable[[], Mapping[str, Mapping[str, str]]], also: Callable[[], object]
    ) -> None:
        """`abandon`, and give up chunks until what is written `also` has room. Raises OSError."""
        while True:
            self.abandon(notes())
            try:
                also()
                return
            except OSError:
                if not self._stream.index.chunks:
                    raise
                self._stream.index.drop_last_chunk()

    def _ending(self, notes: Mapping[str, Mapping[str, str]]) -> bytes:
        index = self._stream.index
        index.schemas = {schema.id: schema for schema in self._schemas.values()}
        index.channels = dict(self._channels)
        return index.ending(notes)

    def close(self) -> None:
        """Close the file as it is."""
        self._size = os.fstat(self._stream.file.fileno()).st_size
        self._stream.file.close()

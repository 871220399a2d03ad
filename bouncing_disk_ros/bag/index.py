"""The index of one .mcap file: what stands where in it, and which topics and types it defines.

A writer and a recovery build it from what they write, a reader from the summary of the file or from
a walk through it (`source`).
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    Chunk,
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

from bouncing_disk_ros.bag.chunk_reader import Inner, chunk_length
from bouncing_disk_ros.bag.metadata import FileRow
from bouncing_disk_ros.bag.records import MAGIC
from bouncing_disk_ros.errors import BagError


class PlainMessages(ChunkIndex):
    """Messages in a row outside of chunks, named as a chunk is."""


class Index:
    """The index of one .mcap file."""

    def __init__(self) -> None:
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.chunks: list[ChunkIndex] = []
        self.attachments: list[AttachmentIndex] = []
        self.metadata: list[MetadataIndex] = []
        self.chunk_counts: list[Counter[int]] = []  # of a summary: one for all chunks
        self._sure: dict[tuple[type, int], Schema | Channel] = {}  # definitions in chunks

    # --- building ---------------------------------------------------------------------------------
    def add_chunk(self, chunk: Chunk, inner: Inner, offset: int) -> ChunkIndex:
        """Take note of a chunk, with the times of its messages: its own have no checksum."""
        start, end = inner.span
        stored, size = len(chunk.data), len(inner.data)
        row = ChunkIndex(
            chunk_length(chunk), offset, chunk.compression, stored, end, 0, {}, start, size
        )
        self.chunks.append(row)
        self.chunk_counts.append(inner.counts)
        return row

    def add_messages(self, inner: Inner, offset: int) -> None:
        """Take note of messages in a row outside of chunks."""
        size, (first, last) = len(inner.data), inner.span
        self.chunks.append(PlainMessages(size, offset, "", size, last, 0, {}, first, size))
        self.chunk_counts.append(inner.counts)

    def drop_last_chunk(self) -> int:
        """Forget the newest chunk and all that is after it; where it begins."""
        self.chunk_counts.pop()
        end = self.chunks.pop().chunk_start_offset
        self.attachments = [row for row in self.attachments if row.offset < end]
        self.metadata = [row for row in self.metadata if row.offset < end]
        return end

    def define(self, row: Schema | Channel) -> None:
        """Take a definition that stands outside of chunks: those in chunks have a checksum."""
        if (type(row), row.id) not in self._sure:
            self._defined(row)[row.id] = row

    def define_all(self, inner: Inner) -> None:
        """Take those in a chunk; BagError when damaged, or unlike others in it or another chunk."""
        found: dict[tuple[type, int], Schema | Channel] = {}
        for row in inner.definitions():
            key = type(row), row.id
            if self._sure.get(key, row) != row or found.setdefault(key, row) != row:
                raise BagError(f"its definition of number {row.id} differs from an earlier one")
        self._sure.update(found)
        for row in found.values():
            self._defined(row)[row.id] = row

    def _defined(self, row: Schema | Channel) -> dict[int, Any]:
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

    def file_row(self, name: str, channels: Mapping[int, Channel]) -> tuple[FileRow, Counter[str]]:
        """The file as metadata.yaml names it, and the messages of each topic of some channels."""
        counts, found = self.counts, Counter[str]()
        for number, channel in channels.items():
            found[channel.topic] += counts[number]
        return FileRow(name, *self.span, found.total()), found

    def statistics(self, metadata: int) -> Statistics:
        """The statistics of a file with so many metadata records."""
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

    def ending(self, at: int, notes: Mapping[str, Mapping[str, str]]) -> bytes:
        """Notes, the end of the data section, summary and footer of a file, from `at` on."""
        out, metadata = RecordBuilder(), list(self.metadata)
        for name, values in notes.items():
            first = out.count
            Metadata(name, dict(values)).write(out)
            metadata.append(MetadataIndex(at + first, out.count - first, name))
        DataEnd(0).write(out)
        head, offsets = out.end(), list[SummaryOffset]()
        start = at + len(head)
        groups: dict[Opcode, Iterable[McapRecord]] = {
            Opcode.SCHEMA: self.schemas.values(),
            Opcode.CHANNEL: self.channels.values(),
            Opcode.STATISTICS: [self.statistics(len(metadata))],
            Opcode.CHUNK_INDEX: self.chunks,
            Opcode.ATTACHMENT_INDEX: self.attachments,
            Opcode.METADATA_INDEX: metadata,
        }
        for opcode, rows in groups.items():
            first = out.count
            for row in rows:
                row.write(out)
            if out.count > first:
                offsets.append(SummaryOffset(opcode, start + first, out.count - first))
        offsets_at = start + out.count
        for offset in offsets:
            offset.write(out)
        summary = out.end()
        tail = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offsets_at)
        Footer(start, offsets_at, zlib.crc32(tail, zlib.crc32(summary))).write(out)
        return bytes(head + summary + out.end() + MAGIC)

"""What the end of an .mcap file says of the rest: built while records are laid out, in any file.

The writer keeps it as it goes, so that a file can be closed in order after a failed write;
recovery builds it anew.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Callable, Mapping

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from bouncing_disk_ros.bag import fields
from bouncing_disk_ros.bag.files import HEAD

MAGIC = b"\x89MCAP0\r\n"


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
        """Take note of whole records that stand at `offset` of the file."""
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
        head = fields.chunk(content, len(content))
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
        channel, length = struct.unpack_from("<HI", content)
        chunk = self.chunks[-1]
        chunk.message_index_offsets[channel] = offset
        chunk.message_index_length += HEAD.size + len(content)
        self.counts[-1][channel] += length // 16

    def _attachment(self, content: memoryview, offset: int) -> None:
        self.add_attachment(content, offset, HEAD.size + len(content))

    def add_attachment(self, beginning: fields.Content, offset: int, length: int) -> None:
        """Take note of an attachment, of which the beginning of the content is given."""
        row = fields.attachment(beginning, length - HEAD.size)
        self.attachments.append(
            AttachmentIndex(offset, length, row.log_time, row.create_time, row.data_length,
                            row.name, row.media_type)
        )  # fmt: skip
        self.end = offset + length

    def _metadata(self, content: memoryview, offset: int) -> None:
        name = fields.metadata(content).name
        self.metadata.append(MetadataIndex(offset, HEAD.size + len(content), name))

    def _schema(self, content: memoryview, _offset: int) -> None:
        schema = fields.schema(content)
        self.schemas[schema.id] = schema

    def _channel(self, content: memoryview, _offset: int) -> None:
        channel = fields.channel(content)
        self.channels[channel.id] = channel

    _handlers: Mapping[int, Callable[[Index, memoryview, int], None]] = {
        Opcode.CHUNK: _chunk,
        Opcode.MESSAGE_INDEX: _message_index,
        Opcode.ATTACHMENT: _attachment,
        Opcode.METADATA: _metadata,
        Opcode.SCHEMA: _schema,
        Opcode.CHANNEL: _channel,
    }

    def drop_last_chunk(self) -> None:
        """Forget the newest chunk and all that stands after it."""
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

    def closing(self) -> bytes:
        """All that follows the data section: its end, the summary, the footer."""
        builder = RecordBuilder()
        DataEnd(0).write(builder)
        head = builder.end()
        start = self.end + len(head)
        groups = RecordBuilder()
        offsets = [self._group(groups, opcode, rows, start) for opcode, rows in self._groups()]
        offsets_at = start + groups.count
        for row in offsets:
            if row is not None:
                row.write(groups)
        summary = groups.end()
        tail = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offsets_at)
        Footer(start, offsets_at, zlib.crc32(tail, zlib.crc32(summary))).write(builder)
        return bytes(head + summary + builder.end() + MAGIC)

    def _groups(self) -> list[tuple[Opcode, list[McapRecord]]]:
        return [
            (Opcode.SCHEMA, list(self.schemas.values())),
            (Opcode.CHANNEL, list(self.channels.values())),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, list(self.chunks)),
            (Opcode.ATTACHMENT_INDEX, list(self.attachments)),
            (Opcode.METADATA_INDEX, list(self.metadata)),
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

    def _statistics(self) -> Statistics:
        counts, (first, last) = self.channel_counts, self.span
        return Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=dict(counts),
            chunk_count=len(self.chunks),
            message_count=counts.total(),
            message_end_time=last,
            message_start_time=first,
            metadata_count=len(self.metadata),
            schema_count=len(self.schemas),
        )

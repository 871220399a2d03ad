"""One .mcap file while it is written: mcap's writer on a stream that knows where it stands."""

from __future__ import annotations

import errno
import math
import os
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, McapRecord, Metadata, Schema
from mcap.writer import Writer as McapWriter

from bouncing_disk_ros.bag.latched import MARK, without_repeats
from bouncing_disk_ros.bag.metadata import FileRow, TopicRow, qos_text
from bouncing_disk_ros.bag.schema import ENCODING, schema_of
from bouncing_disk_ros.bag.stream import RecordStream
from bouncing_disk_ros.bag.writer_options import COMPRESSIONS, Options

PROFILE = "ros2"


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
        """Whether the file still stands where it was begun: not deleted, moved or replaced."""
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
        """Messages of each topic that stand in the file, without repeats of earlier ones."""
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
        """Notes, index and footer as bytes; the index is left as it was when writing fails."""
        index = self._stream.index
        index.schemas = {schema.id: schema for schema in self._schemas.values()}
        index.channels = dict(self._channels)
        builder = RecordBuilder()
        for name, values in notes.items():
            Metadata(name, dict(values)).write(builder)
        head = builder.end()
        end, rows = index.end, list(index.metadata)
        index.add(head, end)
        ending = bytes(head + index.closing())
        index.end, index.metadata = end, rows
        return ending

    def close(self) -> None:
        """Close the file as it is."""
        self._size = os.fstat(self._stream.file.fileno()).st_size
        self._stream.file.close()

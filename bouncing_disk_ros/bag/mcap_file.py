"""One .mcap file while it is written: mcap's writer on a stream that knows where it stands."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, McapRecord, Metadata, Schema
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from bouncing_disk_ros.bag.stream import RecordStream

PROFILE = "ros2"
COMPRESSIONS = {
    "zstd": CompressionType.ZSTD,
    "lz4": CompressionType.LZ4,
    "none": CompressionType.NONE,
}


class McapFile:
    """One file of a bag. Methods raise OSError when the disk takes no more; then `abandon` it."""

    def __init__(self, path: Path, compression: str, chunk_size: int, library: str) -> None:
        self.path = path
        self._stream = RecordStream(path)
        self._writer = McapWriter(self._stream, chunk_size, COMPRESSIONS[compression])  # type: ignore[arg-type, unused-ignore]
        self._writer.start(PROFILE, library)
        self._schemas: dict[str, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self.start_ns: int | None = None
        self.written: Counter[int] = Counter()
        self._chunk_began: float | None = None

    # --- content ----------------------------------------------------------------------------------
    def add_channel(
        self, topic: str, schema: tuple[str, str, bytes], metadata: Mapping[str, str]
    ) -> int:
        """Register a topic with its schema (name, encoding, text); the number of its channel."""
        name, encoding, text = schema
        if name not in self._schemas:
            number = self._writer.register_schema(name, encoding, text)
            self._schemas[name] = Schema(number, text, encoding, name)
            self._define(self._schemas[name])
        number = self._schemas[name].id
        channel = self._writer.register_channel(topic, "cdr", number, dict(metadata))
        self._channels[channel] = Channel(channel, topic, "cdr", dict(metadata), number)
        self._define(self._channels[channel])
        return channel

    def _define(self, record: McapRecord) -> None:
        """Write a definition at once, beside the copy that mcap puts into the next chunk.

        So a topic without messages is known after a crash, and a damaged chunk hides no topic.
        """
        builder = RecordBuilder()
        record.write(builder)
        self._stream.write(builder.end())

    def write(
        self, channel: int, log_time_ns: int, data: bytes, publish_time_ns: int, sequence: int
    ) -> None:
        """Add one message to the open chunk."""
        if self.start_ns is None:
            self.start_ns = log_time_ns
        self.written[channel] += 1
        position = self._stream.position
        self._writer.add_message(channel, log_time_ns, data, publish_time_ns, sequence)
        if self._stream.position != position:  # the chunk was full
            self._chunk_began = None
        elif self._chunk_began is None:
            self._chunk_began = time.monotonic()

    def attach(self, name: str, media_type: str, data: bytes, time_ns: int) -> None:
        """Add an attachment."""
        self._writer.add_attachment(time_ns, time_ns, name, media_type, data)

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record."""
        self._writer.add_metadata(name, dict(values))

    @property
    def chunk_age(self) -> float:
        """Seconds since the first message of the open chunk came; 0 without one."""
        return 0.0 if self._chunk_began is None else time.monotonic() - self._chunk_began

    def close_chunk(self) -> None:
        """Compress and write what is held in the open chunk."""
        self._writer.flush()
        self._chunk_began = None

    # --- end --------------------------------------------------------------------------------------
    @property
    def size(self) -> int:
        """Bytes in the file; the open chunk is not counted."""
        return self._stream.position

    @property
    def counts(self) -> dict[str, int]:
        """Messages of each topic that stand in the file."""
        counts = self._stream.index.channel_counts
        return {channel.topic: counts[number] for number, channel in self._channels.items()}

    @property
    def span(self) -> tuple[int, int]:
        """First and last time of reception in the file."""
        return self._stream.index.span

    @property
    def unwritten(self) -> dict[str, int]:
        """Messages of each topic that were given to this file and do not stand in it."""
        counts = self._stream.index.channel_counts
        rows = {c.topic: self.written[n] - counts[n] for n, c in self._channels.items()}
        return {topic: missing for topic, missing in rows.items() if missing}

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

    def give_up_chunk(self) -> bool:
        """Forget the newest chunk, to make room on a full disk; False when there is none."""
        if not self._stream.index.chunks:
            return False
        self._stream.index.drop_last_chunk()
        return True

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
        self._stream.file.close()

"""One .mcap file that is being written: its chunks, its end, and the `Options`.

The mcap library makes the bytes. It keeps an index too, but only in its writer. With the `Index` a
file can be closed in order after a failed write, and recovery can index the records that it copies.
"""

from __future__ import annotations

import errno
import math
import os
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Schema
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from bouncing_disk_ros.bag.index import Index
from bouncing_disk_ros.bag.metadata import FileRow, TopicRow, qos_text
from bouncing_disk_ros.bag.records import (
    MAGIC,
    MARK,
    AttachmentHead,
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

    def copy_attachment(
        self, file: RegularFile, head: AttachmentHead, offset: int, length: int
    ) -> None:
        """Copy an attachment record of another file, however long it is."""
        for part in file.parts(offset, length):
            self.write_ending(part)
        self.index.add_attachment(head, self.position, length)
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
        self._index = self._stream.index
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
        number = self._writer.register_channel(topic.name, "cdr", schema, texts)
        self._define(Channel(number, topic.name, "cdr", texts, schema))
        return number

    def _schema(self, kind: str) -> int:
        known = {row.name: number for number, row in self._index.schemas.items()}
        if kind in known:
            return known[kind]
        text = schema_of(kind).text.encode()
        number = self._writer.register_schema(kind, ENCODING, text)
        self._define(Schema(number, text, ENCODING, kind))
        return number

    def _define(self, row: Schema | Channel) -> None:
        """Write a definition at once, beside the copy that mcap puts into the next chunk.

        So a topic without messages is known after a crash, and a damaged chunk hides no topic.
        """
        self._index.define(row)
        builder = RecordBuilder()
        row.write(builder)
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
        return len(self._index.chunks)

    @property
    def size(self) -> int:
        """Bytes in the file; the open chunk is not counted."""
        return self._size or self._stream.position

    @property
    def filled(self) -> tuple[FileRow, Counter[str]]:
        """The file as metadata.yaml names it, and its messages of each topic, without repeats."""
        return self._index.file_row(self.path.name, without_repeats(self._index.channels))

    def finish(self, notes: Mapping[str, Mapping[str, str]]) -> None:
        """Write notes, index and footer. `close` it after that."""
        self._stream.write_ending(self._index.ending(notes))

    def abandon(self, notes: Mapping[str, Mapping[str, str]]) -> None:
        """After a failed write: keep what is whole, give up chunks until the index has room.

        Raises OSError when that cannot be: the file cannot be cut, or the index needs more room
        than half of the chunks. It is then unfinished, holds all whole chunks, and can be read.
        """
        index = self._index
        if index.chunks and not index.chunks[-1].message_index_offsets:
            index.drop_last_chunk()
        room = index.end - index.chunks[0].chunk_start_offset if index.chunks else 0
        while True:
            self._stream.cut(index.end)
            ending = index.ending(notes)
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
                if not self._index.chunks:
                    raise
                self._index.drop_last_chunk()

    def close(self) -> None:
        """Close the file as it is."""
        self._size = os.fstat(self._stream.file.fileno()).st_size
        self._stream.file.close()

"""Write a rosbag2 bag: a folder of .mcap files and metadata.yaml, raw CDR messages, split at will.

    with Writer("run_1") as writer:
        writer.add_topic("/disk/impacts", "sensor_msgs/msg/PointCloud2")
        writer.write("/disk/impacts", cdr, log_time_ns=..., publish_time_ns=..., sequence=...)

`Writer` writes the folder, `McapFile` one file in it with its chunks (`McapFile.close_chunk`). One
thread at a time; `recording.Recording` puts a queue before it.
"""

from __future__ import annotations

import contextlib
import errno
import math
import os
import time
import zlib
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import lz4.frame
import zstandard
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    Header,
    MetadataIndex,
    Schema,
)
from mcap.records import Metadata as MetadataRecord

from bouncing_disk_ros.bag import metadata
from bouncing_disk_ros.bag.chunk_reader import Inner
from bouncing_disk_ros.bag.index import Index
from bouncing_disk_ros.bag.metadata import FileRow, Metadata, OfferedQos, TopicRow
from bouncing_disk_ros.bag.notes import FORMAT_KEY, FORMAT_VERSION, NOTE, signed
from bouncing_disk_ros.bag.records import (
    HEAD,
    MAGIC,
    MARK,
    MESSAGE,
    chunk_record,
    parts,
    record,
    without_repeats,
)
from bouncing_disk_ros.bag.schema import ENCODING, schema_of
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.regular_file import RegularFile, not_made
from bouncing_disk_ros.units import NS


class WriteError(Exception):
    """Error of a bag that cannot be written further. It is closed and can be read. One line."""


DISPLACED = "was deleted, moved or replaced"


def write_error(folder: Path, error: Exception, lost: int, *, is_there: bool = True) -> WriteError:
    """The line for the user: why nothing more can be written, and how much is lost by it.

    `is_there`: whether all files of the bag are in their place.
    """
    if isinstance(error, OSError):
        why = error.strerror or str(error)
    else:
        why = f"an error of the recorder itself, {type(error).__name__}: {error}"
    what = f"; {lost} messages that were received are not in it" if lost else ""
    why = f"recording ended: {why}{what}"
    rest = "The bag can be read up to that point"
    if not is_there:
        rest = "A bag that was moved can be read where it is now"
    return WriteError(f"{folder}: {why}. {rest}")


# --- messages that a later file repeats -----------------------------------------------------------
class Kept(NamedTuple):
    """A latched message, which each later file of a split bag begins with: so it stands alone.

    Repeats have a channel of their own, marked in its metadata and without quality of service,
    beside the topic's ordinary one. Our reader skips them when it has read the file before, and so
    does `rosbags`; a single file shows them to every tool as messages of the topic.
    """

    data: bytes
    publish_time_ns: int
    sequence: int


class Latched:
    """What a late joiner of a topic is to be given: the last `depth` messages.

    Where `begins` is true of a message, those before it are not needed any more.
    """

    def __init__(self, depth: int, begins: Callable[[bytes], bool] | None = None) -> None:
        self.messages: deque[Kept] = deque(maxlen=depth)
        self._begins = begins

    def deepen(self, depth: int) -> None:
        """Keep more messages from now on (or fewer)."""
        self.messages = deque(self.messages, maxlen=depth)

    def take(self, data: bytes, publish_time_ns: int, sequence: int) -> None:
        """A message was written."""
        if self._begins is not None and self._begins(data):
            self.messages.clear()
        self.messages.append(Kept(data, publish_time_ns, sequence))


# --- one file of a bag ----------------------------------------------------------------------------
PROFILE = "ros2"
COMPRESSIONS: dict[str, Callable[[], Callable[[bytes], bytes]]] = {
    "zstd": lambda: zstandard.ZstdCompressor().compress,
    "lz4": lambda: lz4.frame.compress,
    "none": lambda: bytes,
}
"""Makers of what compresses the chunks of one file, one after the other, with memory of its own."""


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
    """One .mcap file that is written, by a recording or a recovery, with its `index`.

    Methods raise OSError when the disk takes no more; then `abandon` the file. The mcap library
    makes the records. Its own writer cannot end a file in order after a failed write, and takes no
    chunk as it is.
    """

    def __init__(self, path: Path, library: str, options: Options | None = None) -> None:
        self.path, self.index = path, Index()
        self.start_ns: int | None = None
        self.size = 0
        """Bytes in the file; the open chunk is not counted."""
        self.due = math.inf  # when the open chunk is to be closed, by the steady clock
        self._options = options or Options()
        self._chunk: list[bytes] = []  # the records of the open chunk, in pieces
        self._filled = 0  # bytes of them
        self._compress = {name: make() for name, make in COMPRESSIONS.items()}
        self._file = path.open("xb", buffering=0)
        self._write(MAGIC + record(Header(PROFILE, library)))

    def _write(self, *pieces: bytes) -> None:
        """Write whole records; after an OSError, `size` is still the end of what is whole."""
        for piece in pieces:
            view = memoryview(piece)
            while view:
                view = view[self._file.write(view) or 0 :]
        self.size += sum(map(len, pieces))

    # --- records ----------------------------------------------------------------------------------
    def add_channel(self, topic: TopicRow, *, repeats: bool = False) -> int:
        """Register a topic, or a place for repeats of its messages; the number of the channel."""
        schema = self._schema(topic.type)
        texts = {"topic_type_hash": topic.type_hash}
        if repeats:
            texts[MARK] = "latched"
        else:
            texts["offered_qos_profiles"] = metadata.qos_text(topic.qos)
        number = len(self.index.channels) + 1
        self.define(Channel(number, topic.name, "cdr", texts, schema))
        return number

    def _schema(self, kind: str) -> int:
        known = {row.name: number for number, row in self.index.schemas.items()}
        if kind in known:
            return known[kind]
        number = len(self.index.schemas) + 1
        self.define(Schema(number, schema_of(kind).text.encode(), ENCODING, kind))
        return number

    def define(self, row: Schema | Channel) -> None:
        """Write a definition at once, and again in the next chunk.

        So a topic without messages is known after a crash, and a damaged chunk hides no topic.
        """
        written = record(row)
        self._write(written)
        self._chunk.append(written)
        self._filled += len(written)
        self.index.define(row)

    def attach(self, name: str, media_type: str, data: bytes, time_ns: int) -> None:
        """Add an attachment."""
        row = record(Attachment(time_ns, time_ns, name, media_type, data))
        place = AttachmentIndex(self.size, len(row), time_ns, time_ns, len(data), name, media_type)
        self._write(row)
        self.index.attachments.append(place)

    def copy_attachment(self, file: RegularFile, row: AttachmentIndex) -> None:
        """Copy an attachment record of another file, however long it is."""
        place = replace(row, offset=self.size)
        for part in parts(file, row.offset, row.length):
            self._write(part)
        self.index.attachments.append(place)

    def note(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record."""
        row = record(MetadataRecord(name, dict(values)))
        place = MetadataIndex(self.size, len(row), name)
        self._write(row)
        self.index.metadata.append(place)

    # --- chunks -----------------------------------------------------------------------------------
    def write(
        self, channel: int, log_time_ns: int, data: bytes, publish_time_ns: int, sequence: int
    ) -> bool:
        """Add one message to the open chunk; whether the chunk is full and written."""
        if self.start_ns is None:
            self.start_ns = log_time_ns
        length, chunk = MESSAGE.size - HEAD.size + len(data), self._chunk
        chunk.append(
            MESSAGE.pack(Opcode.MESSAGE, length, channel, sequence, log_time_ns, publish_time_ns)
        )
        chunk.append(data)
        self._filled += HEAD.size + length
        if self.due == math.inf:
            self.due = time.monotonic() + self._options.chunk_period
        if self._filled <= self._options.chunk_size:
            return False
        self.close_chunk()
        return True

    def close_chunk(self) -> None:
        """Compress and write the messages of the open chunk, if there are any."""
        if self.due == math.inf:
            return
        data, self._chunk, self._filled, self.due = b"".join(self._chunk), [], 0, math.inf
        self.add_chunk(Inner(data), self._options.compression)

    def add_chunk(self, inner: Inner, compression: str) -> None:
        """Compress records and write them as a chunk."""
        stored, crc = self._compress[compression](inner.data), zlib.crc32(inner.data)
        name = "" if compression == "none" else compression
        self.copy_chunk(Chunk(name, stored, 0, 0, crc, len(inner.data)), inner)

    def copy_chunk(self, chunk: Chunk, inner: Inner) -> None:
        """Write a chunk as it is, but with the times of its messages, and the index of them."""
        first, last = inner.span
        chunk = replace(chunk, message_start_time=first, message_end_time=last)
        written, places = [*chunk_record(chunk)], dict[int, int]()
        at = self.size + sum(map(len, written))
        for channel, row in inner.indices():
            places[channel] = at
            written.append(row)
            at += len(row)
        offset = self.size
        self._write(*written)
        row = self.index.add_chunk(chunk, inner, offset)
        row.message_index_offsets = places
        row.message_index_length = self.size - offset - row.chunk_length

    # --- state ------------------------------------------------------------------------------------
    @property
    def is_in_place(self) -> bool:
        """Whether the file is still at its path: not deleted, moved or replaced."""
        try:
            return os.path.samestat(os.fstat(self._file.fileno()), self.path.lstat())
        except OSError:
            return False

    def check_room(self) -> None:
        """OSError where messages wait to be written and the disk is full."""
        disk = os.fstatvfs(self._file.fileno())
        free = disk.f_bavail if os.geteuid() else disk.f_bfree
        if self.due < math.inf and disk.f_blocks and not free:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    @property
    def filled(self) -> tuple[FileRow, Counter[str]]:
        """The file as metadata.yaml names it, and its messages of each topic, without repeats."""
        return self.index.file_row(self.path.name, without_repeats(self.index.channels))

    # --- end --------------------------------------------------------------------------------------
    def finish(self, notes: Mapping[str, Mapping[str, str]]) -> None:
        """Write notes, index and footer. `close` it after that."""
        self._write(self.index.ending(self.size, notes))

    def abandon(
        self, notes: Callable[[], Mapping[str, Mapping[str, str]]], also: Callable[[], object]
    ) -> None:
        """After a failed write: keep what is whole, give up chunks until the index has room.

        So has what is written `also`. Raises OSError when that cannot be: the file cannot be cut,
        or the index needs more room than half of the chunks. It is then unfinished, holds all whole
        chunks, and can be read.
        """
        index, end = self.index, self.size
        room = end - index.chunks[0].chunk_start_offset if index.chunks else 0
        while True:
            self._cut(end)
            ending = index.ending(end, notes())
            try:
                self._write(ending)
                also()
                return
            except OSError:
                if not index.chunks or 2 * len(ending) > room:
                    self._cut(end)
                    raise
                end = index.drop_last_chunk()

    def _cut(self, end: int) -> None:
        """Throw away what is after `end`, and write the next record there."""
        self._file.truncate(end)
        self._file.seek(end)
        self.size = end

    def close(self) -> None:
        """Close the file as it is."""
        self._file.close()


# --- the bag --------------------------------------------------------------------------------------
class Writer:
    """Writer of one bag. InputError: the folder cannot be made; WriteError: the disk is full.

    FailedError: it is full from the beginning.

    `notes` are texts that go into metadata.yaml (custom_data) and into every file.
    """

    def __init__(
        self,
        folder: str | Path,
        options: Options | None = None,
        *,
        version: str = "",
        notes: Mapping[str, str] | None = None,
    ) -> None:
        self.folder, self.options = Path(folder), options or Options()
        self.notes: dict[str, str] = {FORMAT_KEY: str(FORMAT_VERSION), "version": version}
        self.notes.update(notes or {})
        self.lost_on_disk: Counter[str] = Counter()
        self._given: Counter[str] = Counter()
        self._topics: dict[str, TopicRow] = {}
        self._latched: dict[str, Latched] = {}
        self._attachments: list[tuple[str, str, bytes, int]] = []
        self._finished: list[tuple[FileRow, Counter[str]]] = []
        self._channels: dict[str, int] = {}
        self._file: McapFile | None = None
        self._splits = self.options.max_size > 0 or self.options.max_duration > 0
        self._finished_size, self._head = 0, 0
        self._closed, self._in_place = False, True
        try:
            self.folder.mkdir(parents=True)
            self._begin_file()
        except OSError as error:
            allowed = "the name of a new folder, where files can be made"
            raise not_made("output", self.folder, allowed, error) from None

    # --- content ----------------------------------------------------------------------------------
    def add_topic(
        self,
        name: str,
        kind: str,
        qos: Sequence[OfferedQos | Mapping[str, Any]] = (),
        type_hash: str | None = None,
    ) -> None:
        """Register a topic, once, before its first message; InputError when the type is unknown.

        `type_hash` is what the publisher announces; None: that of the installed definition.
        """
        if name in self._topics:
            return
        known = schema_of(kind).type_hash
        rows = [row.as_dict() if isinstance(row, OfferedQos) else dict(row) for row in qos]
        topic = TopicRow(name, kind, rows, known if type_hash is None else type_hash)
        self._topics[name] = topic

        def add() -> None:
            self._channels[name] = self._open_file().add_channel(topic)

        self._guarded(add)

    def repeat(self, topic: str, depth: int, begins: Callable[[bytes], bool] | None = None) -> None:
        """Repeat the last `depth` messages of a latched topic where a new file begins.

        A message of which `begins` is true makes those before it unnecessary. Call it again to
        change the depth. The topic needs its quality of service: `rosbags` distinguishes repeats by
        it.
        """
        self._latched.setdefault(topic, Latched(depth, begins)).deepen(depth)

    def write(
        self,
        topic: str,
        data: bytes,
        log_time_ns: int,
        publish_time_ns: int | None = None,
        sequence: int = 0,
    ) -> None:
        """Add one message: CDR as received, when it was received and sent, its number."""
        data = bytes(data)  # its caller may change an array of bytes; bytes are not copied
        self._given[topic] += 1
        file = self._file_for(log_time_ns) if self._splits else self._file or self._open_file()
        sent = log_time_ns if publish_time_ns is None else publish_time_ns
        number = sequence & 0xFFFFFFFF
        try:
            if file.start_ns is None:
                self._repeat_latched(file, log_time_ns)
                self._head = file.size if self.options.max_size else 0
            is_written = file.write(self._channels[topic], log_time_ns, data, sent, number)
        except OSError as error:
            raise self.fail(error) from None
        if topic in self._latched:
            self._latched[topic].take(data, sent, number)
        if is_written:
            self._bound_index()
        if time.monotonic() >= file.due:
            self.tick()

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Attach a file; every file of a split bag gets it."""
        row = (name, media_type, data, time.time_ns())
        self._attachments.append(row)
        self._guarded(lambda: self._open_file().attach(*row))

    def tick(self) -> None:
        """Close a chunk that is old enough; call it now and then while nothing is written."""
        if time.monotonic() >= self._open_file().due:
            self._guarded(lambda: self._open_file().close_chunk())
            self._bound_index()

    def check(self) -> None:
        """WriteError where the file was deleted, moved or replaced, or its disk is full."""
        file = self._file
        if file is not None and not file.is_in_place:
            raise self.fail(FileNotFoundError(errno.ENOENT, f"{file.path.name} {DISPLACED}"))
        if file is not None:
            self._guarded(file.check_room)

    def _bound_index(self) -> None:
        """Go on in a new file when the index of this one has become large."""
        if len(self._open_file().index.chunks) >= self.options.max_chunks:
            self.split()

    def split(self) -> None:
        """Finish the file and go on in a new one."""
        self._guarded(self._finish_file)
        self._guarded(self._begin_file)

    @property
    def size(self) -> int:
        """Bytes written so far, in all files."""
        return self._finished_size + (self._file.size if self._file else 0)

    # --- files ------------------------------------------------------------------------------------
    def _open_file(self) -> McapFile:
        if self._file is None:
            raise WriteError(f"{self.folder}: the bag is closed")
        return self._file

    def _guarded(self, action: Callable[[], object]) -> None:
        try:
            action()
        except OSError as error:
            raise self.fail(error) from None

    def _file_for(self, log_time_ns: int) -> McapFile:
        """The file that a message goes into: a new one when the open one is full."""
        file = self._open_file()
        if file.start_ns is not None:
            limit = self.options.max_duration
            too_long = limit > 0 and log_time_ns - file.start_ns >= limit * NS
            # no file of a head alone, whatever was attached since the size was chosen
            if too_long or 0 < max(self.options.max_size, 2 * self._head) <= file.size:
                self.split()
        return self._open_file()

    def _begin_file(self) -> None:
        name = f"{self.folder.name}_{len(self._finished)}.mcap"
        library = f"bouncing_disk_ros {self.notes['version']}".strip()
        self._file = McapFile(self.folder / name, library, self.options)
        self._file.note(NOTE, signed(self.notes))
        for row in self._attachments:
            self._file.attach(*row)
        for topic in self._topics.values():
            self._channels[topic.name] = self._file.add_channel(topic)

    def _repeat_latched(self, file: McapFile, log_time_ns: int) -> None:
        """Begin a file with what is latched, received as it were with the file's first message."""
        for name, latched in self._latched.items():
            if latched.messages:
                channel = file.add_channel(self._topics[name], repeats=True)
                for kept in latched.messages:
                    file.write(channel, log_time_ns, *kept)

    def _finish_file(self) -> None:
        file = self._open_file()
        file.close_chunk()
        file.finish(self._last_notes(file))
        self._keep(file)

    def _keep(self, file: McapFile) -> None:
        file.close()
        self._finished_size += file.size
        self._finished.append(file.filled)
        self._file = None

    def _last_notes(self, file: McapFile) -> dict[str, dict[str, str]]:
        return metadata.last_notes(self.notes, self._metadata([file.filled]))

    def _metadata(self, files: list[tuple[FileRow, Counter[str]]]) -> Metadata:
        return metadata.summed(files, self._topics.values(), self.notes)

    # --- end --------------------------------------------------------------------------------------
    def close(self) -> None:
        """Finish the file and write metadata.yaml. A second call does nothing."""
        if self._closed:
            return
        self._guarded(self._finish_file)
        self._closed = True
        self._guarded(self._write_metadata)

    def fail(self, error: Exception) -> WriteError:
        """Close the bag after an error, so that what it holds can be read; the line to report."""
        if not self._closed and self._file is not None and not self._file.is_in_place:
            self._end_displaced(self._file)
        elif not self._closed:
            self._end_early("the disk took no more" if isinstance(error, OSError) else repr(error))
        self._in_place &= all((self.folder / row.path).exists() for row, _ in self._finished)
        lost = self.lost_on_disk.total()
        return write_error(self.folder, error, lost, is_there=self._in_place)

    def _end_early(self, why: str) -> None:
        file, self._closed = self._file, True
        self.notes["ended"] = why
        with contextlib.suppress(Exception):  # then it is unfinished, and still readable
            if file is None:
                self._write_metadata()
            else:
                write = partial(self._write_metadata, file)
                file.abandon(partial(self._last_notes, file), write)
        if file is not None:
            self._keep(file)
        self.lost_on_disk = self._given - sum((n for _, n in self._finished), Counter())

    def _end_displaced(self, file: McapFile) -> None:
        """Complete the open file wherever it is now; nothing is written in its place."""
        self._closed, self._in_place = True, False
        with contextlib.suppress(Exception):
            file.close_chunk()
            file.abandon(partial(self._last_notes, file), lambda: None)
        kept = [counts for row, counts in self._finished if (self.folder / row.path).exists()]
        self._keep(file)
        self.lost_on_disk = self._given - sum(kept, Counter())

    def _write_metadata(self, *unfinished: McapFile) -> None:
        files = [*self._finished, *(file.filled for file in unfinished)]
        metadata.write(self.folder, self._metadata(files))

    def __enter__(self) -> Writer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:  # fmt: skip
        if not isinstance(error, WriteError):
            self.close()

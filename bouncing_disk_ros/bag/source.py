"""One .mcap file to read: its messages, attachments and notes, by its index or by a walk."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Metadata,
    MetadataIndex,
    Schema,
)

from bouncing_disk_ros.bag import records
from bouncing_disk_ros.bag.chunk_reader import Inner, unpacked
from bouncing_disk_ros.bag.index import Index, PlainMessages, index_of
from bouncing_disk_ros.bag.records import HEAD, AttachmentHead, RegularFile, Watch, nothing
from bouncing_disk_ros.bag.walk import Damage, Piece, Walk, describe
from bouncing_disk_ros.errors import BagError


class Source:
    """Reads one file, which is open only while it is read. `remarks`: what could not be read."""

    def __init__(self, path: Path, watch: Watch = nothing) -> None:
        """Take its index, or walk through it: `watch` is called meanwhile.

        Raises InputError when it is no file that can be read, BagError when it is no .mcap file.
        """
        self.path, self.remarks = path, list[str]()
        with RegularFile(path) as file:
            found = index_of(file)
            self.indexed = isinstance(found, Index)
            self.index = found if isinstance(found, Index) else self._walked(file, watch, found)
        self.channels = self.index.channels
        """The channels to read."""

    def _walked(self, file: RegularFile, watch: Watch, reason: str) -> Index:
        """The index by a walk, for a `reason`."""
        self.remarks.append(f"{self.path.name}: {reason}; read from beginning to end instead")
        index, damages = Index(), list[Damage]()
        for piece in Walk(file, watch).pieces():
            if isinstance(piece, Damage):  # what was lost in it is counted after it
                damages.append(piece)
                continue
            try:
                _take(index, piece)
            except BagError as error:
                damages.append(Damage(piece.offset, piece.length, str(error)))
        self.remarks += [describe(self.path.name, one) for one in damages if one.length]
        if unnamed := sum(n for number, n in index.counts.items() if number not in index.channels):
            self.remarks.append(f"{self.path.name}: {unnamed} messages of topics without a name")
        return index

    # --- content ----------------------------------------------------------------------------------
    def read(self, chunk: ChunkIndex) -> Inner:
        """The messages of a chunk, checked; BagError when it is damaged or not as it is named."""
        start, end = chunk.message_start_time, chunk.message_end_time
        try:
            with RegularFile(self.path) as file:
                record = file.read(chunk.chunk_start_offset, chunk.chunk_length)
            inner = (
                Inner(record) if isinstance(chunk, PlainMessages) else self._chunk(chunk, record)
            )
            first, last = inner.span
            if len(inner.times) and not start <= first <= last <= end:
                raise BagError("it holds messages of other times than the index says")
            if self.indexed and not inner.counts.keys() <= self.index.channels.keys():
                raise BagError("it holds messages of topics that the index does not name")
        except BagError as error:
            hint = "`bag_recover` saves the rest"
            where = f"{self.path}: chunk at byte {chunk.chunk_start_offset}"
            raise BagError(f"{where}: {error}. {hint}") from None
        return inner

    def _chunk(self, chunk: ChunkIndex, record: bytes) -> Inner:
        opcode, length = HEAD.unpack_from(record)
        if self.indexed and (opcode != Opcode.CHUNK or length != chunk.chunk_length - HEAD.size):
            raise BagError("damaged: there is no chunk at the place that the index gives")
        head, data = unpacked(memoryview(record)[HEAD.size :])
        if head.size != chunk.uncompressed_size:
            raise BagError("damaged: its size differs from that in the index")
        inner = Inner(data)
        for row in inner.definitions():
            if self.index.defined(row).get(row.id, row) != row:
                raise BagError(f"its definition of number {row.id} differs from the index")
        return inner

    def attachments(self) -> Iterator[Attachment]:
        """The attachments, their checksums checked."""
        for row in self.index.attachments:
            with self._record(Opcode.ATTACHMENT, row) as (file, start):
                head = records.checked_attachment(file, row.offset, row.length)
                data = file.read(start + head.data_at, head.data_length)
            yield Attachment(head.create_time, head.log_time, head.name, head.media_type, data)

    def metadata(self) -> Iterator[Metadata]:
        """The metadata records."""
        for row in self.index.metadata:
            with self._record(Opcode.METADATA, row) as (file, start):
                found = records.read(Metadata, file.read(start, row.length - HEAD.size))
            yield found

    @contextmanager
    def _record(
        self, opcode: Opcode, row: AttachmentIndex | MetadataIndex
    ) -> Iterator[tuple[RegularFile, int]]:
        """The file and where the content of a record begins that the index names."""
        what = opcode.name.lower()
        try:
            with RegularFile(self.path) as file:
                head = HEAD.unpack(file.read(row.offset, HEAD.size))
                if head != (opcode, row.length - HEAD.size):
                    raise BagError("there is none where the index says")
                yield file, row.offset + HEAD.size
        except BagError as error:
            reason = str(error).removeprefix("damaged: ")
            raise BagError(f"{self.path}: {what} at byte {row.offset}: damaged: {reason}") from None


def _take(index: Index, piece: Piece) -> None:
    """Take note of what a walk has found; BagError for definitions that contradict each other."""
    inner = piece.inner
    match piece.content:
        case None if inner is not None and piece.opcode == Opcode.CHUNK:
            index.define_all(inner)
            index.add_chunk(memoryview(piece.record)[HEAD.size :], piece.offset, inner.counts)
        case None if inner is not None:
            index.add_messages(inner, piece.offset)
        case Schema() | Channel() as row:
            index.define(row)
        case AttachmentHead() as head:
            index.add_attachment(head, piece.offset, piece.length)
        case Metadata(name=name):
            index.metadata.append(MetadataIndex(piece.offset, piece.length, name))

"""One .mcap file to read: its blocks of messages, topics and notes, by its index or by a walk.

Records and index are those of the mcap library; an index is taken only when nothing in it
contradicts the file, and chunks are read by `chunk_reader`.
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Footer,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)  # fmt: skip
from mcap.summary import Summary

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag import records
from bouncing_disk_ros.bag.chunk_reader import Definitions, Inner, inner_definitions, unpacked
from bouncing_disk_ros.bag.records import HEAD, MAGIC, RegularFile, Watch, nothing
from bouncing_disk_ros.bag.walk import Damage, Piece, Walk, describe, record_name
from bouncing_disk_ros.errors import BagError, InputError

_FOOTER = HEAD.size + 20
_LEAST_MESSAGE = HEAD.size + 22


class Block(NamedTuple):
    """A chunk, or (`plain`) messages in a row outside of chunks."""

    offset: int
    length: int
    start_ns: int
    end_ns: int
    size: int  # decompressed
    plain: bool = False


def summary_of(file: RegularFile) -> Summary | str:
    """The index of a file, or why there is none. BagError when it is damaged or untrue."""
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
    found = _read(content)
    if found.statistics is None or not _names_all(found, found.statistics):
        return "it has no complete index"
    _check(found, found.statistics, start)
    return found


def _read(content: bytes) -> Summary:
    """The records of an index, each checked by itself."""
    found, view = Summary(), memoryview(content)
    defined = others = 0
    for opcode, position, whole in records.places(content):
        row = view[position + HEAD.size : position + whole]
        match opcode:
            case Opcode.SCHEMA:
                schema = records.read(Schema, row)
                found.schemas[schema.id] = schema
                defined += 1
            case Opcode.CHANNEL:
                channel = records.read(Channel, row)
                found.channels[channel.id] = channel
                defined += 1
            case Opcode.STATISTICS if found.statistics is None:
                found.statistics = records.read(Statistics, row)
            case Opcode.CHUNK_INDEX:
                found.chunk_indexes.append(records.read(ChunkIndex, row))
            case Opcode.ATTACHMENT_INDEX:
                found.attachment_indexes.append(records.read(AttachmentIndex, row))
            case Opcode.METADATA_INDEX:
                found.metadata_indexes.append(records.read(MetadataIndex, row))
            case _:
                others += 1
                is_known = opcode == Opcode.SUMMARY_OFFSET or opcode >= 0x80
                if not is_known or others > limits.RECORDS:
                    raise BagError(f"a record of kind {opcode} is not allowed in it")
        if defined > limits.DEFINED:
            raise BagError(f"it has more than {limits.DEFINED} definitions")
    return found


def _names_all(found: Summary, statistics: Statistics) -> bool:
    """Whether an index has each group of records that it may leave out and the file needs."""
    types = {row.schema_id for row in found.channels.values()}
    return (
        bool(found.chunk_indexes or not (statistics.chunk_count or statistics.message_count))
        and bool(found.attachment_indexes or not statistics.attachment_count)
        and bool(found.metadata_indexes or not statistics.metadata_count)
        and statistics.channel_message_counts.keys() <= found.channels.keys()
        and types <= {0, *found.schemas}
    )


def _check(found: Summary, statistics: Statistics, end: int) -> None:
    """BagError when the index contradicts itself or the file, whose data section ends at `end`."""
    chunks, passed = found.chunk_indexes, len(MAGIC)
    named = [(row.chunk_start_offset, row.chunk_length) for row in chunks]
    named += [(row.offset, row.length) for row in found.attachment_indexes]
    named += [(row.offset, row.length) for row in found.metadata_indexes]
    for offset, length in sorted(named):
        if offset < passed or length < HEAD.size or offset + length > end:
            raise BagError("it names records that overlap or lie outside of the file")
        passed = offset + length
    counted = statistics.chunk_count, statistics.attachment_count, statistics.metadata_count
    if counted != (len(chunks), len(found.attachment_indexes), len(found.metadata_indexes)):
        raise BagError("its counts of records differ from the records that it names")
    if statistics.message_count * _LEAST_MESSAGE > sum(row.uncompressed_size for row in chunks):
        raise BagError("it counts more messages than there is room for")


# --- the file -------------------------------------------------------------------------------------
class Source:
    """Reads one file, which is open only while it is read. `remarks`: what could not be read."""

    def __init__(self, path: Path, watch: Watch = nothing) -> None:
        """Take its index, or walk through it: `watch` is called meanwhile.

        Raises InputError when it is no file that can be read, BagError when it is no .mcap file.
        """
        self.path, self._watch = path, watch
        self.blocks: list[Block] = []
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.counts: Counter[int] = Counter()
        self.damages: list[Damage] = []
        self.remarks: list[str] = []
        self.names: dict[int, str] = {}  # of attachments and notes, by their offsets
        self._attachments: list[tuple[int, int]] = []
        self._metadata: list[tuple[int, int]] = []
        with RegularFile(path) as file:
            if not file.size:
                raise InputError("bag", str(path), "a readable .mcap file", "It is empty.")
            try:
                self.indexed = self._load(file)
            except BagError as error:
                raise BagError(f"{path}: {error}") from None
        self._defined = dict(self.channels)

    def _load(self, file: RegularFile) -> bool:
        """Whether the file's own index could be taken."""
        try:
            found = summary_of(file)
        except BagError as error:
            found = f"its index is damaged ({error})"
        if not isinstance(found, Summary):
            self.remarks = [f"{self.path.name}: {found}; read from beginning to end instead"]
            self._walk(file)
            return False
        assert found.statistics is not None
        self.blocks = [
            Block(
                row.chunk_start_offset, row.chunk_length, row.message_start_time,
                row.message_end_time, row.uncompressed_size,
            )
            for row in found.chunk_indexes
        ]  # fmt: skip
        self.counts = Counter(found.statistics.channel_message_counts)
        self.schemas, self.channels = found.schemas, found.channels
        for row in found.attachment_indexes:
            self._attachments.append((row.offset, row.length))
            self.names[row.offset] = record_name(Opcode.ATTACHMENT, row.name)
        for note in found.metadata_indexes:
            self._metadata.append((note.offset, note.length))
            self.names[note.offset] = record_name(Opcode.METADATA, note.name)
        return True

    # --- by a walk --------------------------------------------------------------------------------
    def _walk(self, file: RegularFile) -> None:
        found = Definitions()
        self.schemas, self.channels = found.schemas, found.channels
        for piece in Walk(file, self._watch).pieces():
            if isinstance(piece, Damage):
                self.damages.append(piece)
                continue
            try:
                self._take(found, piece)
            except BagError as error:
                self.damages.append(Damage(piece.offset, piece.length, str(error)))
        self.remarks += [
            describe(self.path.name, damage) for damage in self.damages if damage.length
        ]
        if unnamed := sum(n for number, n in self.counts.items() if number not in self.channels):
            self.remarks.append(f"{self.path.name}: {unnamed} messages of topics without a name")

    def _take(self, found: Definitions, piece: Piece) -> None:
        match piece.opcode:
            case Opcode.CHUNK | Opcode.MESSAGE if piece.inner is not None:
                found.take_inner(piece.inner)
                self.counts += piece.inner.counts
                place, size = (piece.offset, piece.length), len(piece.inner.data)
                plain = piece.opcode == Opcode.MESSAGE
                self.blocks.append(Block(*place, *piece.inner.span, size, plain))
            case Opcode.SCHEMA | Opcode.CHANNEL:
                found.take(piece.opcode, memoryview(piece.record)[HEAD.size :])
            case Opcode.ATTACHMENT:
                self._attachments.append((piece.offset, piece.length))
            case Opcode.METADATA:
                self._metadata.append((piece.offset, piece.length))

    # --- content ----------------------------------------------------------------------------------
    def pieces(self) -> Iterator[tuple[RegularFile, Piece | Damage]]:
        """Everything in the file from its beginning, whatever its index says."""
        with RegularFile(self.path) as file:
            for piece in Walk(file, self._watch).pieces():
                yield file, piece

    def read(self, block: Block) -> Inner:
        """The messages of a block, checked; BagError when it is damaged or not as it is named."""
        try:
            with RegularFile(self.path) as file:
                record = file.read(block.offset, block.length)
            inner = Inner(record) if block.plain else self._chunk(block, record)
            first, last = inner.span
            if len(inner.times) and not block.start_ns <= first <= last <= block.end_ns:
                raise BagError("it holds messages of other times than the index says")
            if self.indexed and not inner.counts.keys() <= self._defined.keys():
                raise BagError("it holds messages of topics that the index does not name")
        except BagError as error:
            hint = "`bag_recover` saves the rest"
            where = f"{self.path}: chunk at byte {block.offset}"
            raise BagError(f"{where}: {error}. {hint}") from None
        return inner

    def _chunk(self, block: Block, record: bytes) -> Inner:
        opcode, length = HEAD.unpack_from(record)
        if self.indexed and (opcode != Opcode.CHUNK or length != block.length - HEAD.size):
            raise BagError("damaged: there is no chunk at the place that the index gives")
        head, data = unpacked(memoryview(record)[HEAD.size :])
        if head.size != block.size:
            raise BagError("damaged: its size differs from that in the index")
        inner = Inner(data)
        for opcode, row in inner_definitions(inner):
            known = self.schemas if opcode == Opcode.SCHEMA else self._defined
            if known.get(row.id, row) != row:
                raise BagError(f"its definition of number {row.id} differs from the index")
        return inner

    def attachments(self) -> Iterator[Attachment]:
        """The attachments, their checksums checked."""
        for place in self._attachments:
            with self._record(Opcode.ATTACHMENT, *place) as (file, start):
                head = records.checked_attachment(file, *place)
                data = file.read(start + head.data_at, head.data_length)
            yield Attachment(head.create_time, head.log_time, head.name, head.media_type, data)

    def metadata(self) -> Iterator[Metadata]:
        """The metadata records."""
        for offset, length in self._metadata:
            with self._record(Opcode.METADATA, offset, length) as (file, start):
                found = records.read(Metadata, file.read(start, length - HEAD.size))
            yield found

    @contextmanager
    def _record(
        self, opcode: Opcode, offset: int, length: int
    ) -> Iterator[tuple[RegularFile, int]]:
        """The file and where the content of a record begins that the index names."""
        what = opcode.name.lower()
        try:
            with RegularFile(self.path) as file:
                if HEAD.unpack(file.read(offset, HEAD.size)) != (opcode, length - HEAD.size):
                    raise BagError("there is none where the index says")
                yield file, offset + HEAD.size
        except BagError as error:
            reason = str(error).removeprefix("damaged: ")
            raise BagError(f"{self.path}: {what} at byte {offset}: damaged: {reason}") from None

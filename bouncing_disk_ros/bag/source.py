"""One .mcap file to read: its blocks of messages, topics and notes, by its index or by a walk."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Metadata, Schema

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag import fields
from bouncing_disk_ros.bag.chunk_reader import Inner, unpacked
from bouncing_disk_ros.bag.definitions import Definitions, inner_definitions
from bouncing_disk_ros.bag.file_pieces import Damage, Piece, describe
from bouncing_disk_ros.bag.files import HEAD, RegularFile
from bouncing_disk_ros.bag.formats import BagError
from bouncing_disk_ros.bag.scan import Walk, nothing
from bouncing_disk_ros.bag.search import Watch
from bouncing_disk_ros.bag.summary import Block, summary_of
from bouncing_disk_ros.errors import InputError


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
            summary, why = summary_of(file), "it has no index"
        except BagError as error:
            summary, why = None, f"its index is damaged ({error})"
        if summary is None:
            self.remarks = [f"{self.path.name}: {why}; read from beginning to end instead"]
            self._walk(file)
            return False
        self.blocks, self.counts = summary.blocks, Counter(summary.counts)
        self.schemas, self.channels = summary.schemas, summary.channels
        self._attachments, self._metadata = summary.attachments, summary.metadata
        self.names = summary.names
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
        for offset, length in self._attachments:
            content = self._content(Opcode.ATTACHMENT, offset, length)
            try:
                head = fields.attachment(content, len(content))
            except BagError as error:
                raise self._damaged("attachment", offset, str(error)) from None
            (crc,) = struct.unpack("<I", content[-4:])
            if crc and zlib.crc32(memoryview(content)[:-4]) != crc:
                raise self._damaged("attachment", offset, "the checksum is wrong")
            yield Attachment(
                log_time=head.log_time, create_time=head.create_time, name=head.name,
                media_type=head.media_type,
                data=content[head.data_at : head.data_at + head.data_length],
            )  # fmt: skip

    def metadata(self) -> Iterator[Metadata]:
        """The metadata records."""
        for offset, length in self._metadata:
            if length > limits.RECORD:
                raise self._damaged("metadata", offset, f"at most {limits.RECORD} bytes")
            content = self._content(Opcode.METADATA, offset, length)
            try:
                record = fields.metadata(content)
            except BagError as error:
                raise self._damaged("metadata", offset, str(error)) from None
            yield record

    def _content(self, opcode: Opcode, offset: int, length: int) -> bytes:
        """The content of the record that the index names."""
        with RegularFile(self.path) as file:
            record = file.read(offset, length)
        if HEAD.unpack_from(record) != (opcode, length - HEAD.size):
            what = opcode.name.lower()
            raise self._damaged(what, offset, "none stands where the index says")
        return record[HEAD.size :]

    def _damaged(self, what: str, offset: int, reason: str) -> BagError:
        return BagError(f"{self.path}: {what} at byte {offset}: damaged: {reason}")

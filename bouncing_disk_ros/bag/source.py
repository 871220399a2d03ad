"""One .mcap file to read: its blocks of messages, topics and notes, by its index or by a walk."""

from __future__ import annotations

import contextlib
import mmap
import os
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

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
)

from bouncing_disk_ros.bag.chunks import MESSAGE_HEAD, records, unpacked
from bouncing_disk_ros.bag.formats import BagError
from bouncing_disk_ros.bag.index import HEAD, MAGIC, Index, content_stream
from bouncing_disk_ros.bag.scan import Damage, Piece, count_lost, told, walk
from bouncing_disk_ros.errors import InputError

BLOCK = 1 << 20
"""Messages outside of chunks are taken together in blocks of about this size."""
LET_GO = 64 << 20
_FOOTER = HEAD.size + 20


@dataclass(frozen=True)
class Block:
    """A chunk, or (`plain`) messages that stand in the file in a row."""

    offset: int
    length: int
    start_ns: int
    end_ns: int
    plain: bool = False


class Source:
    """Reads one file. `remarks` say what could not be read; empty for a whole file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.blocks: list[Block] = []
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.counts: Counter[int] = Counter()
        self.damages: list[Damage] = []
        self.remarks: list[str] = []
        self._attachments: list[tuple[int, int]] = []
        self._metadata: list[tuple[int, int]] = []
        try:
            self._file = path.open("rb")
        except OSError as error:
            raise InputError("bag", str(path), "a readable .mcap file", str(error)) from None
        try:
            self._map = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)
        except (OSError, ValueError) as error:  # ValueError: it is empty
            self._file.close()
            raise InputError("bag", str(path), "a readable .mcap file", str(error)) from None
        self._data = memoryview(self._map)
        try:
            self.indexed = self._load()
        except BaseException:
            self.close()
            raise

    def _load(self) -> bool:
        """Whether the file's own index could be taken."""
        try:
            if self._from_summary():
                return True
            why = "it has no index"
        except Exception:  # noqa: BLE001 (mcap's parsers raise whatever comes)
            why = "its index is damaged"
        self.remarks = [f"{self.path.name}: {why}; read from beginning to end instead"]
        self._from_walk()
        return False

    # --- by the index -----------------------------------------------------------------------------
    def _from_summary(self) -> bool:
        """Take the summary; False when there is none; any error when it is damaged."""
        data = self._data
        tail = data[-_FOOTER - len(MAGIC) :]
        if bytes(tail[-len(MAGIC) :]) != MAGIC or tail[0] != Opcode.FOOTER:
            return False
        footer = Footer.read(content_stream(tail[HEAD.size : _FOOTER]))
        if not footer.summary_start:
            return False
        summary = data[footer.summary_start : len(data) - len(tail)]
        crc = zlib.crc32(tail[: HEAD.size + 16], zlib.crc32(summary))
        if footer.summary_crc not in (0, crc):
            raise BagError("the checksum of the index does not fit")
        statistics = self._take_summary(summary)
        if statistics is None or (statistics.message_count and not self.blocks):
            self._forget()
            return False
        self.counts = Counter(statistics.channel_message_counts)
        return True

    def _take_summary(self, summary: memoryview) -> Statistics | None:
        statistics = None
        for opcode, position, whole in records(summary):
            stream = content_stream(summary[position + HEAD.size : position + whole])
            match opcode:
                case Opcode.SCHEMA:
                    schema = Schema.read(stream)
                    self.schemas[schema.id] = schema
                case Opcode.CHANNEL:
                    channel = Channel.read(stream)
                    self.channels[channel.id] = channel
                case Opcode.STATISTICS:
                    statistics = Statistics.read(stream)
                case Opcode.CHUNK_INDEX:
                    row = ChunkIndex.read(stream)
                    span = (row.message_start_time, row.message_end_time)
                    self.blocks.append(Block(row.chunk_start_offset, row.chunk_length, *span))
                case Opcode.ATTACHMENT_INDEX:
                    place = AttachmentIndex.read(stream)
                    self._attachments.append((place.offset, place.length))
                case Opcode.METADATA_INDEX:
                    spot = MetadataIndex.read(stream)
                    self._metadata.append((spot.offset, spot.length))
        return statistics

    def _forget(self) -> None:
        self.blocks, self._attachments, self._metadata = [], [], []

    # --- by a walk --------------------------------------------------------------------------------
    def _from_walk(self) -> None:
        self._forget()
        index = Index()
        index.schemas, index.channels = self.schemas, self.channels
        for piece in self.pieces():
            if isinstance(piece, Damage):
                self.damages.append(piece)
            else:
                self._take(index, piece)
        self.remarks += [told(self.path.name, damage) for damage in self.damages if damage.length]

    def _take(self, index: Index, piece: Piece) -> None:
        match piece.opcode:
            case Opcode.CHUNK:
                counts, start, end = contents(index, piece.inner)
                self.counts += counts
                self.blocks.append(Block(piece.offset, len(piece.record), start, end))
            case Opcode.MESSAGE:
                self._take_plain(piece)
            case Opcode.SCHEMA | Opcode.CHANNEL:
                index.add(piece.record, piece.offset)
            case Opcode.ATTACHMENT:
                self._attachments.append((piece.offset, len(piece.record)))
            case Opcode.METADATA:
                self._metadata.append((piece.offset, len(piece.record)))
            case Opcode.MESSAGE_INDEX if self.damages and not self._follows_chunk():
                count_lost(self.damages[-1], piece)

    def _follows_chunk(self) -> bool:
        """Whether the newest chunk is a good one, so that the index is not that of a lost one."""
        newest = self.blocks[-1].offset if self.blocks else -1
        return newest > self.damages[-1].offset

    def _take_plain(self, piece: Piece) -> None:
        channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(piece.record, HEAD.size)
        self.counts[channel] += 1
        last = self.blocks[-1] if self.blocks else None
        length = len(piece.record)
        goes_on = last and last.plain and last.offset + last.length == piece.offset
        if last and goes_on and last.length < BLOCK:
            start, end = min(last.start_ns, log_time), max(last.end_ns, log_time)
            self.blocks[-1] = Block(last.offset, last.length + length, start, end, True)
        else:
            self.blocks.append(Block(piece.offset, length, log_time, log_time, True))

    # --- content ----------------------------------------------------------------------------------
    def pieces(self) -> Iterator[Piece | Damage]:
        """Everything in the file from its beginning, whatever its index says."""
        passed = 0
        for piece in walk(self._data):
            yield piece
            if piece.offset - passed > LET_GO:  # else the whole file stays in memory
                passed = piece.offset
                self._map.madvise(mmap.MADV_DONTNEED)

    def read(self, block: Block) -> bytes:
        """The records of a block, checked; BagError when it is damaged."""
        place = memoryview(os.pread(self._file.fileno(), block.length, block.offset))
        if block.plain:
            return bytes(place)
        try:
            if len(place) != block.length:
                raise BagError("damaged: no chunk stands where the index says")
            return unpacked(place[HEAD.size :])
        except BagError as error:
            hint = "`bag_recover` saves the rest"
            where = f"{self.path}: chunk at byte {block.offset}"
            raise BagError(f"{where}: {error}. {hint}") from None

    def attachments(self) -> Iterator[Attachment]:
        """The attachments, their checksums checked."""
        for offset, length in self._attachments:
            content = self._data[offset + HEAD.size : offset + length]
            (crc,) = struct.unpack("<I", content[-4:])
            if self._data[offset] != Opcode.ATTACHMENT or (crc and zlib.crc32(content[:-4]) != crc):
                raise BagError(f"{self.path}: attachment at byte {offset}: damaged")
            yield Attachment.read(content_stream(content))

    def metadata(self) -> Iterator[Metadata]:
        """The metadata records."""
        for offset, length in self._metadata:
            try:
                content = self._data[offset + HEAD.size : offset + length]
                yield Metadata.read(content_stream(content))
            except Exception:  # noqa: BLE001 (mcap's parsers raise whatever comes)
                raise BagError(f"{self.path}: metadata at byte {offset}: damaged") from None

    def close(self) -> None:
        """Let go of the file."""
        with contextlib.suppress(BufferError):  # an iterator in use still looks at it
            self._data.release()
            self._map.close()
        self._file.close()


def contents(index: Index, inner: bytes) -> tuple[Counter[int], int, int]:
    """Messages of each channel in a chunk and their first and last time; definitions to `index`."""
    counts: Counter[int] = Counter()
    times = []
    for opcode, position, whole in records(inner):
        if opcode == Opcode.MESSAGE:
            channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(inner, position + HEAD.size)
            counts[channel] += 1
            times.append(log_time)
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            index.add(inner[position : position + whole], 0)
    return counts, min(times, default=0), max(times, default=0)

"""One .mcap file to read: its index, by its summary or by a walk, and what the index names."""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from mcap.exceptions import McapError
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    Footer,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import StreamReader

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.chunk_reader import Inner, chunk_at, unpacked
from bouncing_disk_ros.bag.index import Index, PlainMessages
from bouncing_disk_ros.bag.records import (
    HEAD,
    MAGIC,
    Watch,
    Whole,
    attachment,
    checked,
    content_at,
    nothing,
    read,
    stretch,
)  # fmt: skip
from bouncing_disk_ros.bag.walk import Damage, Piece, Walk
from bouncing_disk_ros.errors import BagError, InputError
from bouncing_disk_ros.regular_file import RegularFile


class Source:
    """Reads one file, which is open only while it is read. `remarks`: what could not be read."""

    def __init__(self, path: Path, watch: Watch = nothing) -> None:
        """Take its index, or walk through it: `watch` is called meanwhile.

        Raises InputError when it is no file that can be read, BagError when it is no .mcap file.
        """
        self.path, self.remarks = path, list[str]()
        with RegularFile("bag", path) as file:
            found = index_of(file)
            self.index = found if isinstance(found, Index) else self._walked(file, watch, found)
        self.channels = self.index.channels
        """The channels to read."""

    def _walked(self, file: RegularFile, watch: Watch, reason: str) -> Index:
        """The index by a walk, for a `reason`."""
        name, index, damages = self.path.name, Index(), list[Damage]()
        for piece in Walk(file, watch).pieces():
            if isinstance(piece, Damage):  # what was lost in it is counted after it
                damages.append(piece)
                continue
            try:
                _take(index, piece)
            except BagError as error:
                damages.append(Damage(piece.offset, piece.length, str(error)))
        self.remarks.append(f"{name}: {reason}; read from beginning to end instead")
        self.remarks += [one.text(name, index.channels) for one in damages if one.length]
        if unnamed := sum(n for number, n in index.counts.items() if number not in index.channels):
            self.remarks.append(f"{name}: {unnamed} messages of topics without a name")
        return index

    # --- content ----------------------------------------------------------------------------------
    def read(self, chunk: ChunkIndex) -> Inner:
        """The messages of a chunk, checked; BagError when it is damaged or not as it is named."""
        start, end = chunk.message_start_time, chunk.message_end_time
        offset, length = chunk.chunk_start_offset, chunk.chunk_length
        try:
            with RegularFile("bag", self.path) as file:
                if isinstance(chunk, PlainMessages):
                    return Inner(stretch(file, offset, length))
                inner = Inner(unpacked(chunk_at(file, offset, length)))
            first, last = inner.span
            if len(inner.data) != chunk.uncompressed_size:
                raise BagError("damaged: its size differs from that in the index")
            if len(inner.times) and not start <= first <= last <= end:
                raise BagError("it holds messages of other times than the index says")
        except BagError as error:
            where = f"{self.path}: chunk at byte {offset}"
            raise BagError(f"{where}: {error}. `bag_recover` saves the rest") from None
        return inner

    def attachments(self) -> Iterator[Attachment]:
        """The attachments, their checksums checked."""
        for row in self.index.attachments:
            try:
                with RegularFile("bag", self.path) as file:
                    found, begin = attachment(file, row.offset, row.length)
                    data = stretch(file, begin, found.data_size)
            except BagError as error:
                raise self._damaged("attachment", row, error) from None
            yield Attachment(found.create_time, found.log_time, found.name, found.media_type, data)

    def metadata(self) -> Iterator[Metadata]:
        """The metadata records."""
        for row in self.index.metadata:
            try:
                with RegularFile("bag", self.path) as file:
                    found = read(Metadata, content_at(file, row.offset, row.length))
            except BagError as error:
                raise self._damaged("metadata", row, error) from None
            yield found

    def _damaged(
        self, what: str, row: AttachmentIndex | MetadataIndex, error: BagError
    ) -> BagError:
        reason = str(error).removeprefix("damaged: ")
        return BagError(f"{self.path}: {what} at byte {row.offset}: damaged: {reason}")


def _take(index: Index, piece: Piece) -> None:
    """Take note of what a walk has found; BagError for definitions that contradict each other."""
    match piece.content, piece.inner:
        case Chunk() as chunk, Inner() as inner:
            index.define_all(inner)
            index.add_chunk(chunk, inner, piece.offset)
        case None, Inner() as inner:
            index.add_messages(inner, piece.offset)
        case Schema() | Channel() as row, _:
            index.define(row)
        case AttachmentIndex() as row, _:
            index.attachments.append(row)
        case Metadata(name=name), _:
            index.metadata.append(MetadataIndex(piece.offset, piece.length, name))


# --- the summary of a file ------------------------------------------------------------------------
_FOOTER = HEAD.size + 20


def index_of(file: RegularFile) -> Index | str:
    """The index by the summary of a file, or why there is none. InputError: the file is empty.

    A summary is taken where its checksum is right and its statistics fit: what else can be wrong
    with it is found when the records that it names are read.
    """
    if not file.size:
        raise InputError("bag", str(file.path), "a readable .mcap file", "It is empty.")
    none = "it has no index"
    if file.size < 2 * len(MAGIC) + _FOOTER or stretch(file, 0, len(MAGIC)) != MAGIC:
        return none
    tail_at = file.size - _FOOTER - len(MAGIC)
    tail = stretch(file, tail_at, _FOOTER + len(MAGIC))
    if tail[-len(MAGIC) :] != MAGIC:
        return none
    footer = read(Footer, tail[HEAD.size : _FOOTER])
    if not footer.summary_start:
        return none
    if not footer.summary_crc:
        return "its index has no checksum"
    try:
        content = stretch(file, footer.summary_start, tail_at - footer.summary_start)
        if zlib.crc32(tail[: HEAD.size + 16], zlib.crc32(content)) != footer.summary_crc:
            raise BagError("its checksum is wrong")
        found, statistics = _read(content + tail)
    except (BagError, McapError, ValueError) as error:
        return f"its index is damaged ({error})"
    fits = statistics is not None and _fits(found, statistics)
    return found if fits else "it has no complete index"


def _read(summary: bytes) -> tuple[Index, Statistics | None]:
    """The records of a summary."""
    found, statistics = Index(), None
    rows = StreamReader(
        Whole(summary), skip_magic=True, emit_chunks=True, record_size_limit=limits.RECORD
    )
    for row in rows.records:
        match checked(row):
            case Schema() | Channel():
                found.define(row)
            case Statistics():
                statistics = row
                found.chunk_counts = [Counter(row.channel_message_counts)]
            case ChunkIndex():
                row.message_index_offsets = {}  # most of its memory, and not used
                found.chunks.append(row)
            case AttachmentIndex():
                found.attachments.append(row)
            case MetadataIndex():
                found.metadata.append(row)
    return found, statistics


def _fits(found: Index, statistics: Statistics) -> bool:
    """Whether an index names all that statistics count, and nothing twice."""
    counts, passed = statistics.channel_message_counts, len(MAGIC)
    named = [(row.chunk_start_offset, row.chunk_length) for row in found.chunks]
    for group in (found.attachments, found.metadata):
        named += [(row.offset, row.length) for row in group]
    for offset, length in sorted(named):  # else few bytes of a file could be read very often
        if offset < passed:
            return False
        passed = offset + length
    counted = statistics.chunk_count, statistics.attachment_count, statistics.metadata_count
    types = {row.schema_id for row in found.channels.values()}
    return (
        counted == (len(found.chunks), len(found.attachments), len(found.metadata))
        and sum(counts.values()) == statistics.message_count
        and bool(found.chunks or not statistics.message_count)
        and counts.keys() <= found.channels.keys()
        and types <= {0, *found.schemas}
    )

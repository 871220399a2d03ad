"""Rebuild index and metadata.yaml of a cut or damaged bag in a new folder; the bag stays as it is.

Whole chunks are copied, whatever they hold; nothing is decoded or compressed anew. Only the times
at the head of a chunk, which have no checksum, are put right by its messages (see `walk`).
"""

from __future__ import annotations

import shutil
import zlib
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, Schema
from mcap.records import Metadata as MetadataRecord

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag import metadata
from bouncing_disk_ros.bag.chunk_reader import Inner
from bouncing_disk_ros.bag.index import Index, index_of
from bouncing_disk_ros.bag.mcap_file import RecordStream
from bouncing_disk_ros.bag.metadata import (
    FORMAT_KEY,
    NOTE,
    FileRow,
    Located,
    Metadata,
    TopicRow,
    checked,
    files_of,
    qos_from_text,
    signed,
)
from bouncing_disk_ros.bag.records import (
    MAGIC,
    AttachmentHead,
    RegularFile,
    Watch,
    nothing,
    without_repeats,
)  # fmt: skip
from bouncing_disk_ros.bag.walk import BLOCK, Damage, Piece, Walk, record_name
from bouncing_disk_ros.errors import BagError, InputError
from bouncing_disk_ros.units import NS

MOST_LINES = 200
"""Damages that are listed one by one."""
_WHOLE = "nothing that was written is lost"


@dataclass
class Report:
    """Report of a recovery: what was saved and what was lost, in words and in numbers."""

    output: Path
    saved: int = 0
    lost: int = 0
    exact: bool = True  # else more may be lost than `lost`
    lines: list[str] = field(default_factory=list)
    lost_records: list[str] = field(default_factory=list)  # attachments and notes, in words
    unlisted: int = 0  # damages beyond MOST_LINES

    def add(self, line: str) -> None:
        """List one damage more, or count it."""
        if len(self.lines) < MOST_LINES:
            self.lines.append(line)
        else:
            self.unlisted += 1

    @property
    def summary(self) -> str:
        """One line."""
        whole = "no message that was written is lost" if self.lost_records else _WHOLE
        lost = f"{self.lost} lost" if self.lost else whole
        if not self.exact:
            more = "an unknown number of messages, cut off or unreadable, is lost"
            lost = f"{lost}, and {more}" if self.lost else more
        records = f"; lost: {', '.join(self.lost_records[:10])}" if self.lost_records else ""
        if (unnamed := len(self.lost_records) - 10) > 0:
            records += f" and {unnamed} more"
        return f"{self.output}: {self.saved} messages saved, {lost}{records}"


def loss_text(name: str, damage: Damage, topics: Mapping[int, str]) -> str:
    """What was lost in a file by one damage, in words; `topics` by channel."""
    where = f"{name}: bytes {damage.offset} to {damage.offset + damage.length}"
    if not damage.length:
        return f"{name}: {damage.reason}"
    span = ""
    if damage.span_ns is not None:
        first, last = (time / NS for time in damage.span_ns)
        span = f", received between {first:.3f} and {last:.3f} s"
    counted = ", ".join(f"{n} of {topics.get(c, c)}" for c, n in damage.counts.items())
    nothing_known = "what was there" if damage.holds_messages else damage.record or "no messages"
    return f"{where}: {damage.reason}: lost {counted or nothing_known}{span}"


# --- the recovery ---------------------------------------------------------------------------------


def recover(bag: str | Path, output: str | Path | None = None, watch: Watch = nothing) -> Report:
    """Repaired copy of a bag with all that can be read (default: its name with `_recovered`).

    `watch` is called now and then with the bytes passed and the bytes of the file. Raises
    InputError when there is no such bag or the new folder cannot be made, BagError when a file is
    not a bag (nothing is left behind then), OSError when the disk is full.

    >>> bag.recover("run_1")
    """
    path = Path(bag)
    found = files_of(path)
    folder = Path(output) if output else _beside(path)
    try:
        folder.mkdir(parents=True)
    except (OSError, ValueError) as error:
        allowed = "the name of a new folder, where files can be made"
        why = (error.strerror if isinstance(error, OSError) else None) or str(error)
        raise InputError("output", str(folder), allowed, f"{why}.") from None
    try:
        return _recovered(found, folder, watch)
    except (BagError, InputError):
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _beside(path: Path) -> Path:
    """The new folder beside a bag, which may be given as its metadata.yaml."""
    if path.name == metadata.FILE_NAME and not path.is_dir():
        path = path.parent
    if path.name in ("", ".."):  # . and / and the like
        path = path.resolve()
    return path.with_name(f"{path.stem}_recovered") if path.name else Path("recovered")


def _recovered(found: Located, folder: Path, watch: Watch) -> Report:
    report = Report(folder, lines=list(found.remarks))
    files = [
        _File(file, folder / f"{folder.name}_{place}.mcap", report, place == 0, watch)
        for place, file in enumerate(found.files)
    ]
    notes = _noted(found.custom) | {k: v for file in files for k, v in file.notes.items()}
    if len(notes) > len({key for file in files for key in file.notes}):
        report.add(f"notes are those of {metadata.FILE_NAME}, where the files lack them")
    notes["recovered"] = report.summary.partition(": ")[2]
    notes.setdefault(FORMAT_KEY, "1")
    for file in files:
        file.finish(notes)
    metadata.write(folder, _metadata(files, notes))
    return report


def _noted(custom: Mapping[str, str]) -> dict[str, str]:
    """The recorder's notes among the custom data of metadata.yaml; none where they are damaged."""
    prefix = f"{NOTE}."
    notes = {key.removeprefix(prefix): custom[key] for key in custom if key.startswith(prefix)}
    try:
        return checked(signed(notes))
    except BagError:
        return {}


def _metadata(files: list[_File], notes: dict[str, str]) -> Metadata:
    topics: dict[str, TopicRow] = {}
    for file in files:
        topics = file.topics | topics
    return metadata.summed([file.row for file in files], topics.values(), notes)


class _File:
    """The recovery of one file; only of the first do repeats of latched messages count."""

    def __init__(
        self, path: Path, target: Path, report: Report, is_first: bool, watch: Watch
    ) -> None:
        self.notes: dict[str, str] = {}
        self._is_first = is_first
        self._report, self._name = report, path.name
        self._stream = RecordStream(target)
        self.index = self._stream.index
        self._known: Index | None = None  # the index that the file has
        self._plain = bytearray()
        self._lost: list[Damage] = []
        self._left: dict[int, str] = {}  # attachments and notes that have not come yet
        self._stream.write(MAGIC)
        builder = RecordBuilder()
        Header("ros2", "bouncing_disk_ros bag_recover").write(builder)
        self._stream.write(builder.end())
        try:
            with RegularFile(path) as file:
                self._copy(file, watch)
        except BaseException:
            self._stream.file.close()
            raise
        self._report_file()

    # --- copying ----------------------------------------------------------------------------------
    def _copy(self, file: RegularFile, watch: Watch) -> None:
        known = index_of(file)
        if isinstance(known, Index):  # its definitions have a checksum
            self._known = known
            self.index.schemas, self.index.channels = dict(known.schemas), dict(known.channels)
            self._left = known.names
        for piece in Walk(file, watch).pieces():
            if isinstance(piece, Damage):
                self._lost.append(piece)
            else:
                self._take(file, piece)
        self._end_plain()

    def _take(self, opened: RegularFile, piece: Piece) -> None:
        self._left.pop(piece.offset, None)
        match piece.content:
            case None if piece.opcode == Opcode.CHUNK:
                self._end_plain()
                self._copy_chunk(piece)
            case None:
                if len(self._plain) + piece.length > BLOCK:
                    self._end_plain()
                self._plain += piece.record
            case Schema() | Channel() as row if self._known is None:
                self.index.define(row)
                self._stream.write(piece.record)
            case AttachmentHead() as head:
                self._stream.copy_attachment(opened, head, piece.offset, piece.length)
            case MetadataRecord(name=name, metadata=texts) if name == NOTE:
                self._take_notes(piece, texts)
            case MetadataRecord(name=name) if name != "rosbag2":
                self._stream.write(piece.record)

    def _take_notes(self, piece: Piece, texts: Mapping[str, str]) -> None:
        try:
            self.notes.update(checked(texts))
        except BagError as error:
            name = record_name(Opcode.METADATA, NOTE)
            damage = Damage(piece.offset, piece.length, str(error), holds_messages=False)
            self._lost.append(replace(damage, record=name))

    def _copy_chunk(self, piece: Piece) -> None:
        """Copy a chunk, and write the index of its messages anew."""
        inner = piece.inner
        assert inner is not None
        try:
            self.index.define_all(inner)
            unknown = {c: n for c, n in inner.counts.items() if c not in self.index.channels}
            reason = "the definition of its topics is lost" if unknown else ""
        except BagError as error:
            unknown, reason = dict(inner.counts), str(error)
        if reason:
            self._lost.append(Damage(piece.offset, piece.length, reason, Counter(unknown)))
            return
        if len(inner.times):  # else it holds definitions only, which the new index has
            self._stream.write(piece.record)
            self._stream.write(inner.index_records())

    def _end_plain(self) -> None:
        """Messages outside of chunks go into a chunk without compression."""
        data, self._plain = bytes(self._plain), bytearray()
        if not data:
            return
        inner = Inner(data)
        first, last = inner.span
        builder = RecordBuilder()
        Chunk(
            compression="", data=data, message_end_time=last, message_start_time=first,
            uncompressed_crc=zlib.crc32(data), uncompressed_size=len(data),
        ).write(builder)  # fmt: skip
        record = builder.end()
        self._copy_chunk(Piece(Opcode.CHUNK, self.index.end, len(record), record, inner))

    # --- telling ----------------------------------------------------------------------------------
    @property
    def _counted(self) -> dict[int, Channel]:
        channels = self.index.channels
        return channels if self._is_first else without_repeats(channels)

    def _only_counted(self, counts: Counter[int]) -> Counter[int]:
        repeats = self.index.channels.keys() - self._counted.keys()
        return Counter({number: n for number, n in counts.items() if number not in repeats})

    @property
    def topics(self) -> dict[str, TopicRow]:
        """The topics of the file by name."""
        rows: dict[str, TopicRow] = {}
        left = limits.QOS_ALL
        for channel in self._counted.values():
            schema = self.index.schemas.get(channel.schema_id)
            text = channel.metadata.get("offered_qos_profiles", "")
            left -= len(text)
            qos = qos_from_text(text) if left > 0 else []
            type_hash = channel.metadata.get("topic_type_hash", "")
            row = TopicRow(channel.topic, schema.name if schema else "", qos, type_hash)
            rows.setdefault(channel.topic, row)
        return rows

    @property
    def row(self) -> tuple[FileRow, Counter[str]]:
        """The file as metadata.yaml names it, and the messages saved of each topic."""
        return self.index.file_row(self._stream.path.name, self._counted)

    def _report_file(self) -> None:
        report, saved = self._report, self._only_counted(self.index.counts)
        report.saved += saved.total()
        topics = {number: channel.topic for number, channel in self.index.channels.items()}
        for damage in self._lost:
            report.add(loss_text(self._name, damage, topics))
        lost = self._left | {one.offset: one.record for one in self._lost if one.record}
        names = dict.fromkeys(lost[at] for at in sorted(lost))
        if self.notes:  # they stand in the file twice
            names.pop(record_name(Opcode.METADATA, NOTE), None)
        report.lost_records += names
        if self._known is not None:
            report.lost += (self._only_counted(self._known.counts) - saved).total()
            return
        report.lost += sum(self._only_counted(damage.counts).total() for damage in self._lost)
        if any(d.length and d.holds_messages and not d.counts for d in self._lost):
            report.exact = False

    def finish(self, notes: dict[str, str]) -> None:
        """Write notes, index and footer."""
        last = metadata.last_notes(notes, _metadata([self], {}))
        self._stream.write_ending(self.index.ending(last))
        self._stream.file.close()

"""Rebuild index and metadata.yaml of a cut or damaged bag in a new folder; the bag stays as it is.

Whole chunks are copied, whatever they hold; nothing is decoded or compressed anew. Only the times
at the head of a chunk, which have no checksum, are put right by its messages.
"""

from __future__ import annotations

import shutil
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, Chunk, Schema
from mcap.records import Metadata as MetadataRecord

from bouncing_disk_ros.bag import metadata
from bouncing_disk_ros.bag.chunk_reader import Inner
from bouncing_disk_ros.bag.files import Located, files_of
from bouncing_disk_ros.bag.index import Index
from bouncing_disk_ros.bag.metadata import FileRow, Metadata, TopicRow
from bouncing_disk_ros.bag.notes import FORMAT_KEY, NOTE, checked, signed
from bouncing_disk_ros.bag.reader import topics_of
from bouncing_disk_ros.bag.records import Watch, nothing, without_repeats
from bouncing_disk_ros.bag.source import index_of
from bouncing_disk_ros.bag.walk import Damage, Piece, Walk, record_name
from bouncing_disk_ros.bag.writer import McapFile
from bouncing_disk_ros.errors import BagError, InputError, one_line
from bouncing_disk_ros.regular_file import RegularFile, not_made

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
            self.lines.append(one_line(line))
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


# --- the recovery ---------------------------------------------------------------------------------


def recover(bag: str | Path, output: str | Path | None = None, watch: Watch = nothing) -> Report:
    """Repaired copy of a bag with all that can be read (default: its name with `_recovered`).

    `watch` is called now and then with the bytes passed and the bytes of the file. Raises
    InputError when there is no such bag or the new folder cannot be made, BagError when a file is
    not a bag (nothing is left behind then), OSError or FailedError when the disk is full.

    >>> bag.recover("run_1")
    """
    path = Path(bag)
    found = files_of(path)
    folder = Path(output) if output else _beside(path)
    try:
        folder.mkdir(parents=True)
    except (OSError, ValueError) as error:
        allowed = "the name of a new folder, where files can be made"
        raise not_made("output", folder, allowed, error) from None
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
    report = Report(folder)
    for remark in found.remarks:
        report.add(remark)
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
    topics = topics_of((file.index, file.channels) for file in files).values()
    rows = [TopicRow(row.name, row.type, row.qos, row.type_hash) for row in topics]
    return metadata.summed([file.row for file in files], rows, notes)


class _File:
    """The recovery of one file; only of the first do repeats of latched messages count."""

    def __init__(
        self, path: Path, target: Path, report: Report, is_first: bool, watch: Watch
    ) -> None:
        self.notes: dict[str, str] = {}
        self._is_first = is_first
        self._report, self._name = report, path.name
        self._known: Index | None = None  # the index that the file has
        self._lost: list[Damage] = []
        self._left: dict[int, str] = {}  # attachments and notes that have not come yet
        self._new = McapFile(target, "bouncing_disk_ros bag_recover")
        self.index = self._new.index
        try:
            with RegularFile("bag", path) as file:
                self._copy(file, watch)
        except BaseException:
            self._new.close()
            raise
        self._report_file()

    # --- copying ----------------------------------------------------------------------------------
    def _copy(self, file: RegularFile, watch: Watch) -> None:
        known = index_of(file)
        if isinstance(known, Index):  # its definitions have a checksum
            self._known = known
            self.index.schemas, self.index.channels = dict(known.schemas), dict(known.channels)
            for opcode, rows in (
                (Opcode.ATTACHMENT, known.attachments),
                (Opcode.METADATA, known.metadata),
            ):
                self._left |= {row.offset: record_name(opcode, row.name) for row in rows}
        for piece in Walk(file, watch).pieces():
            if isinstance(piece, Damage):
                self._lost.append(piece)
                continue
            self._left.pop(piece.offset, None)
            if piece.inner is None:
                self._take(file, piece)
            else:
                self._take_messages(piece, piece.inner)

    def _take(self, file: RegularFile, piece: Piece) -> None:
        match piece.content:
            case Schema() | Channel() as row if self._known is None:
                self._new.define(row)
            case AttachmentIndex() as row:
                self._new.copy_attachment(file, row)
            case MetadataRecord(name=name, metadata=texts) if name == NOTE:
                try:
                    self.notes.update(checked(texts))
                except BagError as error:
                    note = record_name(Opcode.METADATA, name)
                    self._lose(piece, str(error), holds_messages=False, record=note)
            case MetadataRecord(name=name, metadata=texts) if name != "rosbag2":
                self._new.note(name, texts)

    def _take_messages(self, piece: Piece, inner: Inner) -> None:
        """Copy a chunk, and write the index of its messages anew."""
        try:
            self.index.define_all(inner)
        except BagError as error:
            self._lose(piece, str(error), counts=inner.counts)
            return
        unknown = {c: n for c, n in inner.counts.items() if c not in self.index.channels}
        if unknown:
            reason = "the definition of its topics is lost"
            self._lose(piece, reason, counts=Counter(unknown))
        elif isinstance(piece.content, Chunk) and len(inner.times):
            self._new.copy_chunk(piece.content, inner)
        elif len(inner.times):  # else it holds definitions only, which the new index has
            self._new.add_chunk(inner, "none")

    def _lose(self, piece: Piece, reason: str, **what: Any) -> None:
        self._lost.append(Damage(piece.offset, piece.length, reason, **what))

    # --- telling ----------------------------------------------------------------------------------
    @property
    def channels(self) -> dict[int, Channel]:
        """The channels whose messages count."""
        channels = self.index.channels
        return channels if self._is_first else without_repeats(channels)

    def _only_counted(self, counts: Counter[int]) -> Counter[int]:
        repeats = self.index.channels.keys() - self.channels.keys()
        return Counter({number: n for number, n in counts.items() if number not in repeats})

    @property
    def row(self) -> tuple[FileRow, Counter[str]]:
        """The file as metadata.yaml names it, and the messages saved of each topic."""
        return self.index.file_row(self._new.path.name, self.channels)

    def _report_file(self) -> None:
        report, saved = self._report, self._only_counted(self.index.counts)
        report.saved += saved.total()
        for damage in self._lost:
            report.add(damage.text(self._name, self.index.channels))
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
        self._new.finish(last)
        self._new.close()

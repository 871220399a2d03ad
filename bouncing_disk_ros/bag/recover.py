"""Rebuild index and metadata.yaml of a cut or damaged bag in a new folder; the bag stays as it is.

Whole chunks are copied byte for byte, whatever they hold; nothing is decoded or compressed anew.
"""

from __future__ import annotations

import contextlib
import zlib
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk, Header, McapRecord, MessageIndex
from mcap.records import Metadata as MetadataRecord

from bouncing_disk_ros.bag import metadata
from bouncing_disk_ros.bag.chunks import MESSAGE_HEAD, records
from bouncing_disk_ros.bag.formats import FORMAT_KEY, NOTE, BagError, checked, signed
from bouncing_disk_ros.bag.index import HEAD, MAGIC, content_stream
from bouncing_disk_ros.bag.locate import files_of
from bouncing_disk_ros.bag.metadata import FileRow, Metadata, TopicRow, qos_from_text
from bouncing_disk_ros.bag.scan import Damage, Piece, count_lost
from bouncing_disk_ros.bag.source import BLOCK, Source
from bouncing_disk_ros.bag.stream import RecordStream
from bouncing_disk_ros.errors import InputError


@dataclass
class Report:
    """What recovery saved and what it could not save, in words and in numbers."""

    output: Path
    saved: int = 0
    lost: int = 0
    exact: bool = True  # else more may be lost than `lost`
    lines: list[str] = field(default_factory=list)

    @property
    def summary(self) -> str:
        """One line."""
        lost = f"{self.lost} lost" if self.lost else "nothing was lost"
        if not self.exact:
            more = "what was cut off or unreadable is lost, how much is unknown"
            lost = f"{lost}, and {more}" if self.lost else more
        return f"{self.output}: {self.saved} messages saved, {lost}"


def recover(bag: str | Path, output: str | Path | None = None) -> Report:
    """Save what can be saved of a bag into a new one (default: its name with `_recovered`).

    Raises InputError when there is no such bag or the new folder cannot be made, OSError when
    the disk is full.
    """
    path = Path(bag)
    found = files_of(path)
    folder = Path(output) if output else path.with_name(f"{path.stem}_recovered")
    try:
        folder.mkdir(parents=True)
    except OSError as error:
        allowed = "the name of a new folder, where files can be made"
        raise InputError("output", str(folder), allowed, f"{error.strerror}.") from None
    report = Report(folder, lines=list(found.remarks))
    files = [
        _File(file, folder / f"{folder.name}_{place}.mcap", report)
        for place, file in enumerate(found.files)
    ]
    notes = {key: value for file in files for key, value in file.notes.items()}
    notes["recovered"] = report.summary.partition(": ")[2]
    notes.setdefault(FORMAT_KEY, "1")
    for file in files:
        file.finish(notes)
    metadata.write(folder, _metadata([file.row for file in files], _topics(files), notes))
    return report


def _topics(files: list[_File]) -> list[TopicRow]:
    rows: dict[str, TopicRow] = {}
    for file in files:
        for row in file.topics:
            rows.setdefault(row.name, TopicRow(row.name, row.type, row.qos, row.type_hash))
            rows[row.name].count += row.count
    return list(rows.values())


def _metadata(files: list[FileRow], topics: list[TopicRow], notes: dict[str, str]) -> Metadata:
    return Metadata(files, topics, {f"{NOTE}.{key}": value for key, value in notes.items()})


class _File:
    """The recovery of one file."""

    def __init__(self, path: Path, target: Path, report: Report) -> None:
        self.notes: dict[str, str] = {}
        self._report, self._name = report, path.name
        self._source = Source(path)
        self._stream = RecordStream(target)
        self.index = self._stream.index
        if self._source.indexed:  # its definitions have a checksum
            self.index.schemas, self.index.channels = self._source.schemas, self._source.channels
        self._plain = bytearray()
        self._lost: list[Damage] = []
        self._in_damage = False
        self._stream.write(MAGIC)
        self._begun = False
        for piece in self._source.pieces():
            if isinstance(piece, Damage):
                self._lost.append(piece)
                self._in_damage = True
            else:
                self._take(piece)
        self._end_plain()
        self._tell()

    # --- copying ----------------------------------------------------------------------------------
    def _take(self, piece: Piece) -> None:
        if not self._begun:
            self._begun = True
            self._write(Header("ros2", "bouncing_disk_ros bag_recover"))
        match piece.opcode:
            case Opcode.CHUNK:
                self._end_plain()
                self._copy_chunk(piece)
                self._in_damage = False
            case Opcode.MESSAGE:
                self._plain += piece.record
                if len(self._plain) >= BLOCK:
                    self._end_plain()
            case Opcode.SCHEMA | Opcode.CHANNEL if not self._source.indexed:
                self._stream.write(piece.record)
            case Opcode.ATTACHMENT:
                self._stream.write(piece.record)
            case Opcode.METADATA:
                self._take_notes(piece)
            case Opcode.MESSAGE_INDEX if self._in_damage:
                count_lost(self._lost[-1], piece)

    def _take_notes(self, piece: Piece) -> None:
        record = MetadataRecord.read(content_stream(piece.record[HEAD.size :]))
        if record.name == NOTE:
            with contextlib.suppress(BagError):
                self.notes.update(checked(record.metadata))
        elif record.name != "rosbag2":
            self._stream.write(piece.record)

    def _write(self, *rows: McapRecord) -> None:
        builder = RecordBuilder()
        for row in rows:
            row.write(builder)
        self._stream.write(builder.end())

    def _copy_chunk(self, piece: Piece) -> None:
        """Copy a chunk, and write the index of its messages anew."""
        indexes: dict[int, MessageIndex] = {}
        for opcode, position, whole in records(piece.inner):
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self.index.add(piece.inner[position : position + whole], self.index.end - whole)
            elif opcode == Opcode.MESSAGE:
                channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(
                    piece.inner, position + HEAD.size
                )
                row = indexes.setdefault(channel, MessageIndex(channel, []))
                row.records.append((log_time, position))
        unknown = {
            c: len(row.records) for c, row in indexes.items() if c not in self.index.channels
        }
        if unknown:
            reason = "the definition of its topics is lost"
            self._lost.append(Damage(piece.offset, len(piece.record), reason, Counter(unknown)))
            return
        self._stream.write(piece.record)
        self._write(*indexes.values())

    def _end_plain(self) -> None:
        """Messages outside of chunks go into a chunk without compression."""
        inner, self._plain = bytes(self._plain), bytearray()
        if not inner:
            return
        rows = [MESSAGE_HEAD.unpack_from(inner, at + HEAD.size) for _, at, _ in records(inner)]
        times = [row[2] for row in rows]
        builder = RecordBuilder()
        Chunk(
            compression="",
            data=inner,
            message_end_time=max(times),
            message_start_time=min(times),
            uncompressed_crc=zlib.crc32(inner),
            uncompressed_size=len(inner),
        ).write(builder)
        record = builder.end()
        self._copy_chunk(Piece(Opcode.CHUNK, self.index.end, record, inner))

    # --- telling ----------------------------------------------------------------------------------
    @property
    def topics(self) -> list[TopicRow]:
        """The topics of the file with the messages saved."""
        counts, rows = self.index.channel_counts, []
        for number, channel in self.index.channels.items():
            schema = self.index.schemas.get(channel.schema_id)
            qos = qos_from_text(channel.metadata.get("offered_qos_profiles", ""))
            type_hash = channel.metadata.get("topic_type_hash", "")
            name = schema.name if schema else ""
            rows.append(TopicRow(channel.topic, name, qos, type_hash, counts[number]))
        return rows

    @property
    def row(self) -> FileRow:
        """The file as metadata.yaml names it."""
        count = self.index.channel_counts.total()
        return FileRow(self._stream.path.name, *self.index.span, count)

    def _tell(self) -> None:
        report, saved = self._report, self.index.channel_counts
        report.saved += saved.total()
        for damage in self._lost:
            report.lines.append(self._told(damage))
        if self._source.indexed:
            report.lost += (self._source.counts - saved).total()
            return
        report.lost += sum(damage.counts.total() for damage in self._lost)
        if any(damage.length and not damage.counts for damage in self._lost):
            report.exact = False

    def _told(self, damage: Damage) -> str:
        where = f"{self._name}: bytes {damage.offset} to {damage.offset + damage.length}"
        if not damage.length:
            return f"{self._name}: {damage.reason}"
        span = ""
        if damage.span_ns is not None:
            first, last = (time / 1e9 for time in damage.span_ns)
            span = f", received between {first:.3f} and {last:.3f} s"
        topics = {n: channel.topic for n, channel in self.index.channels.items()}
        counted = ", ".join(f"{n} of {topics.get(c, c)}" for c, n in damage.counts.items())
        return f"{where}: {damage.reason}: lost {counted or 'what was there'}{span}"

    def finish(self, notes: dict[str, str]) -> None:
        """Write notes, index and footer."""
        topics = metadata.Metadata([self.row], self.topics, {})
        record = {"serialized_metadata": topics.record()}
        self._write(MetadataRecord(NOTE, signed(notes)), MetadataRecord("rosbag2", record))
        self._stream.write_ending(self.index.closing())
        self._stream.file.close()
        self._source.close()

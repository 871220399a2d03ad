"""Rebuild index and metadata.yaml of a cut or damaged bag in a new folder; the bag stays as it is.

Whole chunks are copied byte for byte, whatever they hold; nothing is decoded or compressed anew.
"""

from __future__ import annotations

import contextlib
import zlib
from collections import Counter
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, McapRecord, MessageIndex
from mcap.records import Metadata as MetadataRecord

from bouncing_disk_ros.bag import metadata
from bouncing_disk_ros.bag.chunks import MESSAGE_HEAD, records
from bouncing_disk_ros.bag.formats import FORMAT_KEY, NOTE, BagError, checked, signed
from bouncing_disk_ros.bag.index import HEAD, MAGIC, content_stream
from bouncing_disk_ros.bag.latched import without_repeats
from bouncing_disk_ros.bag.locate import files_of
from bouncing_disk_ros.bag.metadata import FileRow, Metadata, TopicRow, qos_from_text
from bouncing_disk_ros.bag.report import Report
from bouncing_disk_ros.bag.scan import Damage, Piece, count_lost
from bouncing_disk_ros.bag.source import BLOCK, Source
from bouncing_disk_ros.bag.stream import RecordStream
from bouncing_disk_ros.errors import InputError


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
        _File(file, folder / f"{folder.name}_{place}.mcap", report, place == 0)
        for place, file in enumerate(found.files)
    ]
    notes = {key: value for file in files for key, value in file.notes.items()}
    notes["recovered"] = report.summary.partition(": ")[2]
    notes.setdefault(FORMAT_KEY, "1")
    for file in files:
        file.finish(notes)
    metadata.write(folder, _metadata(files, notes))
    return report


def _metadata(files: list[_File], notes: dict[str, str]) -> Metadata:
    topics: dict[str, TopicRow] = {}
    for file in files:
        topics = file.topics | topics
    rows = [(file.row, file.counts) for file in files]
    return metadata.summed(rows, topics.values(), notes)


class _File:
    """The recovery of one file; only of the first do repeats of latched messages count."""

    def __init__(self, path: Path, target: Path, report: Report, is_first: bool) -> None:
        self.notes: dict[str, str] = {}
        self._is_first = is_first
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
        self._write(Header("ros2", "bouncing_disk_ros bag_recover"))
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
        for channel in self._counted.values():
            schema = self.index.schemas.get(channel.schema_id)
            qos = qos_from_text(channel.metadata.get("offered_qos_profiles", ""))
            type_hash = channel.metadata.get("topic_type_hash", "")
            row = TopicRow(channel.topic, schema.name if schema else "", qos, type_hash)
            rows.setdefault(channel.topic, row)
        return rows

    @property
    def counts(self) -> Counter[str]:
        """Messages saved of each topic."""
        counts = Counter[str]()
        for number, count in self._only_counted(self.index.channel_counts).items():
            counts[self.index.channels[number].topic] += count
        return counts

    @property
    def row(self) -> FileRow:
        """The file as metadata.yaml names it."""
        return FileRow(self._stream.path.name, *self.index.span, self.counts.total())

    def _tell(self) -> None:
        report, saved = self._report, self._only_counted(self.index.channel_counts)
        report.saved += saved.total()
        for damage in self._lost:
            report.lines.append(self._told(damage))
        if self._source.indexed:
            report.lost += (self._only_counted(self._source.counts) - saved).total()
            return
        report.lost += sum(self._only_counted(damage.counts).total() for damage in self._lost)
        if any(d.length and d.holds_messages and not d.counts for d in self._lost):
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
        nothing_known = "what was there" if damage.holds_messages else "no messages"
        return f"{where}: {damage.reason}: lost {counted or nothing_known}{span}"

    def finish(self, notes: dict[str, str]) -> None:
        """Write notes, index and footer."""
        record = {"serialized_metadata": _metadata([self], {}).record()}
        self._write(MetadataRecord(NOTE, signed(notes)), MetadataRecord("rosbag2", record))
        self._stream.write_ending(self.index.closing())
        self._stream.file.close()
        self._source.close()

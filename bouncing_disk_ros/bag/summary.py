"""The index at the end of an .mcap file: taken only when nothing in it contradicts the file."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field
from typing import NamedTuple

from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag import fields
from bouncing_disk_ros.bag.chunk_reader import records
from bouncing_disk_ros.bag.file_pieces import record_name
from bouncing_disk_ros.bag.files import HEAD, RegularFile
from bouncing_disk_ros.bag.formats import BagError
from bouncing_disk_ros.bag.index import MAGIC

_FOOTER = HEAD.size + 20
_LEAST_MESSAGE = HEAD.size + 22


class Block(NamedTuple):
    """A chunk, or (`plain`) messages that stand in the file in a row."""

    offset: int
    length: int
    start_ns: int
    end_ns: int
    size: int  # decompressed
    plain: bool = False


@dataclass
class Summary:
    """What the index says."""

    blocks: list[Block] = field(default_factory=list)
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    counts: dict[int, int] = field(default_factory=dict)  # messages by channel
    attachments: list[tuple[int, int]] = field(default_factory=list)  # offset and length
    metadata: list[tuple[int, int]] = field(default_factory=list)
    names: dict[int, str] = field(default_factory=dict)  # of both, in words, by their offsets


def summary_of(file: RegularFile) -> Summary | None:
    """The index of a file; None when it has none. BagError when it is damaged or untrue."""
    if file.size < 2 * len(MAGIC) + _FOOTER or file.read(0, len(MAGIC)) != MAGIC:
        return None
    tail_at = file.size - _FOOTER - len(MAGIC)
    tail = file.read(tail_at, _FOOTER + len(MAGIC))
    if tail[-len(MAGIC) :] != MAGIC or HEAD.unpack_from(tail) != (Opcode.FOOTER, 20):
        return None
    footer = fields.footer(tail[HEAD.size :])
    start = footer.summary_start
    if not start:
        return None
    if not len(MAGIC) <= start <= tail_at:
        raise BagError("it begins outside of the file")
    content = file.read(start, tail_at - start)
    crc = zlib.crc32(tail[: HEAD.size + 16], zlib.crc32(content))
    if footer.summary_crc not in (0, crc):
        raise BagError("its checksum is wrong")
    reading = _Reading(start)
    for opcode, position, whole in records(content):
        reading.take(opcode, memoryview(content)[position + HEAD.size : position + whole])
    statistics, found = reading.statistics, reading.found
    if statistics is None or (statistics.messages and not found.blocks):
        return None
    _check(found, statistics, start)
    found.counts = statistics.counts
    return found


class _Reading:
    """Takes the records of an index of a file whose data section ends at `end`."""

    def __init__(self, end: int) -> None:
        self.found = Summary()
        self.statistics: fields.Statistics | None = None
        self._room = end  # bytes that records named by the index can still take
        self._defined = self._others = 0

    def take(self, opcode: int, content: memoryview) -> None:
        """Take one record."""
        found = self.found
        match opcode:
            case Opcode.SCHEMA | Opcode.CHANNEL:
                self._define(opcode, content)
            case Opcode.STATISTICS if self.statistics is None:
                self.statistics = fields.statistics(content)
            case Opcode.CHUNK_INDEX:
                row = fields.chunk_index(content)
                self._take_place(row.length)
                found.blocks.append(
                    Block(row.offset, row.length, row.start_ns, row.end_ns, row.size)
                )
            case Opcode.ATTACHMENT_INDEX:
                place = fields.attachment_index(content)
                found.attachments.append(place[:2])
                self._take_record(Opcode.ATTACHMENT, place)
            case Opcode.METADATA_INDEX:
                place = fields.metadata_index(content)
                found.metadata.append(place[:2])
                self._take_record(Opcode.METADATA, place)
            case _:
                self._others += 1
                is_known = opcode == Opcode.SUMMARY_OFFSET or opcode >= 0x80
                if not is_known or self._others > limits.RECORDS:
                    raise BagError(f"a record of kind {opcode} is not allowed in it")

    def _define(self, opcode: int, content: memoryview) -> None:
        self._defined += 1
        if self._defined > limits.DEFINED:
            raise BagError(f"it has more than {limits.DEFINED} definitions")
        if opcode == Opcode.SCHEMA:
            schema = fields.schema(content)
            self.found.schemas[schema.id] = schema
        else:
            channel = fields.channel(content)
            self.found.channels[channel.id] = channel

    def _take_record(self, opcode: Opcode, place: fields.RecordPlace) -> None:
        self.found.names[place.offset] = record_name(opcode, place.name)
        self._take_place(place.length)

    def _take_place(self, length: int) -> None:
        self._room -= length
        if self._room < 0:
            raise BagError("it names more bytes than the file has")


def _check(found: Summary, statistics: fields.Statistics, end: int) -> None:
    """BagError when the index contradicts itself or the file."""
    places = [(block.offset, block.length) for block in found.blocks]
    passed = len(MAGIC)
    for offset, length in sorted([*places, *found.attachments, *found.metadata]):
        if offset < passed or length < HEAD.size or offset + length > end:
            raise BagError("it names records that overlap or lie outside of the file")
        passed = offset + length
    named = len(found.blocks), len(found.attachments), len(found.metadata)
    if named != (statistics.chunks, statistics.attachments, statistics.metadata):
        raise BagError("its counts of records differ from the records that it names")
    if statistics.messages * _LEAST_MESSAGE > sum(block.size for block in found.blocks):
        raise BagError("it counts more messages than there is room for")
    if not statistics.counts.keys() <= found.channels.keys():
        raise BagError("it counts messages of topics that it does not name")
    if not {row.schema_id for row in found.channels.values()} <= {0, *found.schemas}:
        raise BagError("it does not name the types of its topics")

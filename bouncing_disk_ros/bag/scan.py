"""Walk through the bytes of an .mcap file from its beginning, whole, cut or damaged.

Nothing is trusted: chunks and attachments count only when their checksums fit. Where the lengths of
records no longer lead on, the walk goes on at the next whole chunk.
"""

from __future__ import annotations

import contextlib
import re
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata, Schema

from bouncing_disk_ros.bag.chunks import unpacked
from bouncing_disk_ros.bag.formats import BagError
from bouncing_disk_ros.bag.index import CHUNK_HEAD, HEAD, MAGIC, content_stream

_PARSERS = {
    Opcode.HEADER: Header,
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.METADATA: Metadata,
}
_NEXT_CHUNK = re.compile(
    rb"\x06[\x00-\xff]{5}\x00{3}[\x00-\xff]{28}(?:\0{4}|\x04\0{3}zstd|\x03\0{3}lz4)", re.DOTALL
)
"""A chunk record: its length is below 2**40, its compression one of three."""


@dataclass
class Piece:
    """A whole record at `offset`; `inner` are the records of a chunk."""

    opcode: int
    offset: int
    record: bytes
    inner: bytes = b""


@dataclass
class Damage:
    """Bytes that are lost; `counts` the messages of each channel in them, where that is known.

    `holds_messages` is false of a record that is certainly no chunk.
    """

    offset: int
    length: int
    reason: str
    counts: Counter[int] = field(default_factory=Counter)
    span_ns: tuple[int, int] | None = None
    holds_messages: bool = True


def walk(data: memoryview) -> Iterator[Piece | Damage]:
    """All that can be told of a file up to the end of its data section."""
    position = len(MAGIC) if bytes(data[: len(MAGIC)]) == MAGIC else 0
    if not position and _chunk_after(data, 0) is None:
        raise BagError("not an .mcap file: neither its first bytes nor any chunk of one")
    if not position:
        position = len(MAGIC)
        yield Damage(0, position, "the first bytes are not those of an .mcap file")
    is_chunked: bool | None = None
    while position < len(data):
        found = _at(data, position)
        if isinstance(found, Piece) and found.opcode == Opcode.MESSAGE:
            if is_chunked is None:
                is_chunked = _chunk_after(data, position) is not None
            if is_chunked:  # no writer does both: it is another record whose kind is damaged
                found = _damage(data, position, "a message outside of the chunks of this file")
        if found is None:  # the end of the data section
            return
        if isinstance(found, Damage) and not found.length:
            found = _lost_from(data, found)
        if isinstance(found, Piece) and found.opcode == Opcode.CHUNK:
            is_chunked = True
        yield found
        position += len(found.record) if isinstance(found, Piece) else found.length
    yield Damage(len(data), 0, "the file has no end: it was not finished")


def _at(data: memoryview, position: int) -> Piece | Damage | None:
    """What stands at a position; None: the end. Damage of length 0: lengths lead nowhere."""
    if position + HEAD.size > len(data):
        return Damage(position, 0, "cut off")
    opcode, length = HEAD.unpack_from(data, position)
    end = position + HEAD.size + length
    if opcode == Opcode.DATA_END and length == 4:
        return None
    if end > len(data):
        return Damage(position, 0, "cut off", span_ns=_span(data, position))
    record = data[position:end]
    content = record[HEAD.size :]
    try:
        inner = unpacked(content) if opcode == Opcode.CHUNK else b""
        _check(opcode, content)
    except BagError as error:
        return _damage(data, position, str(error))
    return Piece(opcode, position, bytes(record), inner)


def _damage(data: memoryview, position: int, reason: str) -> Piece | Damage:
    """What a bad record is: a chunk of which only the opcode is damaged, or lost."""
    opcode, length = HEAD.unpack_from(data, position)
    end = position + HEAD.size + length
    if opcode != Opcode.CHUNK:
        with contextlib.suppress(BagError):
            record = bytes([Opcode.CHUNK]) + bytes(data[position + 1 : end])
            return Piece(Opcode.CHUNK, position, record, unpacked(record[HEAD.size :]))
    known = _leads_on(data, end)
    return Damage(
        position,
        end - position if known else 0,
        reason,
        span_ns=_span(data, position),
        holds_messages=opcode == Opcode.CHUNK or not known,
    )


def _check(opcode: int, content: memoryview) -> None:
    """BagError unless the content is that of its kind of record."""
    if opcode == Opcode.ATTACHMENT:
        (crc,) = struct.unpack("<I", content[-4:]) if len(content) >= 4 else (1,)
        if crc and zlib.crc32(content[:-4]) != crc:
            raise BagError("damaged attachment: the checksum does not fit")
    elif opcode == Opcode.MESSAGE_INDEX:
        if len(content) < 6 or struct.unpack_from("<I", content, 2)[0] != len(content) - 6:
            raise BagError("damaged message index")
    elif opcode in _PARSERS:
        try:
            _PARSERS[Opcode(opcode)].read(content_stream(content))
        except Exception:  # noqa: BLE001 (the parsers raise whatever comes)
            raise BagError(f"damaged {Opcode(opcode).name.lower()} record") from None
    elif opcode not in (Opcode.CHUNK, Opcode.MESSAGE):
        raise BagError(f"a record of kind {opcode} does not belong here")


def _leads_on(data: memoryview, position: int) -> bool:
    """Whether another record may begin at a position."""
    if position + HEAD.size > len(data):
        return position == len(data)
    opcode, length = HEAD.unpack_from(data, position)
    return 1 <= opcode <= Opcode.DATA_END and position + HEAD.size + length <= len(data)


def _lost_from(data: memoryview, damage: Damage) -> Damage:
    """Lost bytes up to the next whole chunk, or to the end."""
    after = _chunk_after(data, damage.offset + 1)
    damage.length = (len(data) if after is None else after) - damage.offset
    return damage


def _chunk_after(data: memoryview, position: int) -> int | None:
    """Where the next whole chunk begins."""
    for match in _NEXT_CHUNK.finditer(data, position):
        start = match.start()
        _, length = HEAD.unpack_from(data, start)
        if start + HEAD.size + length > len(data):
            continue
        try:
            unpacked(data[start + HEAD.size : start + HEAD.size + length])
        except BagError:
            continue
        return start
    return None


def _span(data: memoryview, position: int) -> tuple[int, int] | None:
    """First and last time of a damaged chunk, when its head can be read and makes sense."""
    if data[position] != Opcode.CHUNK or position + HEAD.size + CHUNK_HEAD.size > len(data):
        return None
    start, end, *_ = CHUNK_HEAD.unpack_from(data, position + HEAD.size)
    return (start, end) if 0 < start <= end < 1 << 63 else None


def count_lost(damage: Damage, piece: Piece) -> None:
    """Add to the damage what the message index of the lost chunk counts."""
    if not damage.holds_messages:
        return
    channel, length = struct.unpack_from("<HI", piece.record, HEAD.size)
    damage.counts[channel] += length // 16


def told(name: str, damage: Damage) -> str:
    """A damage in words."""
    what = f"{damage.counts.total()} messages" if damage.counts else "messages in them unknown"
    what = what if damage.holds_messages else "no messages"
    return (
        f"{name}: bytes {damage.offset} to {damage.offset + damage.length}: {damage.reason}: {what}"
    )

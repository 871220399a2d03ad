"""Walk through an .mcap file from its beginning, whole, cut or damaged.

Nothing is trusted: chunks and attachments count only when their checksums fit. Where the lengths of
records no longer lead on, the walk goes on at the next whole chunk. Memory holds one chunk, and the
work that damage can cause is bounded.
"""

from __future__ import annotations

import contextlib
import struct
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Channel, Chunk, Header, Metadata, Schema
from numpy.typing import NDArray

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.chunk_reader import LEAST_CHUNK, MOST_CHUNK, Inner, chunk_at, unpacked
from bouncing_disk_ros.bag.records import (
    HEAD,
    INDEX_HEAD,
    MAGIC,
    MESSAGE,
    PART,
    Watch,
    attachment,
    content_at,
    nothing,
    read,
    read_name,
    stream,
    stretch,
)  # fmt: skip
from bouncing_disk_ros.errors import BagError
from bouncing_disk_ros.regular_file import RegularFile
from bouncing_disk_ros.units import NS


@dataclass
class Piece:
    """A whole record of `length` bytes at `offset`, or messages outside of chunks in a row.

    `content` is the record, of an attachment without its data; None: such messages. `inner`: the
    messages, of a chunk too.
    """

    offset: int
    length: int
    content: Schema | Channel | Metadata | AttachmentIndex | Chunk | None
    inner: Inner | None = None


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
    record: str = ""  # the attachment or note that it is, where it certainly is one

    def text(self, name: str, channels: Mapping[int, Channel]) -> str:
        """What was lost in a file by it, in words."""
        if not self.length:
            return f"{name}: {self.reason}"
        span = ""
        if self.span_ns is not None:
            first, last = (time / NS for time in self.span_ns)
            span = f", received between {first:.3f} and {last:.3f} s"
        names = {number: channel.topic for number, channel in channels.items()}
        counted = ", ".join(f"{n} of {names.get(c, c)}" for c, n in self.counts.items())
        unknown = "what was there" if self.holds_messages else self.record or "no messages"
        where = f"{name}: bytes {self.offset} to {self.offset + self.length}"
        return f"{where}: {self.reason}: lost {counted or unknown}{span}"


def record_name(opcode: int, name: str) -> str:
    """An attachment or a metadata record in words; name '': not known."""
    what = "attachment" if opcode == Opcode.ATTACHMENT else "note"
    return f"{what} {name}" if name else f"an {what}" if what == "attachment" else f"a {what}"


class TooDamagedError(Exception):
    """Ends a walk: more work than damage may cause. Within a walk a BagError means one record."""


# --- places that look like chunks -----------------------------------------------------------------
_NAME_AT = HEAD.size + 28
"""Where the name of the compression stands in a chunk record, after its length."""
_NAMES = (b"\0\0\0\0", b"\4\0\0\0zstd", b"\3\0\0\0lz4")
_LOOKED_AT = _NAME_AT + 8
"""Bytes of a record by which a chunk is known."""
_TRIED = 4096
"""A place that looks like a chunk and is none costs at least as much as so many bytes."""
_TIMES = struct.Struct("<QQ")
"""First and last time of the messages, at the beginning of a chunk."""


def _candidates(window: bytes) -> list[int]:
    """Places where a chunk may begin: of a length below 2**40 and a compression that is known.

    Takes the same time whatever the window holds.
    """
    data = np.frombuffer(window + bytes(_LOOKED_AT), np.uint8)
    count = min(len(window), PART)

    def at(offset: int) -> NDArray[np.uint8]:
        return data[offset : offset + count]

    found = (at(0) == Opcode.CHUNK) & (at(6) == 0) & (at(7) == 0) & (at(8) == 0)
    found &= (at(_NAME_AT + 1) == 0) & (at(_NAME_AT + 2) == 0) & (at(_NAME_AT + 3) == 0)
    places = np.flatnonzero(found).tolist()
    return [place for place in places if window.startswith(_NAMES, place + _NAME_AT)]


# --- the walk -------------------------------------------------------------------------------------
_BLOCK = 1 << 20
"""Messages outside of chunks are taken together in blocks of about this size."""


class Walk:
    """One walk through a file, up to the end of its data section."""

    def __init__(self, file: RegularFile, watch: Watch = nothing) -> None:
        self._file, self._watch = file, watch
        self._is_chunked: bool | None = None
        self._lost: Damage | None = None  # the damage that message indices belong to
        self._damages = self._attached = self._definitions = 0
        self._search_left = limits.SEARCHED + 2 * file.size  # bytes spent on what is no chunk

    def pieces(self) -> Iterator[Piece | Damage]:
        """All that can be read of the file. BagError: it is no .mcap file, or too damaged."""
        try:
            yield from self._pieces()
        except TooDamagedError as error:
            raise BagError(f"{self._file.path}: too damaged: {error}") from None
        except BagError as error:
            raise BagError(f"{self._file.path}: {error}") from None

    def _pieces(self) -> Iterator[Piece | Damage]:
        size = self._file.size
        position = told = len(MAGIC)
        if size < position or stretch(self._file, 0, position) != MAGIC:
            if self._next_chunk(0) is None:
                raise BagError("not an .mcap file: neither its first bytes nor any chunk of one")
            yield Damage(0, position, "the first bytes are not those of an .mcap file")
        while position < size:
            found = self._at(position)
            if found is None:  # the end of the data section
                yield from self._behind(position)
                return
            if isinstance(found, int):  # a record that says nothing
                position += found
            else:
                if isinstance(found, Damage) and not found.length:
                    after = self._next_chunk(position + 1)
                    found.length = (size if after is None else after) - position
                self._note(found)
                yield found
                position += found.length
            if position - told > PART:
                told = position
                self._watch(position, size)
        yield Damage(size, 0, "the file has no end: it was not finished")

    def _behind(self, position: int) -> Iterator[Damage]:
        """Another file that was appended to this one, whose data section ends at a position."""
        size, both = self._file.size, 2 * MAGIC
        for start in range(position, size, PART):
            window = stretch(self._file, start, min(PART + len(both), size - start))
            if (at := window.find(both)) >= 0:
                begin = start + at + len(MAGIC)
                yield Damage(begin, size - begin, "another file begins here, which is not read")
                return

    def _note(self, found: Piece | Damage) -> None:
        if isinstance(found, Damage):
            self._lost = found
            self._damages += 1
            if self._damages > limits.DAMAGES:
                raise TooDamagedError(f"more than {limits.DAMAGES} places")
        elif isinstance(found.content, Chunk):
            self._is_chunked, self._lost = True, None
        elif isinstance(found.content, Schema | Channel):
            self._definitions += 1
            if self._definitions > limits.DEFINED:
                raise TooDamagedError(f"more than {limits.DEFINED} definitions")
        elif found.content is not None:
            self._attached += 1
            if self._attached > limits.RECORDS:
                raise TooDamagedError(f"more than {limits.RECORDS} attachments and metadata")

    # --- one record -------------------------------------------------------------------------------
    def _head(self, position: int) -> tuple[int, int]:
        """Opcode and whole length of the record at a position; BagError: the file ends before."""
        opcode, length = HEAD.unpack(stretch(self._file, position, HEAD.size))
        return opcode, HEAD.size + length

    def _at(self, position: int) -> Piece | Damage | int | None:
        """What stands at a position; None: the end; a number: a record to pass over, its length.

        Damage of length 0: the lengths lead nowhere.
        """
        if position + HEAD.size > self._file.size:
            return Damage(position, 0, "cut off")
        opcode, whole = self._head(position)
        if opcode == Opcode.DATA_END and whole == HEAD.size + 4:
            return None
        if position + whole > self._file.size:
            return Damage(position, 0, "cut off", span_ns=self._span(opcode, position))
        try:
            return self._read(opcode, position, whole)
        except BagError as error:
            return self._damage(opcode, position, whole, str(error))

    def _read(self, opcode: int, position: int, whole: int) -> Piece | int:
        match opcode:
            case Opcode.CHUNK:
                return self._chunk(position, whole)
            case Opcode.MESSAGE:
                return self._messages(position, whole)
            case Opcode.MESSAGE_INDEX:
                self._count_lost(position, whole)
                return whole
            case Opcode.ATTACHMENT:
                return Piece(position, whole, attachment(self._file, position, whole)[0])
            case Opcode.SCHEMA | Opcode.CHANNEL | Opcode.METADATA | Opcode.HEADER:
                return self._small(opcode, position, whole)
        raise BagError(f"a record of kind {opcode} is not allowed here")

    def _small(self, opcode: int, position: int, whole: int) -> Piece | int:
        content = content_at(self._file, position, whole)
        match opcode:
            case Opcode.SCHEMA:
                return Piece(position, whole, read(Schema, content))
            case Opcode.CHANNEL:
                return Piece(position, whole, read(Channel, content))
            case Opcode.METADATA:
                return Piece(position, whole, read(Metadata, content))
        if position != len(MAGIC):
            raise BagError("a header in the middle of the file")
        read(Header, content)
        return whole

    def _messages(self, position: int, whole: int) -> Piece:
        """Messages in a row outside of chunks; BagError in a file that has chunks."""
        if self._is_chunked is None:
            self._is_chunked = self._next_chunk(position) is not None
        if self._is_chunked:  # no writer does both: it is another record whose kind is damaged
            raise BagError("a message outside of the chunks of this file")
        if whole > limits.CHUNK:
            raise BagError(f"a message of {whole} bytes (at most {limits.CHUNK})")
        end = position
        while end - position < _BLOCK and end + MESSAGE.size <= self._file.size:
            row = MESSAGE.unpack(stretch(self._file, end, MESSAGE.size))
            after, is_true = end + HEAD.size + row[1], max(row[4:]) <= limits.TIME_NS
            if row[0] != Opcode.MESSAGE or after < end + MESSAGE.size or not is_true:
                break
            if after > self._file.size or (end > position and after - end > _BLOCK):
                break
            end = after
        if end == position:
            raise BagError("damaged: a message too short for its fields, or beyond the year 2262")
        data = stretch(self._file, position, end - position)
        return Piece(position, len(data), None, Inner(data))

    def _count_lost(self, position: int, whole: int) -> None:
        """Check a message index; after a damage it says what is lost."""
        rest = whole - HEAD.size - INDEX_HEAD.size
        found = stretch(self._file, position + HEAD.size, INDEX_HEAD.size)
        channel, length = INDEX_HEAD.unpack(found)
        if not 0 <= rest - length < LEAST_CHUNK:  # bytes behind its entries hide no chunk
            raise BagError("damaged message index")
        if self._lost is not None and self._lost.holds_messages:
            self._lost.counts[channel] += length // 16

    # --- chunks -----------------------------------------------------------------------------------
    def _chunk(self, position: int, whole: int) -> Piece:
        """The chunk that stands at a position, `whole` bytes long, whatever its opcode is.

        Raises BagError where none stands, TooDamagedError when that was tried too often.
        """
        cost = _TRIED + (whole if whole <= MOST_CHUNK else 0)
        try:
            chunk = chunk_at(self._file, position, whole)
            cost += chunk.uncompressed_size
            return Piece(position, whole, chunk, Inner(unpacked(chunk)))
        except BagError:
            self._search_left -= cost
            if self._search_left < 0:
                raise TooDamagedError("too many places look like chunks") from None
            raise

    def _next_chunk(self, position: int) -> int | None:
        """Where the next whole chunk begins."""
        size = self._file.size
        for start in range(position, size, PART):
            self._watch(start, size)
            window = stretch(self._file, start, min(PART + _LOOKED_AT, size - start))
            for place in _candidates(window):
                whole = HEAD.size + HEAD.unpack_from(window, place)[1]
                if start + place + whole > size:
                    continue
                with contextlib.suppress(BagError):
                    self._chunk(start + place, whole)
                    return start + place
        return None

    # --- damage -----------------------------------------------------------------------------------
    def _damage(self, opcode: int, position: int, whole: int, reason: str) -> Piece | Damage:
        """What a bad record is: a chunk of which only the opcode is damaged, or lost."""
        if opcode != Opcode.CHUNK:
            with contextlib.suppress(BagError):
                return self._chunk(position, whole)
        known = self._leads_on(position + whole)
        return Damage(
            position,
            whole if known else 0,
            reason,
            span_ns=self._span(opcode, position),
            holds_messages=opcode == Opcode.CHUNK or not known,
            record=self._named(opcode, position, whole) if known else "",
        )

    def _named(self, opcode: int, position: int, whole: int) -> str:
        """Which attachment or note a damaged record is; '': neither."""
        if opcode not in (Opcode.ATTACHMENT, Opcode.METADATA):
            return ""
        skipped = HEAD.size + (16 if opcode == Opcode.ATTACHMENT else 0)
        with contextlib.suppress(BagError):
            length = min(whole - skipped, 4 + limits.NAME)
            return record_name(
                opcode, read_name(stream(stretch(self._file, position + skipped, length)))
            )
        return record_name(opcode, "")

    def _leads_on(self, position: int) -> bool:
        """Whether another record may begin at a position."""
        size = self._file.size
        if position + HEAD.size > size:
            return position == size
        opcode, whole = self._head(position)
        return 1 <= opcode <= Opcode.DATA_END and position + whole <= size

    def _span(self, opcode: int, position: int) -> tuple[int, int] | None:
        """First and last time of a damaged chunk, when its head can be read and makes sense."""
        if opcode != Opcode.CHUNK:
            return None
        with contextlib.suppress(BagError):
            found = stretch(self._file, position + HEAD.size, _TIMES.size)
            start, end = _TIMES.unpack(found)
            return (start, end) if 0 < start <= end <= limits.TIME_NS else None
        return None

"""Walk through an .mcap file from its beginning, whole, cut or damaged.

Nothing is trusted: chunks and attachments count only when their checksums fit. Where the lengths of
records no longer lead on, the walk goes on at the next whole chunk. Memory holds one chunk, and the
work that damage can cause is bounded.
"""

from __future__ import annotations

import contextlib
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Metadata, Schema
from numpy.typing import NDArray

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.chunk_reader import Inner, unpacked
from bouncing_disk_ros.bag.records import (
    ATTACHMENT_HEAD,
    CHUNK_HEAD,
    HEAD,
    INDEX_HEAD,
    MAGIC,
    PART,
    TIMES,
    AttachmentHead,
    RegularFile,
    Stream,
    Watch,
    attachment,
    checked_attachment,
    chunk,
    definition,
    nothing,
    read,
)  # fmt: skip
from bouncing_disk_ros.errors import BagError


@dataclass
class Piece:
    """A whole record of `length` bytes at `offset`, or (MESSAGE) messages in a row.

    `record` are its bytes, but of attachments, which may be long. `inner`: its messages. `content`:
    what a record without messages says, of an attachment without its data.
    """

    opcode: int
    offset: int
    length: int
    record: bytes = b""
    inner: Inner | None = None
    content: Schema | Channel | Metadata | AttachmentHead | None = None


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


def describe(name: str, damage: Damage) -> str:
    """A damage in words."""
    what = f"{damage.counts.total()} messages" if damage.counts else "messages in them unknown"
    what = what if damage.holds_messages else damage.record or "no messages"
    return (
        f"{name}: bytes {damage.offset} to {damage.offset + damage.length}: {damage.reason}: {what}"
    )


def record_name(opcode: int, name: str) -> str:
    """An attachment or a metadata record in words; name '': not known."""
    what = "attachment" if opcode == Opcode.ATTACHMENT else "note"
    return f"{what} {name}" if name else f"an {what}" if what == "attachment" else f"a {what}"


# --- the next chunk in damaged bytes --------------------------------------------------------------
_NAME_AT = HEAD.size + 28
"""Where the name of the compression stands in a chunk record, after its length."""
_NAMES = (b"\0\0\0\0", b"\4\0\0\0zstd", b"\3\0\0\0lz4")
_LOOKED_AT = _NAME_AT + 8
"""Bytes of a record by which a chunk is known."""
_TRIED = 4096
"""A place that looks like a chunk and is none costs at least as much as so many bytes."""


class TooDamagedError(Exception):
    """Ends a walk: more work than damage may cause. Within a walk a BagError means one record."""


class ChunkSearch:
    """Reads chunks of a file; what is spent on places that are none is limited."""

    def __init__(self, file: RegularFile, watch: Watch) -> None:
        self._file, self._watch = file, watch
        self._left = limits.SEARCHED + 2 * file.size

    def read(self, position: int, whole: int) -> Piece:
        """The chunk that stands at a position, `whole` bytes long, whatever its opcode is.

        Raises BagError where none stands, TooDamagedError when that was tried too often.
        """
        cost = _TRIED
        try:
            length = whole - HEAD.size
            beginning = self._file.read(position + HEAD.size, min(length, CHUNK_HEAD))
            cost += whole + chunk(beginning, length).size
            record = self._file.read(position, whole)
            _, data = unpacked(memoryview(record)[HEAD.size :])
            inner = Inner(data)
            return Piece(Opcode.CHUNK, position, whole, _put_right(record, inner), inner)
        except BagError:
            self._left -= cost
            if self._left < 0:
                raise TooDamagedError("too many places look like chunks") from None
            raise

    def after(self, position: int) -> int | None:
        """Where the next whole chunk begins."""
        size = self._file.size
        for start in range(position, size, PART):
            self._watch(start, size)
            window = self._file.read(start, min(PART + _LOOKED_AT, size - start))
            for place in _candidates(window):
                _, length = HEAD.unpack_from(window, place)
                if start + place + HEAD.size + length > size:
                    continue
                with contextlib.suppress(BagError):
                    self.read(start + place, HEAD.size + length)
                    return start + place
        return None


def _put_right(record: bytes, inner: Inner) -> bytes:
    """A chunk record with its opcode and the times of its messages, which no checksum covers."""
    head = HEAD.pack(Opcode.CHUNK, len(record) - HEAD.size) + TIMES.pack(*inner.span)
    return record if record.startswith(head) else head + record[len(head) :]


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
BLOCK = 1 << 20
"""Messages outside of chunks are taken together in blocks of about this size."""


class Window:
    """The part of a file that a walk looks at, moved along with it."""

    def __init__(self, file: RegularFile) -> None:
        self._file = file
        self._data, self._at = b"", 0

    def _within(self, position: int, length: int) -> int:
        """Where a stretch of the file begins in the window, which is moved to it if need be."""
        within = position - self._at
        if not 0 <= within <= len(self._data) - length:
            part = min(max(PART, length), self._file.size - position)
            if part < length:
                raise BagError("cut off")
            self._data, self._at, within = self._file.read(position, part), position, 0
        return within

    def unpack(self, form: struct.Struct, position: int) -> tuple[int, ...]:
        """Numbers at a position; BagError where the file ends before."""
        within = self._within(position, form.size)
        return form.unpack_from(self._data, within)

    def bytes(self, position: int, length: int) -> bytes:
        """A short stretch of the file; BagError where it ends before."""
        within = self._within(position, length)
        return self._data[within : within + length]

    def head(self, position: int) -> tuple[int, int]:
        """Opcode and length of the content of the record at a position."""
        opcode, length = self.unpack(HEAD, position)
        return opcode, length


class Walk:
    """One walk through a file, up to the end of its data section."""

    def __init__(self, file: RegularFile, watch: Watch = nothing) -> None:
        self._file, self._watch = file, watch
        self._window, self._chunks = Window(file), ChunkSearch(file, watch)
        self._is_chunked: bool | None = None
        self._one_by_one = 0  # messages before this place are taken one by one
        self._lost: Damage | None = None  # the damage that message indices belong to
        self._inner: Inner | None = None  # the chunk before, if it is whole
        self._indices_left = 0  # message indices that may follow
        self._damages = self._empty = self._attached = self._definitions = 0
        self._defined: set[bytes] = set()  # records that are definitions

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
        if size < position or self._file.read(0, position) != MAGIC:
            if self._chunks.after(0) is None:
                raise BagError("not an .mcap file: neither its first bytes nor any chunk of one")
            yield Damage(0, position, "the first bytes are not those of an .mcap file")
        while position < size:
            found = self._at(position)
            if found is None:  # the end of the data section
                return
            if isinstance(found, int):  # a record that says nothing
                position += found
            else:
                if isinstance(found, Damage) and not found.length:
                    after = self._chunks.after(position + 1)
                    found.length = (size if after is None else after) - position
                self._note(found)
                yield found
                position += found.length
            if position - told > PART:
                told = position
                self._watch(position, size)
        yield Damage(size, 0, "the file has no end: it was not finished")

    def _note(self, found: Piece | Damage) -> None:
        if isinstance(found, Damage):
            self._lost, self._inner = found, None
            if found.holds_messages:
                self._indices_left = 1 << 16  # one for each channel
            self._damages += 1
            if self._damages > limits.DAMAGES:
                raise TooDamagedError(f"more than {limits.DAMAGES} places")
        elif found.opcode == Opcode.CHUNK and found.inner is not None:
            self._is_chunked, self._lost, self._inner = True, None, found.inner
            self._indices_left = len(found.inner.times)
        elif found.opcode in (Opcode.ATTACHMENT, Opcode.METADATA):
            self._attached += 1
            if self._attached > limits.RECORDS:
                raise TooDamagedError(f"more than {limits.RECORDS} attachments and metadata")

    # --- one record -------------------------------------------------------------------------------
    def _at(self, position: int) -> Piece | Damage | int | None:
        """What stands at a position; None: the end; a number: a record to pass over, its length.

        Damage of length 0: the lengths lead nowhere.
        """
        if position + HEAD.size > self._file.size:
            return Damage(position, 0, "cut off")
        opcode, length = self._window.head(position)
        if opcode == Opcode.DATA_END and length == 4:
            return None
        whole = HEAD.size + length
        if position + whole > self._file.size:
            return Damage(position, 0, "cut off", span_ns=self._span(position))
        try:
            return self._read(opcode, position, whole)
        except BagError as error:
            return self._damage(position, str(error))

    def _read(self, opcode: int, position: int, whole: int) -> Piece | int:
        match opcode:
            case Opcode.CHUNK:
                return self._chunks.read(position, whole)
            case Opcode.MESSAGE:
                return self._messages(position, whole)
            case Opcode.MESSAGE_INDEX:
                self._count_lost(position, whole)
                return whole
            case Opcode.ATTACHMENT:
                return self._attachment(position, whole)
            case Opcode.SCHEMA | Opcode.CHANNEL | Opcode.METADATA | Opcode.HEADER:
                return self._small(opcode, position, whole)
        raise BagError(f"a record of kind {opcode} is not allowed here")

    def _small(self, opcode: int, position: int, whole: int) -> Piece | int:
        if whole > limits.RECORD:
            raise BagError(f"a record of {whole} bytes (at most {limits.RECORD})")
        record = self._window.bytes(position, whole)
        content = memoryview(record)[HEAD.size :]
        match opcode:
            case Opcode.SCHEMA | Opcode.CHANNEL:
                return self._definition(opcode, position, record)
            case Opcode.METADATA:
                return Piece(opcode, position, whole, record, content=read(Metadata, content))
        if position != len(MAGIC):
            raise BagError("a header in the middle of the file")
        read(Header, content)
        return whole

    def _definition(self, opcode: int, position: int, record: bytes) -> Piece | int:
        """A definition of a topic or a type; one that was there before says nothing."""
        self._definitions += 1
        if self._definitions > limits.DEFINED:
            raise TooDamagedError(f"more than {limits.DEFINED} definitions")
        if record in self._defined:
            return len(record)
        row = definition(opcode, memoryview(record)[HEAD.size :])
        self._defined.add(record)
        return Piece(opcode, position, len(record), record, content=row)

    def _attachment(self, position: int, whole: int) -> Piece:
        head = checked_attachment(self._file, position, whole)
        return Piece(Opcode.ATTACHMENT, position, whole, content=head)

    def _messages(self, position: int, whole: int) -> Piece:
        """Messages in a row outside of chunks; BagError in a file that has chunks."""
        if self._is_chunked is None:
            self._is_chunked = self._chunks.after(position) is not None
        if self._is_chunked:  # no writer does both: it is another record whose kind is damaged
            raise BagError("a message outside of the chunks of this file")
        if whole > limits.CHUNK:
            raise BagError(f"a message of {whole} bytes (at most {limits.CHUNK})")
        end = position + whole
        while end - position < BLOCK and position >= self._one_by_one:
            if end + HEAD.size > self._file.size:
                break
            opcode, length = self._window.head(end)
            after = end + HEAD.size + length
            if opcode != Opcode.MESSAGE or after > self._file.size or length > BLOCK:
                break
            end = after
        record = self._file.read(position, end - position)
        try:
            return Piece(Opcode.MESSAGE, position, end - position, record, Inner(record))
        except BagError:
            if end - position == whole:
                raise
            self._one_by_one = end
            return self._messages(position, whole)

    def _count_lost(self, position: int, whole: int) -> None:
        """Check a message index; after a damage it says what is lost."""
        rest = whole - HEAD.size - INDEX_HEAD.size
        if rest < 0:
            raise BagError("damaged message index")
        channel, length = self._window.unpack(INDEX_HEAD, position + HEAD.size)
        if length != rest and not (length < rest and self._is_true(channel, position, length)):
            raise BagError("damaged message index")
        if not length:
            self._empty += 1
            if self._empty > limits.RECORDS:
                raise TooDamagedError(f"more than {limits.RECORDS} empty message indices")
        elif (left := self._indices_left) > 0:
            self._indices_left = left - 1
        else:
            raise BagError("more message indices than messages")
        if self._lost is not None and self._lost.holds_messages:
            self._lost.counts[channel] += length // 16

    def _is_true(self, channel: int, position: int, length: int) -> bool:
        """Whether a message index, with bytes behind it, is that of the chunk before."""
        true = self._inner.indices.get(channel, b"") if self._inner is not None else b""
        if not true or len(true) != length:
            return False
        return self._file.read(position + HEAD.size + INDEX_HEAD.size, length) == true

    # --- damage -----------------------------------------------------------------------------------
    def _damage(self, position: int, reason: str) -> Piece | Damage:
        """What a bad record is: a chunk of which only the opcode is damaged, or lost."""
        opcode, length = self._window.head(position)
        whole = HEAD.size + length
        if opcode != Opcode.CHUNK:
            with contextlib.suppress(BagError):
                return self._chunks.read(position, whole)
        known = self._leads_on(position + whole)
        return Damage(
            position,
            whole if known else 0,
            reason,
            span_ns=self._span(position),
            holds_messages=opcode == Opcode.CHUNK or not known,
            record=self._named(opcode, position, length) if known else "",
        )

    def _named(self, opcode: int, position: int, length: int) -> str:
        """Which attachment or note a damaged record is; '': neither."""
        if opcode not in (Opcode.ATTACHMENT, Opcode.METADATA):
            return ""
        content = self._file.read(position + HEAD.size, min(length, ATTACHMENT_HEAD))
        name = ""
        with contextlib.suppress(BagError):
            if opcode == Opcode.ATTACHMENT:
                name = attachment(content, length).name
            else:
                name = Stream(content).name()
        return record_name(opcode, name)

    def _leads_on(self, position: int) -> bool:
        """Whether another record may begin at a position."""
        size = self._file.size
        if position + HEAD.size > size:
            return position == size
        opcode, length = self._window.head(position)
        return 1 <= opcode <= Opcode.DATA_END and position + HEAD.size + length <= size

    def _span(self, position: int) -> tuple[int, int] | None:
        """First and last time of a damaged chunk, when its head can be read and makes sense."""
        if self._window.head(position)[0] != Opcode.CHUNK:
            return None
        with contextlib.suppress(BagError):
            start, end = self._window.unpack(TIMES, position + HEAD.size)
            return (start, end) if 0 < start <= end <= limits.TIME_NS else None
        return None


@contextlib.contextmanager
def walking(name: str) -> Iterator[Callable[[int, int], None]]:
    """A watch for `bag.open`: on a terminal, a bar while files are walked through."""
    from tqdm import tqdm

    bar = tqdm(desc=name, unit="B", unit_scale=True, leave=False, disable=None, delay=0.5)

    def watch(passed: int, size: int) -> None:
        bar.total = size
        bar.update(passed - bar.n)

    try:
        yield watch
    finally:
        bar.close()

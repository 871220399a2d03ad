"""Walk through an .mcap file from its beginning, whole, cut or damaged.

Nothing is trusted: chunks and attachments count only when their checksums fit. Where the lengths of
records no longer lead on, the walk goes on at the next whole chunk. Memory holds one chunk, and the
work that damage can cause is bounded.
"""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Iterator

from mcap.opcode import Opcode

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag import fields
from bouncing_disk_ros.bag.chunk_reader import Inner
from bouncing_disk_ros.bag.file_pieces import Damage, Piece, record_name
from bouncing_disk_ros.bag.files import HEAD, PART, RegularFile, Window
from bouncing_disk_ros.bag.formats import BagError
from bouncing_disk_ros.bag.index import MAGIC
from bouncing_disk_ros.bag.search import ChunkSearch, TooDamagedError, Watch

BLOCK = 1 << 20
"""Messages outside of chunks are taken together in blocks of about this size."""
_MESSAGE_INDEX = struct.Struct("<HI")
_SPAN = struct.Struct("<QQ")


def nothing(_passed: int, _size: int) -> None:
    """Watch nothing."""


class Walk:
    """One walk through a file, up to the end of its data section."""

    def __init__(self, file: RegularFile, watch: Watch = nothing) -> None:
        self._file, self._watch = file, watch
        self._window, self._chunks = Window(file), ChunkSearch(file, watch)
        self._is_chunked: bool | None = None
        self._one_by_one = 0  # messages before this place are taken one by one
        self._lost: Damage | None = None  # the damage that message indices belong to
        self._indices_left = 0  # message indices that may follow
        self._damages = self._empty = self._attached = self._definitions = 0
        self._defined: set[bytes] = set()  # records that are definitions

    def pieces(self) -> Iterator[Piece | Damage]:
        """All that can be read of the file. BagError: it is no .mcap file, or too damaged."""
        try:
            yield from self._pieces()
        except TooDamagedError as error:
            raise BagError(f"too damaged: {error}") from None

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
            self._lost = found
            if found.holds_messages:
                self._indices_left = 1 << 16  # one for each channel
            self._damages += 1
            if self._damages > limits.DAMAGES:
                raise TooDamagedError(f"more than {limits.DAMAGES} places")
        elif found.opcode == Opcode.CHUNK and found.inner is not None:
            self._is_chunked, self._lost = True, None
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
                fields.metadata(content)
            case _:
                if position != len(MAGIC):
                    raise BagError("a header in the middle of the file")
                fields.header(content)
                return whole
        return Piece(opcode, position, whole, record)

    def _definition(self, opcode: int, position: int, record: bytes) -> Piece | int:
        """A definition of a topic or a type; one that was there before says nothing."""
        self._definitions += 1
        if self._definitions > limits.DEFINED:
            raise TooDamagedError(f"more than {limits.DEFINED} definitions")
        if record in self._defined:
            return len(record)
        content = memoryview(record)[HEAD.size :]
        fields.schema(content) if opcode == Opcode.SCHEMA else fields.channel(content)
        self._defined.add(record)
        return Piece(opcode, position, len(record), record)

    def _attachment(self, position: int, whole: int) -> Piece:
        start, length = position + HEAD.size, whole - HEAD.size
        content = self._file.read(start, min(length, fields.ATTACHMENT_HEAD))
        fields.attachment(content, length)
        (crc,) = struct.unpack("<I", self._file.read(start + length - 4, 4))
        if crc and self._file.checksum(start, length - 4) != crc:
            raise BagError("damaged attachment: the checksum is wrong")
        return Piece(Opcode.ATTACHMENT, position, whole)

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
        if whole < HEAD.size + _MESSAGE_INDEX.size:
            raise BagError("damaged message index")
        channel, length = self._window.unpack(_MESSAGE_INDEX, position + HEAD.size)
        if length != whole - HEAD.size - _MESSAGE_INDEX.size:
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
        content = self._file.read(position + HEAD.size, min(length, fields.ATTACHMENT_HEAD))
        name = ""
        with contextlib.suppress(BagError):
            if opcode == Opcode.ATTACHMENT:
                name = fields.attachment(content, length).name
            else:
                name = fields.Fields(content).name()
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
            start, end = self._window.unpack(_SPAN, position + HEAD.size)
            return (start, end) if 0 < start <= end <= limits.TIME_NS else None
        return None

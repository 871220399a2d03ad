"""Chunks where nothing says that there are any: the search for the next one in damaged bytes."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable

from mcap.opcode import Opcode

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag import fields
from bouncing_disk_ros.bag.chunks import Inner, unpacked
from bouncing_disk_ros.bag.files import HEAD, PART, RegularFile
from bouncing_disk_ros.bag.formats import BagError
from bouncing_disk_ros.bag.pieces import Piece

Watch = Callable[[int, int], object]
"""Called now and then with the bytes passed and the bytes of the file; may raise to end a walk."""

_NEXT_CHUNK = re.compile(
    rb"\x06[\x00-\xff]{5}\x00{3}[\x00-\xff]{28}(?:\0{4}|\x04\0{3}zstd|\x03\0{3}lz4)", re.DOTALL
)
"""A chunk record: its length is below 2**40, its compression one of three."""
_PATTERN_LENGTH = 64
"""The pattern is shorter than this."""
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
            beginning = self._file.read(position + HEAD.size, min(length, fields.CHUNK_HEAD))
            cost += whole + fields.chunk(beginning, length).size
            record = self._file.read(position, whole)
            if record[0] != Opcode.CHUNK:
                record = bytes([Opcode.CHUNK]) + record[1:]
            _, data = unpacked(memoryview(record)[HEAD.size :])
            return Piece(Opcode.CHUNK, position, whole, record, Inner(data))
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
            window = self._file.read(start, min(PART + _PATTERN_LENGTH, size - start))
            for match in _NEXT_CHUNK.finditer(window):
                if match.start() >= PART:  # the next window has it
                    break
                _, length = HEAD.unpack_from(window, match.start())
                place = start + match.start()
                if place + HEAD.size + length > size:
                    continue
                with contextlib.suppress(BagError):
                    self.read(place, HEAD.size + length)
                    return place
        return None

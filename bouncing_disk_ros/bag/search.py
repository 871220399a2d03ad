"""Chunks where nothing says that there are any: the search for the next one in damaged bytes."""

from __future__ import annotations

import contextlib
from collections.abc import Callable

import numpy as np
from mcap.opcode import Opcode
from numpy.typing import NDArray

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag import fields
from bouncing_disk_ros.bag.chunk_reader import Inner, unpacked
from bouncing_disk_ros.bag.file_pieces import Piece
from bouncing_disk_ros.bag.files import HEAD, PART, RegularFile
from bouncing_disk_ros.bag.formats import BagError

Watch = Callable[[int, int], object]
"""Called now and then with the bytes passed and the bytes of the file; may raise to end a walk."""

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
            window = self._file.read(start, min(PART + _LOOKED_AT, size - start))
            for place in _candidates(window):
                _, length = HEAD.unpack_from(window, place)
                if start + place + HEAD.size + length > size:
                    continue
                with contextlib.suppress(BagError):
                    self.read(start + place, HEAD.size + length)
                    return start + place
        return None


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

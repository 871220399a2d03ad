"""A file of a bag, open for reading: never beyond its end, and in parts where it is long."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

from bouncing_disk_ros.bag.formats import BagError
from bouncing_disk_ros.regular_file import open_regular

PART = 1 << 20
"""Long stretches are read in parts of this size: Ctrl-C takes effect, and memory stays small."""
_PIECE = 16 * PART


class RegularFile:
    """A regular file; `size` is that of its opening. Use it as a context, or `close` it."""

    def __init__(self, path: Path) -> None:
        """Open it; InputError when it is no regular file or cannot be read."""
        self.path = path
        self._number, self.size = open_regular("bag", path)

    def read(self, offset: int, length: int) -> bytes:
        """`length` bytes from `offset` on; BagError where the file does not hold them."""
        if offset < 0 or length < 0 or offset + length > self.size:
            raise BagError(f"damaged: {length} bytes at byte {offset} of {self.size}")
        parts = list(self._parts(offset, length, _PIECE))
        return parts[0] if len(parts) == 1 else b"".join(parts)

    def _parts(self, offset: int, length: int, most: int) -> Iterator[bytes]:
        end = offset + length
        while offset < end:
            part = os.pread(self._number, min(end - offset, most), offset)
            if not part:
                raise BagError("it has become shorter while it was read")
            yield part
            offset += len(part)

    def parts(self, offset: int, length: int) -> Iterator[bytes]:
        """The same as `read`, bit by bit: for records of any length."""
        if offset + length > self.size:
            raise BagError(f"damaged: {length} bytes at byte {offset} of {self.size}")
        return self._parts(offset, length, PART)

    def checksum(self, offset: int, length: int) -> int:
        """CRC-32 of a stretch."""
        crc = 0
        for part in self.parts(offset, length):
            crc = zlib.crc32(part, crc)
        return crc

    def close(self) -> None:
        """Let go of the file."""
        if self._number >= 0:
            os.close(self._number)
            self._number = -1

    def __enter__(self) -> RegularFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


HEAD = struct.Struct("<BQ")
"""Opcode and length before the content of every record."""


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

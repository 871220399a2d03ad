"""Files filled with one thing: what makes a walk or a search slow, or a list long."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

from support.hostile.base import entry, put
from support.mcap_bytes import MAGIC


def _record(opcode: int, data: bytes = b"") -> bytes:
    return struct.pack("<BQ", opcode, len(data)) + data


def _chunk_head(length: int, name: bytes = b"", size: int = 0) -> bytes:
    """The head of a chunk record that claims to hold so many bytes."""
    head = struct.pack("<QQQII", 1, 1, size, 1, len(name)) + name
    return struct.pack("<BQ", 6, len(head) + 8 + length) + head + struct.pack("<Q", length)


FLOODS: dict[str, Callable[[int], bytes]] = {
    "records of no kind": lambda size: bytes([0x10]) + bytes(8),
    "records of programs": lambda size: _record(0x80),
    "message indices of nothing": lambda size: _record(7, bytes(6)),
    "message indices": lambda size: _record(7, struct.pack("<HI", 0, 16) + bytes(16)),
    "metadata records": lambda size: _record(12, bytes(8)),
    "topics": lambda size: _record(4, struct.pack("<HHI", 1, 1, 1) + b"a" + bytes(8)),
    "types": lambda size: _record(3, struct.pack("<H", 1) + bytes(12)),
    "headers": lambda size: _record(1, bytes(8)),
    "empty chunks": lambda size: _chunk_head(0),
    "chunks that claim all": lambda size: _chunk_head(size, b"", size),
    "chunks of zstd that claim all": lambda size: _chunk_head(size, b"zstd", 1 << 20),
    "chunks of lz4 that claim all": lambda size: _chunk_head(size, b"lz4", 1 << 20),
    "ones": lambda size: b"\x06" * 50,
    "zeros": lambda size: bytes(1000),
}
"""What a file can be filled with; the argument is a length that nearly reaches its end."""


def flood(name: str, size: int) -> bytes:
    """A file of about so many bytes, filled with one thing."""
    one = FLOODS[name](size // 2)
    return MAGIC + _record(1, bytes(8)) + one * (size // len(one))


def _enter(name: str) -> None:
    # some thousands are many; of records of no kind it takes more to be too many
    size = 1 << 18 if name.startswith("records of") else 1 << 16

    def make(folder: Path) -> Path:
        return put(folder, flood(name, size))

    entry(f"flood of {name}")(make)


for _name in FLOODS:
    _enter(_name)

"""Hostile chunks: compression that lies, bombs, records that do not fit; an index that lies."""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lz4.frame
import zstandard

from support.hostile.base import content, enter_forged, entry, put
from support.mcap_bytes import forged

_SIZES = {"small": 1000, "true": 4 << 20, "half": 2 << 20, "huge": 1 << 40}
_PACKS: dict[str, Callable[[bytes], bytes]] = {
    "zstd": zstandard.compress, "lz4": lz4.frame.compress,
    "zstd without a size": zstandard.ZstdCompressor(write_content_size=False).compress,
}  # fmt: skip


@functools.cache
def _bomb(pack: str) -> bytes:
    """4 MiB of zeros, packed."""
    return _PACKS[pack](bytes(_SIZES["true"]))


def _enter_bomb(pack: str, size: str) -> None:
    def forge() -> dict[str, Any]:
        return {
            "chunk.stored": _bomb(pack), "chunk.crc": 0, "chunk.size": _SIZES[size],
            "chunk.compression": pack.partition(" ")[0],
        }  # fmt: skip

    enter_forged(f"bomb of {pack}, {size} size", forge, per_chunk=1000)


for _pack in _PACKS:
    for _size in _SIZES:
        _enter_bomb(_pack, _size)
for _name in ("zstd", "lz4"):
    enter_forged(f"{_name} cut off", {"chunk.stored": lambda data: data[: len(data) // 2]},
                 compression=_name)  # fmt: skip
    enter_forged(f"{_name} with more behind it", {"chunk.stored": lambda data: data + bytes(100)},
                 compression=_name)  # fmt: skip
enter_forged("unknown compression", {"chunk.compression": "rar"})
enter_forged("a chunk of zeros", {"chunk.records": lambda data: bytes(len(data))})
enter_forged("a chunk of a record that runs over the end",
             {"chunk.records": lambda data: data + struct.pack("<BQ", 5, 1 << 40)})  # fmt: skip
enter_forged("a chunk in a chunk", {"chunk.records": lambda data: data + b"\x06" + bytes(8)})
enter_forged("statistics twice", {"attachment_index.opcode": 11})


@entry("an index that names one chunk often")
def _often(folder: Path) -> Path:
    seen: list[int] = []

    def first(offset: int) -> int:
        seen.append(offset)
        return seen[0]

    return put(folder, forged({"chunk_index.offset": first}, content(per_chunk=10)))

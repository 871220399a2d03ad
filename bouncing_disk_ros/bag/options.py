"""How a bag is written, and the error of a disk that takes no more."""

from __future__ import annotations

from dataclasses import dataclass

from mcap.writer import CompressionType

from bouncing_disk_ros.errors import InputError

COMPRESSIONS = {
    "zstd": CompressionType.ZSTD,
    "lz4": CompressionType.LZ4,
    "none": CompressionType.NONE,
}


class WriteError(Exception):
    """The disk took no more. The bag is closed; what it holds can be read. One line."""


@dataclass(frozen=True)
class Options:
    """How a bag is written; sizes in bytes, times in seconds, 0: no limit."""

    compression: str = "zstd"
    chunk_size: int = 1 << 20
    chunk_period: float = 1.0
    max_size: int = 0
    max_duration: float = 0.0

    def __post_init__(self) -> None:
        if self.compression not in COMPRESSIONS:
            raise InputError("compression", self.compression, ", ".join(COMPRESSIONS))

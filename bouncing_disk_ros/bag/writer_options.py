"""Options of a bag writer, and the error of a disk that is full."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from mcap.writer import CompressionType

from bouncing_disk_ros.errors import InputError

COMPRESSIONS = {
    "zstd": CompressionType.ZSTD,
    "lz4": CompressionType.LZ4,
    "none": CompressionType.NONE,
}


class WriteError(Exception):
    """Error of a bag that cannot be written further. It is closed and can be read. One line."""


@dataclass(frozen=True)
class Options:
    """Options of a bag writer; sizes in bytes, times in seconds, 0: no limit."""

    compression: str = "zstd"
    chunk_size: int = 1 << 20
    chunk_period: float = 1.0
    max_size: int = 0
    max_duration: float = 0.0
    max_chunks: int = 25_000
    """A file's index is held in memory, 2 kB for each chunk: a new file bounds it (50 MB)."""

    def __post_init__(self) -> None:
        if self.compression not in COMPRESSIONS:
            raise InputError("compression", self.compression, ", ".join(COMPRESSIONS))


DISPLACED = "was deleted, moved or replaced"


def write_error(folder: Path, error: Exception, lost: int, *, is_there: bool = True) -> WriteError:
    """The line for the user: why nothing more can be written, and how much is lost by it.

    `is_there`: whether all files of the bag are in their place.
    """
    if isinstance(error, OSError):
        why = error.strerror or str(error)
    else:
        why = f"an error of the recorder itself, {type(error).__name__}: {error}"
    what = f"; {lost} messages that were received are not in it" if lost else ""
    why = f"recording ended: {why}{what}"
    rest = "The bag can be read up to that point"
    if not is_there:
        rest = "A bag that was moved can be read where it is now"
    return WriteError(f"{folder}: {why}. {rest}")

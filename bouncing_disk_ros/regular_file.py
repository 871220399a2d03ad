"""Regular files, read or replaced: links to write through and FIFOs to wait for are refused."""

from __future__ import annotations

import errno
import io
import os
import stat
from collections.abc import Callable
from pathlib import Path

from bouncing_disk_ros.errors import FailedError, InputError

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a FIFO",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def irregular(path: Path) -> str:
    """What stands at a path if it is no regular file (or a link to one), in words; '' if it is.

    Raises OSError where nothing stands there or it cannot be looked at.
    """
    kind = stat.S_IFMT(path.stat().st_mode)
    return "" if kind == stat.S_IFREG else _KINDS.get(kind, "something else")


def is_regular(path: Path) -> bool:
    """Whether a regular file stands at a path (or a link to one)."""
    try:
        return not irregular(path)
    except (OSError, ValueError):  # ValueError: a name with a zero byte
        return False


class RegularFile(io.BufferedReader):
    """A regular file (or a link to one), open to be read; `size` was taken when it was opened.

    InputError, naming `field`, where it is none or cannot be read.
    """

    def __init__(self, field: str, path: Path) -> None:
        allowed = "a regular file that can be read"
        try:
            found = irregular(path)  # before it is opened: to open a device may have effects
            if not found:
                flags = os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK | os.O_NOCTTY
                super().__init__(io.FileIO(os.open(path, flags), "rb"))
        except (OSError, ValueError) as error:
            raise InputError(field, str(path), allowed, reason(error)) from None
        if found:
            raise InputError(field, str(path), allowed, f"It is {found}.")
        status = os.fstat(self.fileno())
        if not stat.S_ISREG(status.st_mode):  # exchanged in between
            self.close()
            raise InputError(field, str(path), allowed)
        self.path, self.size = path, status.st_size


def read_bytes(field: str, path: Path, most: int) -> bytes:
    """The content of a small file; InputError: no regular file, or more than `most` bytes."""
    with RegularFile(field, path) as file:
        if file.size > most:
            raise InputError(field, f"{path} of {file.size} bytes", f"at most {most} bytes")
        try:
            return file.read(most + 1)
        except OSError as error:
            raise InputError(field, str(path), "a readable file", reason(error)) from None


def read_text(field: str, path: Path, most: int) -> str:
    """The text of a small file; InputError: as `read_bytes`, or not UTF-8."""
    try:
        return read_bytes(field, path, most).decode()
    except UnicodeDecodeError as error:
        raise InputError(field, str(path), "a readable text in UTF-8", str(error)) from None


def replaced(file: Path, write: Callable[[Path], object], field: str = "output") -> None:
    """Write a file under a passing name, then put it in its place; the folder is made.

    A link in its place is replaced, what it points to is left alone. InputError, naming `field`,
    where no file can be there; FailedError where writing fails.
    """
    passing = file.with_name(f".{file.stem}.part{file.suffix}")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        passing.unlink(missing_ok=True)
        passing.touch(exist_ok=False)  # a new file: no link is followed
    except OSError as error:
        raise not_made(field, file, "a file in a folder that can be written to", error) from None
    try:
        write(passing)
        passing.replace(file)
    except OSError as error:
        raise FailedError(f"{file} cannot be written: {error.strerror or error}") from None
    finally:
        passing.unlink(missing_ok=True)


_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""What the system says of a disk, or a share of it, that is full."""


def not_made(
    field: str, path: Path, allowed: str, error: OSError | ValueError
) -> InputError | FailedError:
    """The error of a file or folder that cannot be made: of its name, unless the disk is full."""
    if isinstance(error, OSError) and error.errno in _FULL:
        return FailedError(f"{path} cannot be written: {reason(error)}")
    return InputError(field, str(path), allowed, f"{reason(error)}.")


def reason(error: OSError | ValueError) -> str:
    """Why a file cannot be used, as the system says it, without its number."""
    return (error.strerror if isinstance(error, OSError) else None) or str(error)

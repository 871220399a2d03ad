"""The lock that lets one run at a time write to a folder.

A worker of a cluster reads the token of the run there: it stores its parts only in the folder of
its own run.
"""

from __future__ import annotations

import fcntl
import os
import stat
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.regular_file import not_made

_AS_IT_IS = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
"""Open what stands there itself: no link is followed, no FIFO waited for."""
_TOKEN_LENGTH = 32


@contextmanager
def exclusive_lock(path: Path) -> Iterator[str]:
    """Hold the folder; InputError where another run, of this process or another one, holds it.

    The lock is on a hidden file beside the folder. The system drops it with the process, whatever
    ends that. Gives the token that this run writes into the file. (`filelock` follows links there,
    and leaves its file.)
    """
    lock = _lock_of(path)
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(lock, os.O_CREAT | os.O_RDWR | _AS_IT_IS, 0o666)
    except OSError as error:
        raise not_made("output", path, "a folder that can be written", error) from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            status = os.fstat(descriptor)
            held = status.st_nlink > 0  # else its last holder has just removed it
        except BlockingIOError:
            held = False
        if held and (not stat.S_ISREG(status.st_mode) or status.st_nlink > 1):
            hint = f"{lock} is none, or a file with another name. Remove it."
            raise InputError("output", str(path), "a lock that is a regular file", hint)
        if not held:
            hint = "Wait for that run to end, or choose another output."
            raise InputError("output", str(path), "a result that no other run is writing", hint)
        token = uuid.uuid4().hex
        try:
            os.ftruncate(descriptor, 0)
            os.write(descriptor, token.encode())
            yield token
        finally:
            lock.unlink(missing_ok=True)
    finally:
        os.close(descriptor)


def token_of(path: str) -> str:
    """The token of the run that holds a folder, '' where none does or the folder is not seen."""
    try:
        descriptor = os.open(_lock_of(Path(path)), os.O_RDONLY | _AS_IT_IS)
    except OSError:
        return ""
    try:
        return os.read(descriptor, _TOKEN_LENGTH + 1).decode("ascii", "replace")
    except OSError:  # a folder, a FIFO without data
        return ""
    finally:
        os.close(descriptor)


def _lock_of(path: Path) -> Path:
    return path.with_name(f".{path.name}.lock")

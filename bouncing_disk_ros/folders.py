"""Folders that a process may write to: compiled kernels, logs, matplotlib's settings.

Each in its usual place; else in the XDG one; else in a private temporary one.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import tempfile
import warnings
from collections.abc import Iterator
from pathlib import Path

from bouncing_disk_ros.errors import InputError

PACKAGE = "bouncing_disk_ros"


def home() -> Path | None:
    """Return the folder that HOME names, or None if it names none."""
    return Path(os.environ["HOME"]) if os.environ.get("HOME") else None


def made_writable(folder: Path) -> bool:
    """Return whether files can be made in `folder`, which is created if need be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def base_folders(variable: str, under_home: str) -> Iterator[Path]:
    """Yield where to try: the XDG folder of `variable`, else the one under HOME; a temporary one.

    The temporary folder has a name that others can foresee, and numba unpickles what it finds in
    its cache: it counts only if it belongs to this user and is closed to all others.
    """
    if os.environ.get(variable):
        yield Path(os.environ[variable]) / PACKAGE
    elif (at_home := home()) is not None:
        yield at_home / under_home / PACKAGE
    try:
        private = Path(tempfile.gettempdir()) / f"{PACKAGE}-{os.getuid()}"
        private.mkdir(mode=0o700, exist_ok=True)
        status = private.lstat()
    except OSError:
        return
    if status.st_uid == os.getuid() and status.st_mode & 0o170077 == 0o040000:
        yield private


def core_digest() -> str:
    """Return a digest of the core's sources; numba itself misses edits in a function's callees."""
    digest = hashlib.sha256()
    folder = Path(__file__).parent / "core"
    for file in sorted(folder.rglob("*.py")):
        digest.update(str(file.relative_to(folder)).encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def numba_cache_directory() -> Path | None:
    """Return the folder for numba's compiled kernels of these very sources; None: none can be made.

    In $XDG_CACHE_HOME, else ~/.cache, else a folder of this user among the temporary ones.
    """
    for base in base_folders("XDG_CACHE_HOME", ".cache"):
        if made_writable(folder := base / f"numba-{core_digest()}"):
            return folder
    return None


def use_numba_cache() -> None:
    """Set NUMBA_CACHE_DIR unless it is set. Warn once if kernels must be compiled at each start."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return
    folder = numba_cache_directory()
    if folder is None:
        warnings.warn(
            "no folder for compiled kernels can be written: every start compiles them anew. "
            "Set NUMBA_CACHE_DIR to a folder that can",
            RuntimeWarning,
            stacklevel=2,
        )
        folder = passing_folder()
    if folder is not None:
        os.environ["NUMBA_CACHE_DIR"] = str(folder)


def passing_folder() -> Path | None:
    """Return a new folder that is deleted when this process ends; None: none can be made."""
    for place in (None, "/dev/shm"):  # noqa: S108 (mkdtemp makes a private one)
        try:
            folder = tempfile.mkdtemp(prefix=f"{PACKAGE}-", dir=place)
        except OSError:
            continue
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        return Path(folder)
    return None


def use_log_folder() -> None:
    """Set ROS_LOG_DIR where rclpy would fail: it, ROS_HOME and HOME name no usable folder."""
    at_home = home()
    if os.environ.get("ROS_LOG_DIR"):
        wanted: Path | None = Path(os.environ["ROS_LOG_DIR"])
    elif os.environ.get("ROS_HOME"):
        wanted = Path(os.environ["ROS_HOME"]) / "log"
    else:
        wanted = at_home / ".ros" / "log" if at_home else None
    if wanted is not None and made_writable(wanted):
        return
    for base in base_folders("XDG_STATE_HOME", ".local/state"):
        if made_writable(folder := base / "log"):
            os.environ["ROS_LOG_DIR"] = str(folder)
            return
    raise InputError(
        "ROS_LOG_DIR",
        wanted or "nothing, and no HOME",
        "a folder that can be written",
        "Set ROS_LOG_DIR to one",
    )


def use_matplotlib_folder() -> None:
    """Set MPLCONFIGDIR where matplotlib would complain: HOME missing or not writable."""
    at_home = home()
    if os.environ.get("MPLCONFIGDIR") or (at_home and os.access(at_home, os.W_OK | os.X_OK)):
        return
    for base in base_folders("XDG_CONFIG_HOME", ".config"):
        if made_writable(folder := base / "matplotlib"):
            os.environ["MPLCONFIGDIR"] = str(folder)
            return

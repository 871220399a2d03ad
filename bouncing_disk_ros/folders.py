"""Folders: the package's own files, and those that a process may write to.

What is written, logs and matplotlib's settings, goes to its usual place; else to the XDG one; else
to a private temporary one.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from bouncing_disk_ros.errors import InputError

PACKAGE = "bouncing_disk_ros"
_OTHERS_WRITE = 0o022
INDEX = "share/ament_index/resource_index"


# the package's own files --------------------------------------------------------------------------


def prefixes() -> list[Path]:
    """Return the prefixes that AMENT_PREFIX_PATH names."""
    return [
        Path(part) for part in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if part
    ]


def use_package_index() -> None:
    """Add to AMENT_PREFIX_PATH the prefix that this package is installed in, if it is missing."""
    marker = Path(INDEX, "packages", PACKAGE)
    if any((prefix / marker).is_file() for prefix in prefixes()):
        return
    for prefix in (*Path(__file__).resolve().parents, Path(sys.prefix)):
        if (prefix / marker).is_file():
            known = [str(path) for path in prefixes()]
            os.environ["AMENT_PREFIX_PATH"] = os.pathsep.join([*known, str(prefix)])
            return


def share_directory() -> Path:
    """The folder that holds config/: the source tree when run from it, else share/ of a prefix."""
    source = Path(__file__).resolve().parents[1]
    if (source / "package.xml").is_file() and (source / "config").is_dir():
        return source
    use_package_index()
    for prefix in prefixes():
        share = prefix / "share" / PACKAGE
        if (share / "config").is_dir():
            return share
    hint = "Is the package installed with its share files (pip install . or colcon build)?"
    raise InputError("preset", "a name", "the path of a file: no share folder is found", hint)


# what may be written ------------------------------------------------------------------------------


def home() -> Path | None:
    """Return the folder that HOME names, or None if it names none."""
    return Path(os.environ["HOME"]) if os.environ.get("HOME") else None


def user_path(text: str | Path) -> Path:
    """Return a path, `~` being the home folder; a name such as ~draft.csv is that of a file."""
    return Path(os.path.expanduser(text))  # noqa: PTH111 (that of pathlib fails for such a name)


def made_writable(folder: Path) -> bool:
    """Return whether files can be made in `folder`, which is created if need be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def made_private(folder: Path) -> bool:
    """Whether files can be made in `folder`, and nobody else can have put any there.

    It is created for this user alone. A folder of another user, one that others may write to, and a
    link are refused. (The folder above it is closed to the group: many a umask leaves it open.)
    """
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        above = folder.parent.stat()
        if above.st_uid == os.getuid() and above.st_mode & _OTHERS_WRITE:
            folder.parent.chmod(above.st_mode & 0o755)
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return False
    ours = above.st_uid == status.st_uid == os.getuid() and stat.S_ISDIR(status.st_mode)
    return ours and not status.st_mode & _OTHERS_WRITE and made_writable(folder)


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

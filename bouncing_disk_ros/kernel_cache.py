"""The folder of compiled kernels: one for each version of their sources, old ones deleted.

A folder is named by a digest of the kernels' sources: numba itself misses edits in what a kernel
calls. Each process sets the time of last use of the one that it uses. Folders of other versions
that nobody has begun to use for `UNUSED_DAYS` are removed.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import re
import shutil
import sys
import tempfile
import time
import warnings
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from bouncing_disk_ros.folders import PACKAGE, base_folders, made_private

KERNEL_FOLDERS = ("core", "maps", "motor_study", "juggling/kernels", "measured/kernels")
"""The folders that hold all compiled functions."""
UNUSED_DAYS = 30
_UNUSED = ("scipy.linalg.cython_blas", "cffi", "coverage")
"""Modules that numba imports where they are installed, and no kernel uses."""
_NAME = re.compile(r"numba-[0-9a-f]{16}")


def kernel_digest() -> str:
    """Return a digest of all files in KERNEL_FOLDERS, and of the layout of a row of impacts.

    Whatever a kernel imports is among them: numba freezes it into machine code.
    """
    package = Path(__file__).parent
    files = [file for name in KERNEL_FOLDERS for file in (package / name).rglob("*.py")]
    digest = hashlib.sha256()
    for file in sorted([*files, *package.glob("impact_layout.py")]):
        name = str(file.relative_to(package))
        digest.update(name.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def numba_cache_directory() -> Path | None:
    """Return the folder for numba's compiled kernels of these very sources; None: none can be made.

    In $XDG_CACHE_HOME, else ~/.cache, else a folder of this user among the temporary ones. numba
    runs what it finds there: a folder that others own or may write to is passed over.
    """
    for base in base_folders("XDG_CACHE_HOME", ".cache"):
        if made_private(folder := base / f"numba-{kernel_digest()}"):
            return folder
    return None


def use_numba_cache() -> None:
    """Set NUMBA_CACHE_DIR unless it is set. Warn once if kernels must be compiled at each start."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return  # the user's folder, or the folder of the process that started this one
    folder = numba_cache_directory()
    if folder is None:
        warnings.warn(
            "no folder for compiled kernels can be written: every start compiles them again. "
            "Set NUMBA_CACHE_DIR to a folder that can be written",
            RuntimeWarning,
            stacklevel=2,
        )
        folder = passing_folder()
    else:
        with suppress(OSError):
            os.utime(folder)
        forget_unused(folder)
    if folder is not None:
        os.environ["NUMBA_CACHE_DIR"] = str(folder)


def announce_compilation(name: str, *, own_process: bool = True) -> None:
    """Say on stderr, as executable `name`, which kernels are compiled: a start waits for them.

    One line with the name of the first; on a terminal a bar that names each. Loading a compiled
    kernel is no compilation. Imports numba, but none of the kernels.
    `own_process`: no code but this package's runs here.
    """
    if own_process:
        load_numba_alone()
    from numba.core import event

    class Announcement(event.Listener):
        """Tells of the kernels that are compiled for themselves, not of those within them."""

        def __init__(self) -> None:
            self._depth = self._count = 0
            self._bar: Any = None

        def on_start(self, begun: Any) -> None:
            self._depth += 1
            if self._depth == 1:
                self._show(begun.data["dispatcher"].py_func)

        def on_end(self, _event: object) -> None:
            self._depth -= 1
            if self._depth == 0:
                self._count += 1
                self._bar.close()  # its line is free again for the bar of a study

        def _show(self, function: Any) -> None:
            from tqdm import tqdm

            kernel = f"{function.__module__.removeprefix(f'{PACKAGE}.')}.{function.__name__}"
            what = f"{name}: compiling kernels, each once on this machine"
            if self._count == 0:
                print(f"{what}; first {kernel}", file=sys.stderr, flush=True)
            self._bar = tqdm(
                desc=name, initial=self._count, unit=" kernels", leave=False, disable=None
            )
            self._bar.set_postfix_str(kernel)

    event.register("numba:compile", Announcement())


def load_numba_alone() -> None:
    """Load numba without SciPy's BLAS, cffi and coverage, which takes 0.3 s less.

    Compiled functions of this process cannot use numpy.linalg or cffi afterwards: not for a user's
    process.
    """
    unused = [name for name in _UNUSED if name not in sys.modules]
    for name in unused:
        sys.modules[name] = None  # type: ignore[assignment] # an import of it fails at once
    try:
        from numba.core.typing import cffi_utils  # noqa: F401
        from numba.np import arraymath  # noqa: F401
    finally:
        for name in unused:
            del sys.modules[name]


def forget_unused(own: Path) -> None:
    """Remove the folders of other versions beside `own` that nobody began to use for UNUSED_DAYS.

    A process that runs longer loses nothing: numba compiles again what it does not find.
    """
    oldest = time.time() - UNUSED_DAYS * 86400
    with suppress(OSError):
        for folder in own.parent.iterdir():
            if folder != own and _NAME.fullmatch(folder.name) and not folder.is_symlink():
                with suppress(OSError):  # removed by another one, not ours
                    if folder.stat().st_mtime < oldest:
                        shutil.rmtree(folder)


def forget_kernel(index: str) -> None:
    """Remove the index of a stored kernel, which then gets another one: its files are damaged."""
    Path(index).unlink(missing_ok=True)


@cache
def warn_of_storing(reason: str) -> None:
    """Warn once, whatever numba has done to the filters of warnings since."""
    folder = os.environ.get("NUMBA_CACHE_DIR", "their folder")
    text = (
        f"compiled kernels cannot be stored in {folder}: {reason}. Every start compiles them "
        "again. Set NUMBA_CACHE_DIR to another folder"
    )
    warnings.warn(text, RuntimeWarning, stacklevel=2)


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


def share_compiled_kernels() -> bool:
    """Let all installations with the same sources share compiled kernels, from now on.

    numba files them by the folder of the source, so that each colcon build, virtual environment and
    clone would compile for itself. Our folder is named by the digest of the sources: within it the
    place in the package is enough. False where this numba has other classes for it.
    """
    from numba.core import caching, config

    # where numba was imported first, it has not read the folder
    config.CACHE_DIR = config.CACHE_DIR or os.environ.get("NUMBA_CACHE_DIR", "")
    implementation = getattr(caching, "CacheImpl", None) or getattr(caching, "_CacheImpl", None)
    standard = getattr(caching, "UserProvidedCacheLocator", None) or getattr(
        caching, "_UserProvidedCacheLocator", None
    )
    classes = getattr(implementation, "_locator_classes", None)
    if standard is None or classes is None:
        return False
    if not any(found.__name__ == "SharedLocator" for found in classes):
        classes.insert(0, _locator_class(standard))
    return True


def _locator_class(standard: Any) -> Any:
    """Make the class that tells numba where a kernel of this package lies from numba's own."""
    from numba import config

    package = Path(__file__).resolve().parent

    class SharedLocator(standard):
        """For sources of this package, where the cache's folder is named by their digest."""

        @classmethod
        def get_suitable_cache_subpath(cls, py_file: str) -> str:
            """Return the source's folder within the package."""
            return str(Path(py_file).resolve().parent.relative_to(package.parent))

        def get_source_stamp(self) -> str:
            """Return nothing: the digest in the folder's name stands for the source."""
            return ""

        @classmethod
        def from_function(cls, py_func: Any, py_file: str) -> Any:
            """Return a locator, or None for what is not ours: numba's own follow."""
            ours = Path(py_file).resolve().is_relative_to(package)
            if not ours or not _NAME.fullmatch(Path(config.CACHE_DIR or "/").name):
                return None
            return super().from_function(py_func, py_file)

    return SharedLocator

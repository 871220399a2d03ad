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
import subprocess
import sys
import tempfile
import time
import warnings
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from bouncing_disk_ros.folders import PACKAGE, base_folders, made_private

KERNEL_FOLDERS = ("core", "maps", "motor_study", "juggling/kernels", "measured/kernels")
"""The folders that hold all compiled functions."""
UNUSED_DAYS = 30
Shares = tuple[tuple[str, ...], ...]
"""Modules whose kernels are compiled side by side, each share by one process: when the module is
imported, or by a function of it (module:function). Shares take about the same time; modules that
call the same inner functions are in one share, because each process compiles these anew."""
_PHYSICS: tuple[Shares, ...] = (
    (
        ("core.next_event",),
        ("core.event_store", "core.resolve_event", "core.input_kernels"),
    ),
    (("core.stepper",),),  # calls what the first two have compiled
)
_OFFSETS: tuple[Shares, ...] = (
    (("core.offset_kernels:searches",), ("core.offset_kernels:inputs", "core.offset_extremes")),
    (("core.offset_kernels:everything",),),
)
_STUDIES: Shares = (
    (
        "maps.lanes.attractor_lanes",
        "maps.single_toss",
        "juggling.kernels.loop_kernel",
    ),
    (
        "maps.lanes.basin_kernel",
        "maps.rotation_map",
        "maps.map_tangent",
        "maps.axial_flights",
        "motor_study.motor_cell",
    ),
)
_UNUSED = ("scipy.linalg.cython_blas", "cffi", "coverage")
"""Modules that numba imports where they are installed, and no kernel uses."""
_NAME = re.compile(r"numba-[0-9a-f]{16}")


def kernel_digest() -> str:
    """Return a digest of the kernels' sources."""
    digest = hashlib.sha256()
    for name, source in kernel_sources().items():
        digest.update(name.encode() + b"\0" + source + b"\0")
    return digest.hexdigest()[:16]


def kernel_sources() -> dict[str, bytes]:
    """Modules with compiled functions and all that they import from KERNEL_FOLDERS: name -> source.

    `name`: the path of the file in the package. The layout of a row of impacts counts too. Files
    beside them, such as those that draw or print, do not: to change one of them compiles nothing
    anew.
    """
    package = Path(__file__).parent
    files = [file for name in KERNEL_FOLDERS for file in sorted((package / name).rglob("*.py"))]
    files += package.glob("impact_layout.py")
    sources = {str(file.relative_to(package)): file.read_bytes() for file in files}
    waiting = [name for name, text in sources.items() if b".core.arithmetic import" in text]
    needed: set[str] = set()
    while waiting:
        needed.add(name := waiting.pop())
        for found in re.findall(rb"from bouncing_disk_ros\.([\w.]+) import", sources[name]):
            target = found.decode().replace(".", "/") + ".py"
            if target in sources and target not in needed:
                waiting.append(target)
    return {name: sources[name] for name in sorted(needed)}


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


def compile_kernels(*, studies: bool = False) -> None:
    """Compile the simulator's kernels into the cache if it lacks them, in two processes; say so.

    `studies`: those of the studies too. What fails here is compiled again, and raises its error,
    where it is imported.
    """
    _compile("the physics", "some 10 s", *_PHYSICS)
    if studies:
        compile_offset_kernels()
        _compile("the maps of the studies", "about a minute", _STUDIES)


def compile_offset_kernels() -> None:
    """The same for the kernels that only motions with an offset need."""
    if os.environ.get("NUMBA_CACHE_DIR"):  # else nothing that a process compiles lasts
        _compile("the physics of trajectories", "some 12 s", *_OFFSETS)


def _compile(what: str, time: str, *steps: Shares) -> None:
    """Compile the shares of each step, side by side, step after step, unless that has been done."""
    from importlib.metadata import version

    folder = Path(os.environ.get("NUMBA_CACHE_DIR", "."))
    place = "" if _NAME.fullmatch(folder.name) else Path(__file__).parent  # see below
    versions = f"{sys.version} {version('numba')} {place} {what}"
    marker = folder / f"compiled-{hashlib.sha256(versions.encode()).hexdigest()[:16]}"
    if marker.is_file():
        return
    line = f"bouncing_disk_ros: compiling {what} once for this machine, {time} on two cores"
    print(line, file=sys.stderr, flush=True)
    with ExitStack() as ending, suppress(OSError):  # of a process that has ended; of the marker
        processes = [ending.enter_context(_compiler()) for _ in range(max(map(len, steps)))]
        if all(_compiled(list(zip(processes, shares, strict=False))) for shares in steps):
            marker.touch()  # if it fails, the line is said again, and all found compiled


def _compiled(work: list[tuple[subprocess.Popen[bytes], tuple[str, ...]]]) -> bool:
    """Let each process compile its modules; whether all have."""
    for process, modules in work:
        assert process.stdin is not None
        process.stdin.write(" ".join(modules).encode() + b"\n")
    replies = [process.stdout.readline() for process, _ in work if process.stdout is not None]
    return all(replies)


def _compiler() -> subprocess.Popen[bytes]:
    """Start a process that compiles the modules of each line that it reads, then writes a line."""
    home = str(Path(__file__).parents[1])  # this copy: numba may file kernels by their place
    return subprocess.Popen(
        [sys.executable, "-P", "-c", _COMPILER, home],
        bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip


_COMPILER = """
import gc, importlib, os, signal, sys
signal.signal(signal.SIGINT, signal.SIG_DFL)  # no traceback at Ctrl-C
gc.disable()  # a tenth of the time goes into looks for cycles
sys.path.insert(0, sys.argv[1])
from bouncing_disk_ros.kernel_cache import load_numba_alone
load_numba_alone()
from bouncing_disk_ros.core.arithmetic import compile_parts
for line in sys.stdin:
    for module in line.split():
        module, _, function = module.partition(":")
        loaded = importlib.import_module(f"bouncing_disk_ros.{module}")
        if function:
            getattr(loaded, function)()
        compile_parts()
    print("compiled", flush=True)
os._exit(0)  # to free what has been compiled takes more than a second
"""


def share_compiled_kernels() -> bool:
    """Let all installations with the same sources share compiled kernels, from now on.

    numba files them by the folder of the source, so that each colcon build, virtual environment and
    clone would compile for itself. Our folder is named by the digest of the sources: within it the
    place in the package is enough. False where this numba has other classes for it.
    """
    from numba.core import caching

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

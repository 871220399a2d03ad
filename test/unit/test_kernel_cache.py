"""The folder of compiled kernels: where it is, and which old ones are removed."""

from __future__ import annotations

import os
import re
import resource
import shutil
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bouncing_disk_ros import kernel_cache
from support.checks import there
from support.places import private
from support.processes import finished


def test_kernels_are_cached_in_xdg_cache_home_or_under_home(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    folder = there(kernel_cache.numba_cache_directory())
    assert folder.is_dir()
    assert folder.parent == tmp_path / "home" / ".cache" / "bouncing_disk_ros"
    kernel_cache.use_numba_cache()
    assert os.environ["NUMBA_CACHE_DIR"] == str(folder)
    clean.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    kernel_cache.use_numba_cache()  # what is set stays
    assert os.environ["NUMBA_CACHE_DIR"] == str(folder)
    other = there(kernel_cache.numba_cache_directory())
    assert other.parent == tmp_path / "xdg" / "bouncing_disk_ros"


@pytest.mark.parametrize("home", ["unset", "unusable"])
def test_without_home_kernels_are_cached_in_a_private_temporary_folder(
    no_home: pytest.MonkeyPatch, tmp_path: Path, home: str
) -> None:
    if home == "unset":
        no_home.delenv("HOME")
    folder = there(kernel_cache.numba_cache_directory())
    assert folder.parent == private(tmp_path)
    assert stat.S_IMODE(private(tmp_path).stat().st_mode) == 0o700


@pytest.mark.parametrize("kind", ["link", "open to others", "file"])
def test_a_temporary_folder_that_others_prepared_is_not_trusted(
    no_home: pytest.MonkeyPatch, tmp_path: Path, kind: str
) -> None:
    place = private(tmp_path)
    if kind == "link":
        (tmp_path / "elsewhere").mkdir(mode=0o700)
        place.symlink_to(tmp_path / "elsewhere")
    elif kind == "file":
        place.touch(mode=0o700)
    else:
        place.mkdir()
        place.chmod(0o777)
    assert kernel_cache.numba_cache_directory() is None


@pytest.mark.parametrize("kind", ["open to others", "open to the group", "link", "of another"])
def test_a_folder_that_others_own_or_may_write_to_is_passed_over(
    clean: pytest.MonkeyPatch, tmp_path: Path, kind: str
) -> None:
    """numba runs what it finds there."""
    first = there(kernel_cache.numba_cache_directory())
    if kind == "of another":
        getuid = os.getuid
        clean.setattr(os, "getuid", lambda: getuid() + 1)
    elif kind == "link":
        first.rename(tmp_path / "elsewhere")
        first.symlink_to(tmp_path / "elsewhere")
    else:
        first.chmod(0o777 if kind == "open to others" else 0o775)
    assert kernel_cache.numba_cache_directory() != first


def test_folders_for_kernels_are_closed_to_others(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Whatever the umask; the one above, of an earlier version, is closed to the group."""
    above = tmp_path / "home" / ".cache" / "bouncing_disk_ros"
    above.mkdir(parents=True)
    above.chmod(0o775)
    before = os.umask(0)
    try:
        found = kernel_cache.numba_cache_directory()
    finally:
        os.umask(before)
    assert found is not None
    assert found.parent == above
    assert [stat.S_IMODE(one.stat().st_mode) for one in (above, found)] == [0o755, 0o700]


def test_without_any_lasting_folder_one_warning_and_a_passing_one(
    no_home: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    private(tmp_path).touch()
    with pytest.warns(RuntimeWarning, match="Set NUMBA_CACHE_DIR") as caught:
        kernel_cache.use_numba_cache()
    assert len(caught) == 1
    kernel_cache.use_numba_cache()  # a second warning would be an error
    assert Path(os.environ["NUMBA_CACHE_DIR"]).is_dir()


@pytest.mark.parametrize("name", kernel_cache.KERNEL_FOLDERS)
def test_digest_changes_with_any_file_of_the_kernels(
    name: str, clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    core = tmp_path / name
    core.mkdir(parents=True)
    clean.setattr(kernel_cache, "__file__", str(tmp_path / "kernel_cache.py"))
    seen = {kernel_cache.kernel_digest()}
    (core / "a.py").write_text("x = 1")
    seen.add(kernel_cache.kernel_digest())
    (core / "a.py").write_text("x = 2")
    seen.add(kernel_cache.kernel_digest())
    (core / "a.py").rename(core / "b.py")
    seen.add(kernel_cache.kernel_digest())
    assert len(seen) == 4
    (core / "notes.txt").touch()
    assert kernel_cache.kernel_digest() in seen


LONG_AGO = 1.0e9  # seconds since 1970: in 2001


def old_folder(base: Path, name: str = "numba-0123456789abcdef") -> Path:
    """A folder of kernels that was last used long ago."""
    folder = base / name
    (folder / "core_1").mkdir(parents=True)
    (folder / "core_1" / "kernel.nbi").write_bytes(b"x")
    os.utime(folder, (LONG_AGO, LONG_AGO))
    return folder


def test_only_kernels_of_other_versions_that_are_long_unused_are_removed(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    base = tmp_path / "home" / ".cache" / "bouncing_disk_ros"
    others = [old_folder(base, f"numba-{number:016x}") for number in range(3)]
    recent = time.time() - (kernel_cache.UNUSED_DAYS - 1) * 86400.0
    os.utime(others[1], (recent, recent))
    names = ("numba-mine", "numba-0123456789ABCDEF", "log", "numba-")
    foreign = [old_folder(base, name) for name in names]
    (base / "numba-fedcba9876543210").symlink_to(old_folder(tmp_path / "elsewhere"))
    own = old_folder(base, f"numba-{kernel_cache.kernel_digest()}")
    before = time.time()
    kernel_cache.use_numba_cache()
    assert [one.exists() for one in others] == [False, True, False]
    assert all(one.is_dir() for one in foreign)
    assert (tmp_path / "elsewhere" / "numba-0123456789abcdef" / "core_1").is_dir()
    assert (own / "core_1" / "kernel.nbi").is_file()
    assert own.stat().st_mtime >= before - 1.0  # used now; the file system's clock is coarser
    earlier = recent - 2 * 86400.0
    os.utime(others[1], (earlier, earlier))
    kernel_cache.forget_unused(own)
    assert not others[1].exists()


def test_all_compiled_functions_and_what_they_import_are_in_the_folders_of_the_digest() -> None:
    package = Path(kernel_cache.__file__).parent
    folders = kernel_cache.KERNEL_FOLDERS
    no_numbers = {"errors", "field_checks", "kernel_cache"}  # nothing that a kernel could hold
    compiled = set()
    for file in package.rglob("*.py"):
        text = file.read_text("utf-8")
        if re.search(r"(from|import) numba|^@(entry|kernel|rare_kernel)\b", text, re.MULTILINE):
            compiled.add(str(file.relative_to(package)))
            if file.parent != package:
                names = re.findall(r"^from bouncing_disk_ros\.(\S+)", text, re.MULTILINE)
                places = {f"{name.replace('.', '/')}/" for name in names if name not in no_numbers}
                assert all(one.startswith(tuple(f"{f}/" for f in folders)) for one in places), file
    others = {file for file in compiled if not file.startswith(tuple(f"{one}/" for one in folders))}
    assert others == {"kernel_cache.py"}
    assert all(any(file.startswith(f"{one}/") for file in compiled) for one in folders)


def test_kernels_are_compiled_and_announced_once_for_all_installations_of_the_same_sources(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """One line for all that are compiled, none for those that are loaded; BLAS is not loaded."""
    clean.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    clean.delenv("NUMBA_CACHE_DIR", raising=False)
    program = tmp_path / "two_kernels.py"
    program.write_text(
        "from bouncing_disk_ros import kernel_cache\n"  # sets the folder
        "kernel_cache.announce_compilation('tool')\n"
        "from numba import float64\n"
        "from numba.core import event\n"
        "with event.install_recorder('numba:compile') as found:\n"
        "    from bouncing_disk_ros.core import arithmetic, compilation\n"
        "    @compilation.entry(float64(float64))\n"
        "    def one_more(x): return x + 1.0\n"
        "print(len(found.buffer), arithmetic.__file__)\n"
        "import importlib.util, sys\n"
        "assert all(map(importlib.util.find_spec, ('scipy', 'coverage')))\n"
        "unused = {'scipy.linalg', 'scipy.linalg.cython_blas', 'cffi', 'coverage'}\n"
        "assert not unused & set(sys.modules)"
    )
    found = []
    for place in ("first", "second"):
        shutil.copytree(Path(kernel_cache.__file__).parent, tmp_path / place / "bouncing_disk_ros")
        env = {"PYTHONPATH": str(tmp_path / place)}
        done = finished(sys.executable, program, env=env, cwd=tmp_path / place)
        compiled, file = done.stdout.split()
        assert Path(file).is_relative_to(tmp_path / place)
        found.append((int(compiled), done.stderr))
    (compiled_first, told), *others = found
    assert compiled_first >= 4, "start and end of two compilations"
    kernel = "core.arithmetic.sine_and_cosine"
    assert told == f"tool: compiling kernels, each once on this machine; first {kernel}\n"
    assert others == [(0, "")]


def test_kernels_are_filed_by_their_sources_where_numba_was_imported_first(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Beside its source numba would file a kernel without regard to what it calls."""
    clean.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    clean.delenv("NUMBA_CACHE_DIR", raising=False)
    program = (
        "import numba\n"
        "from bouncing_disk_ros.core.arithmetic import sine_and_cosine\n"
        "print(sine_and_cosine._cache.cache_path)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(Path(kernel_cache.__file__).parents[1])},
    )  # fmt: skip
    folder = there(kernel_cache.numba_cache_directory())
    assert done.stdout.strip() == str(folder / "bouncing_disk_ros" / "core")


ONE_KERNEL = """\
from bouncing_disk_ros import kernel_cache
kernel_cache.announce_compilation("tool")
from numba import float64
from bouncing_disk_ros.core.compilation import entry
@entry(float64(float64))
def one_more(x): return x + 1.0
assert one_more(1.0) == 2.0
"""


def run_one_kernel(folder: Path, largest: int = resource.RLIM_INFINITY) -> list[str]:
    """Lines of stderr of a process that runs a kernel and writes files of `largest` bytes."""
    program = folder / "one_kernel.py"
    program.write_text(ONE_KERNEL)
    done = subprocess.run(
        [sys.executable, str(program)], capture_output=True, text=True, check=True,
        env={**os.environ, "XDG_CACHE_HOME": str(folder / "cache")},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest, largest)),
    )  # fmt: skip
    return done.stderr.splitlines()


COMPILED = "tool: compiling kernels, each once on this machine; first "


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_a_damaged_file_of_a_kernel_is_replaced(
    clean: pytest.MonkeyPatch, tmp_path: Path, kind: str
) -> None:
    """After a loss of power a file may be empty, cut or hold zeros."""
    run_one_kernel(tmp_path)
    (file,) = tmp_path.rglob(f"*one_more*.{kind}")
    whole = file.read_bytes()
    for damaged in (b"", whole[: len(whole) // 2], bytes(len(whole))):
        file.write_bytes(damaged)
        assert [line.startswith(COMPILED) for line in run_one_kernel(tmp_path)] == [True]
        assert run_one_kernel(tmp_path) == []


def test_a_full_disk_of_kernels_is_one_warning(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    compiled, warning, _source = run_one_kernel(tmp_path, largest=100)
    assert compiled.startswith(COMPILED)
    folder = there(kernel_cache.numba_cache_directory()).name
    assert re.search(f"RuntimeWarning: compiled kernels cannot be stored in .*{folder}: ", warning)

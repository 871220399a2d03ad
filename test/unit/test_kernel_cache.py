"""The folder of compiled kernels: where it is, and which old ones are removed."""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
import stat
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from bouncing_disk_ros import kernel_cache
from support.places import private


def test_kernels_are_cached_under_home(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    folder = kernel_cache.numba_cache_directory()
    assert folder is not None
    assert folder.is_dir()
    assert folder.parent == tmp_path / "home" / ".cache" / "bouncing_disk_ros"
    kernel_cache.use_numba_cache()
    assert os.environ["NUMBA_CACHE_DIR"] == str(folder)


def test_xdg_cache_home_goes_before_home(clean: pytest.MonkeyPatch, tmp_path: Path) -> None:
    clean.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    folder = kernel_cache.numba_cache_directory()
    assert folder is not None
    assert folder.parent == tmp_path / "xdg" / "bouncing_disk_ros"


@pytest.mark.parametrize("home", ["unset", "unusable"])
def test_without_home_kernels_are_cached_in_a_private_temporary_folder(
    no_home: pytest.MonkeyPatch, tmp_path: Path, home: str
) -> None:
    if home == "unset":
        no_home.delenv("HOME")
    folder = kernel_cache.numba_cache_directory()
    assert folder is not None
    assert folder.parent == private(tmp_path)
    assert stat.S_IMODE(private(tmp_path).stat().st_mode) == 0o700


@pytest.mark.parametrize("kind", ["link", "open to others", "file"])
def test_a_temporary_folder_that_others_prepared_is_not_trusted(
    no_home: pytest.MonkeyPatch, tmp_path: Path, kind: str
) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    place = private(tmp_path)
    if kind == "link":
        place.symlink_to(elsewhere)
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
    first = kernel_cache.numba_cache_directory()
    assert first is not None
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


def test_with_no_folder_at_all_numba_is_left_to_itself(
    no_home: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    no_home.setattr(kernel_cache, "passing_folder", lambda: None)
    private(tmp_path).touch()
    with pytest.warns(RuntimeWarning):
        kernel_cache.use_numba_cache()
    assert "NUMBA_CACHE_DIR" not in os.environ


def test_passing_folder_is_none_where_nothing_can_be_made(clean: pytest.MonkeyPatch) -> None:
    def refuse(**_: object) -> str:
        raise OSError

    clean.setattr(tempfile, "mkdtemp", refuse)
    assert kernel_cache.passing_folder() is None


def test_the_users_cache_folder_stays(clean: pytest.MonkeyPatch) -> None:
    clean.setenv("NUMBA_CACHE_DIR", "/some/where")
    kernel_cache.use_numba_cache()
    assert os.environ["NUMBA_CACHE_DIR"] == "/some/where"


KERNEL = "from bouncing_disk_ros.core.arithmetic import kernel"


@pytest.mark.parametrize("name", kernel_cache.KERNEL_FOLDERS)
def test_digest_changes_with_any_file_of_the_kernels(
    name: str, clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    core = tmp_path / name
    core.mkdir(parents=True)
    clean.setattr(kernel_cache, "__file__", str(tmp_path / "kernel_cache.py"))
    seen = {kernel_cache.kernel_digest()}
    (core / "a.py").write_text(f"{KERNEL}\nx = 1")
    seen.add(kernel_cache.kernel_digest())
    (core / "a.py").write_text(f"{KERNEL}\nx = 2")
    seen.add(kernel_cache.kernel_digest())
    (core / "a.py").rename(core / "b.py")
    seen.add(kernel_cache.kernel_digest())
    assert len(seen) == 4
    (core / "notes.txt").touch()
    (core / "picture.py").write_text("x = 1")  # no kernel
    assert kernel_cache.kernel_digest() in seen


# old ones

LONG_AGO = 1.0e9  # seconds since 1970: in 2001


def old_folder(base: Path, name: str = "numba-0123456789abcdef") -> Path:
    """A folder of kernels that was last used long ago."""
    folder = base / name
    (folder / "core_1").mkdir(parents=True)
    (folder / "core_1" / "kernel.nbi").write_bytes(b"x")
    os.utime(folder, (LONG_AGO, LONG_AGO))
    return folder


@pytest.fixture
def base(clean: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    return tmp_path / "home" / ".cache" / "bouncing_disk_ros"


def test_old_kernels_of_other_versions_are_removed(base: Path) -> None:
    old = old_folder(base)
    kernel_cache.use_numba_cache()
    assert not old.exists()
    assert Path(os.environ["NUMBA_CACHE_DIR"]).is_dir()


def test_kernels_used_within_the_month_stay(base: Path) -> None:
    recent = old_folder(base)
    day = 86400.0
    used = time.time() - (kernel_cache.UNUSED_DAYS - 1) * day
    os.utime(recent, (used, used))
    kernel_cache.use_numba_cache()
    assert (recent / "core_1" / "kernel.nbi").is_file()
    os.utime(recent, (used - 2 * day, used - 2 * day))
    kernel_cache.forget_unused(base / "numba-")
    assert not recent.exists()


def test_the_own_kernels_stay_however_old_and_count_as_used_now(base: Path) -> None:
    own = old_folder(base, f"numba-{kernel_cache.kernel_digest()}")
    before = time.time()
    kernel_cache.use_numba_cache()
    assert (own / "core_1" / "kernel.nbi").is_file()
    assert own.stat().st_mtime >= before - 1.0  # the file system's clock is coarser


@pytest.mark.parametrize("name", ["numba-mine", "numba-0123456789ABCDEF", "log", "numba-"])
def test_folders_of_other_names_stay(base: Path, name: str) -> None:
    other = old_folder(base, name)
    kernel_cache.use_numba_cache()
    assert other.is_dir()


def test_a_link_stays_with_what_it_leads_to(base: Path, tmp_path: Path) -> None:
    target = old_folder(tmp_path / "elsewhere")
    base.mkdir(parents=True)
    (base / target.name).symlink_to(target)
    kernel_cache.use_numba_cache()
    assert (target / "core_1").is_dir()


_HOLDER = """
import sys
from pathlib import Path
from bouncing_disk_ros import kernel_cache
folder = Path(sys.argv[1])
kernel_cache.hold(folder)
print("held", flush=True)
sys.stdin.readline()
"""


def test_kernels_that_another_process_uses_stay_until_it_ends(base: Path) -> None:
    """A run of more than a month, of a version that nobody has started since."""
    old = old_folder(base)
    with subprocess.Popen(
        [sys.executable, "-c", _HOLDER, str(old)],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env=os.environ | {"NUMBA_CACHE_DIR": str(base)},
    ) as holder:  # fmt: skip
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        os.utime(old, (LONG_AGO, LONG_AGO))
        kernel_cache.forget_unused(base / "numba-")
        assert (old / "core_1" / "kernel.nbi").is_file()
        holder.communicate("\n")
    assert holder.returncode == 0
    kernel_cache.forget_unused(base / "numba-")
    assert not old.exists()


def test_who_begins_to_use_a_folder_while_it_is_removed_gets_a_new_one(
    base: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process opens the old folder, waits for the one that removes it, and makes it anew."""
    old = old_folder(base)
    lock = fcntl.flock
    waits: list[int] = []

    def flock(descriptor: int, how: int) -> None:
        if how == fcntl.LOCK_SH and not waits:
            waits.append(how)
            kernel_cache.forget_unused(base / "numba-")
            assert not old.exists()
        lock(descriptor, how)

    monkeypatch.setattr(fcntl, "flock", flock)
    kernel_cache.hold(old)
    assert waits
    assert list(old.iterdir()) == []
    os.utime(old, (LONG_AGO, LONG_AGO))
    kernel_cache.forget_unused(base / "numba-")
    assert old.is_dir()


def test_two_that_remove_at_once_disturb_nobody(base: Path) -> None:
    folders = [old_folder(base, f"numba-{number:016x}") for number in range(40)]
    code = (
        "import sys; from pathlib import Path; from bouncing_disk_ros import kernel_cache\n"
        "sys.stdin.readline(); kernel_cache.forget_unused(Path(sys.argv[1]))"
    )
    processes = [
        subprocess.Popen([sys.executable, "-c", code, str(base / "numba-")], stdin=subprocess.PIPE,
                         env=os.environ | {"NUMBA_CACHE_DIR": str(base)})
        for _ in range(2)
    ]  # fmt: skip
    for process in processes:
        process.communicate(b"\n")
    assert [process.returncode for process in processes] == [0, 0]
    assert not [folder for folder in folders if folder.exists()]


def test_without_locks_the_kernels_are_used_all_the_same(
    base: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: int, how: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refuse)
    old = old_folder(base)
    kernel_cache.use_numba_cache()
    assert Path(os.environ["NUMBA_CACHE_DIR"]).parent == base
    assert old.is_dir()  # nobody can know whether it is in use


def test_all_compiled_functions_are_in_the_folders_of_the_digest() -> None:
    package = Path(kernel_cache.__file__).parent
    compiled = {
        str(file.relative_to(package))
        for file in package.rglob("*.py")
        if "from numba import" in (text := file.read_text("utf-8")) or "import numba" in text
    }
    folders = kernel_cache.KERNEL_FOLDERS
    others = {file for file in compiled if not file.startswith(tuple(f"{one}/" for one in folders))}
    assert others == {"kernel_cache.py"}
    assert all(any(file.startswith(f"{one}/") for file in compiled) for one in folders)


def test_kernels_are_compiled_once_by_a_process_for_each_share(
    clean: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    clean.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    clean.setattr(kernel_cache, "_PHYSICS", ((("errors",), ("units", "angles")), (("limits",),)))
    log = tmp_path / "log"
    write = f"open({str(log)!r}, 'a').write(f'{{os.getpid()}} {{line}}')"
    clean.setattr(
        kernel_cache, "_COMPILER",
        f"import os, sys\nfor line in sys.stdin: {write}; print('compiled', flush=True)",
    )  # fmt: skip
    kernel_cache.compile_kernels()
    lines = [line.split(maxsplit=1) for line in log.read_text("utf-8").splitlines()]
    assert sorted(modules for _, modules in lines[:2]) == ["errors", "units angles"]
    assert lines[2:] == [[next(pid for pid, modules in lines if modules == "errors"), "limits"]]
    assert capfd.readouterr().err.count("compiling the physics once for this machine") == 1
    kernel_cache.compile_kernels()
    assert capfd.readouterr() == ("", "")


def test_the_sources_that_run_are_compiled(tmp_path: Path, clean: pytest.MonkeyPatch) -> None:
    """In a cache of the user numba files kernels by the place of their source."""
    clean.chdir(tmp_path)
    clean.delenv("PYTHONPATH", raising=False)
    place = "sys.modules['bouncing_disk_ros.errors'].__file__"
    program = kernel_cache._COMPILER.replace('"compiled"', place)
    assert program != kernel_cache._COMPILER
    clean.setattr(kernel_cache, "_COMPILER", program)
    with kernel_cache._compiler() as process:
        printed, _ = process.communicate(b"errors\n")
    assert Path(printed.decode().strip()).parent == Path(kernel_cache.__file__).parent


@pytest.mark.parametrize("program", ["exit(1)", "input(); exit(1)"])
def test_a_failed_compilation_is_tried_again(
    program: str, clean: pytest.MonkeyPatch, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    clean.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    clean.setattr(kernel_cache, "_COMPILER", program)
    for _ in range(2):
        kernel_cache.compile_kernels()
        assert "compiling the physics" in capfd.readouterr().err


def test_another_installation_of_the_same_sources_compiles_nothing(
    clean: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    clean.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    clean.delenv("NUMBA_CACHE_DIR", raising=False)
    count = (
        "import bouncing_disk_ros\n"  # sets the folder, which numba reads once
        "from numba.core import event\n"
        "with event.install_recorder('numba:compile') as found:\n"
        "    import bouncing_disk_ros.core.arithmetic as arithmetic\n"
        "    arithmetic.sine_and_cosine(1.0)\n"
        "print(len(found.buffer), arithmetic.__file__)"
    )
    found = []
    for place in ("first", "second"):
        shutil.copytree(Path(kernel_cache.__file__).parent, tmp_path / place / "bouncing_disk_ros")
        done = subprocess.run(
            [sys.executable, "-c", count], cwd=tmp_path / place, capture_output=True, text=True,
            env={**os.environ, "PYTHONPATH": str(tmp_path / place)}, check=True,
        )  # fmt: skip
        compiled, file = done.stdout.split()
        assert Path(file).is_relative_to(tmp_path / place)
        found.append(int(compiled))
    assert found[0] > 0
    assert found[1] == 0


def test_a_process_of_ours_loads_no_blas_and_no_coverage_with_its_kernels() -> None:
    code = (
        "import sys; from bouncing_disk_ros.kernel_cache import announce_compilation; "
        "announce_compilation('x'); import bouncing_disk_ros.core.platform; "
        "import importlib.util; assert importlib.util.find_spec('scipy'); "
        "assert importlib.util.find_spec('coverage'); "
        "assert not {'scipy.linalg', 'scipy.linalg.cython_blas', 'coverage'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)

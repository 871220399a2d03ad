"""Which tests pytest collects on a ROS 2 machine, where launch_testing takes part in it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import bouncing_disk_ros
from support.processes import finished

TEST = Path(__file__).resolve().parents[1]
PACKAGE = Path(bouncing_disk_ros.__file__).resolve().parents[1]


pytestmark = [pytest.mark.interop, pytest.mark.timeout(900)]


def collected(*arguments: str, cwd: Path = TEST.parent) -> subprocess.CompletedProcess[str]:
    """Collect as `colcon test` does, from the package's folder, beside launch_testing's hook."""
    options = ("--collect-only", "-q", "-p", "no:cacheprovider", "--tb=short")
    env = {"PYTHONPATH": f"{TEST}:{PACKAGE}", "PYTEST_ADDOPTS": None}
    plugin = ("-p", "support.launch_collection")
    command = (sys.executable, "-m", "pytest", *options, *plugin, *arguments)
    kernels = 880.0  # s: the first one compiles them for its numba
    return finished(*command, code=None, env=env, cwd=cwd, timeout=kernels)


def test_every_file_of_tests_is_collected_beside_launch_testing() -> None:
    done = collected("-m", "")  # also what only `make soak` and the like run
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr
    names = {line.partition("::")[0] for line in done.stdout.splitlines() if "::" in line}
    files = {str(path.relative_to(TEST.parent)) for path in TEST.rglob("test_*.py")}
    assert names == files
    assert "SKIPPED" not in done.stdout


def test_collecting_nothing_fails() -> None:
    """`colcon test` takes pytest's own code for it, 5, for success."""
    done = collected("test/unit/test_errors.py", "-k", "no_test_of_this_name")
    assert "no tests collected" in done.stdout
    assert done.returncode == pytest.ExitCode.TESTS_FAILED, done.stderr


@pytest.mark.parametrize(
    ("texts", "trap"),
    [
        (["def test_it(): pass"] * 2, "ImportPathMismatchError"),
        (["import pytest; pytest.importorskip('no_such_module')"] * 2, "no tests collected"),
    ],
    ids=["equal names", "a skip while importing"],
)
def test_the_stand_in_has_the_traps_of_launch_testing(
    tmp_path: Path, texts: list[str], trap: str
) -> None:
    for folder, text in zip(("a", "b"), texts, strict=True):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "test_equal.py").write_text(text)
    (tmp_path / "pytest.ini").touch()
    done = collected("--import-mode=importlib", cwd=tmp_path)
    assert trap in done.stdout
    assert done.returncode != 0

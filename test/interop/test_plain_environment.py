"""The package in a virtual environment without ROS: `pip install .`, then everything but nodes."""

from __future__ import annotations

import os
import shutil
import sys
import time
from pathlib import Path

import pytest

from support.places import ROOT, copy_tree
from support.processes import finished
from support.studies import SMALLEST

BAG = ROOT / "test" / "reference" / "version_0_2_0" / "live"
OURS = ("PYTHONPATH", "PYTHONHOME", "LD_LIBRARY_PATH", "AMENT_PREFIX_PATH", "NUMBA_CACHE_DIR",
        "_ROS_WHEELS_BOOTSTRAP_COMPLETE")  # fmt: skip
LIBRARY = """
import importlib.util
import bouncing_disk_ros as package
assert importlib.util.find_spec("rclpy") is None
assert importlib.util.find_spec("std_msgs") is None
for name in set(package.__all__) - set(package.NEED_ROS):
    getattr(package, name)
for name in package.plots.__all__:
    getattr(package.plots, name)
assert len(package.simulate(1.0, preset="pizza_multiple_toss").impacts) > 1
"""

pytestmark = [pytest.mark.interop, pytest.mark.timeout(1800)]


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder bin of a virtual environment that has the package and no ROS."""
    folder = tmp_path_factory.mktemp("plain")
    tree = copy_tree(folder / "tree")
    base = os.path.realpath(getattr(sys, "_base_executable", sys.executable))
    python = folder / "env" / "bin" / "python"
    begin = time.monotonic()
    for command in (
        (base, "-m", "venv", str(folder / "env")),
        (str(python), "-m", "pip", "install", "--quiet", "-c", str(tree / "constraints.txt"),
         str(tree)),
    ):  # fmt: skip
        run(*command, cwd=folder)
    size = sum(f.stat().st_size for f in (folder / "env").rglob("*") if not f.is_symlink())
    print(f"installed in {time.monotonic() - begin:.0f} s, {size / 1e6:.0f} MB on disk")
    return python.parent


def run(*command: str | Path, cwd: Path, code: int = 0, **changes: str) -> str:
    """What a command prints without what this environment would give it."""
    env = {**dict.fromkeys(OURS), **changes}
    done = finished(*command, code=code, env=env, cwd=cwd, timeout=900.0)
    return done.stdout + done.stderr


def test_the_library_and_every_tool(plain: Path, tmp_path: Path) -> None:
    empty = str(tmp_path / "cache")  # the user's cache may hold these kernels already
    printed = run(plain / "python", "-c", LIBRARY, cwd=tmp_path, XDG_CACHE_HOME=empty)
    assert "bouncing_disk_ros: compiling kernels, each once" in printed
    for name, values in SMALLEST.items():
        options = [word for key, value in values.items() for word in ("-p", f"{key}:={value}")]
        run(plain / name, "--ros-args", *options, "-p", f"output:={name}", cwd=tmp_path)
        assert list((tmp_path / name).glob("*.png"))
    shutil.copytree(BAG, tmp_path / "run")
    for tool in ("bag_report", "replay", "bag_recover"):
        run(plain / tool, "run", cwd=tmp_path)
    assert (tmp_path / "run_report.html").is_file()
    assert "Verified: the orbit found is period-1." in run(plain / "demo", cwd=tmp_path)
    for tool in ("simulator", "recorder", "perform", "echo_impacts", "juggle"):
        printed = run(plain / tool, cwd=tmp_path, code=2)
        assert printed.count("\n") == 1, printed
        assert printed.startswith(f"{tool}: needs ROS 2, ")

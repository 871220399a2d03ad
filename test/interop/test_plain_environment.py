"""The package in a virtual environment without ROS: `pip install .`, then everything but nodes."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from support.places import ROOT, copy_tree
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
        done = run(*command, cwd=folder)
        assert done.returncode == 0, done.stdout
    size = sum(f.stat().st_size for f in (folder / "env").rglob("*") if not f.is_symlink())
    print(f"installed in {time.monotonic() - begin:.0f} s, {size / 1e6:.0f} MB on disk")
    return python.parent


def run(*command: str, cwd: Path, **changes: str) -> subprocess.CompletedProcess[str]:
    kept = {name: value for name, value in os.environ.items() if name not in OURS}
    return subprocess.run(
        command, env={**kept, **changes}, cwd=cwd, text=True, timeout=900, check=False,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip


def test_the_library_and_every_tool(plain: Path, tmp_path: Path) -> None:
    empty = str(tmp_path / "cache")  # the user's cache may hold these kernels already
    done = run(str(plain / "python"), "-c", LIBRARY, cwd=tmp_path, XDG_CACHE_HOME=empty)
    assert done.returncode == 0, done.stdout
    assert "bouncing_disk_ros: compiling kernels, each once" in done.stdout
    for name, values in SMALLEST.items():
        options = [word for key, value in values.items() for word in ("-p", f"{key}:={value}")]
        done = run(str(plain / name), "--ros-args", *options, "-p", f"output:={name}", cwd=tmp_path)
        assert done.returncode == 0, done.stdout
        assert list((tmp_path / name).glob("*.png"))
    shutil.copytree(BAG, tmp_path / "run")
    for tool in ("bag_report", "replay", "bag_recover"):
        done = run(str(plain / tool), "run", cwd=tmp_path)
        assert done.returncode == 0, done.stdout
    assert (tmp_path / "run_report.html").is_file()
    done = run(str(plain / "demo"), cwd=tmp_path)
    assert (done.returncode, "Verified: the orbit found is period-1." in done.stdout) == (0, True)
    for tool in ("simulator", "recorder", "perform", "echo_impacts", "juggle"):
        done = run(str(plain / tool), cwd=tmp_path)
        assert (done.returncode, done.stdout.count("\n")) == (2, 1), done.stdout
        assert done.stdout.startswith(f"{tool}: needs ROS 2, ")

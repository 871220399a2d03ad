"""Ctrl-C while Python imports: an executable ends without a traceback, others keep handlers."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from bouncing_disk_ros.early_signals import is_executable

BIN = sys.executable.rpartition("/")[0]
INTERRUPTED = """
import os, signal, sys
sys.argv = [sys.argv[1]]
sys.orig_argv = ["python", "-m", "bouncing_disk_ros", "bag_report"]
class Finder:
    def find_spec(self, name, *_):
        if name == "bouncing_disk_ros.kernel_cache":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Finder())
import bouncing_disk_ros.nodes.bag_report
"""


@pytest.mark.parametrize(
    ("argv0", "is_quiet"),
    [("-m", True), (f"{BIN}/bag_report", True), ("own_program", False)],
)
def test_an_interrupted_start_ends_without_a_traceback(argv0: str, is_quiet: bool) -> None:
    command = [sys.executable, "-c", INTERRUPTED, argv0]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == -signal.SIGINT
    assert ("KeyboardInterrupt" not in done.stderr) is is_quiet
    assert (done.stderr == "") is is_quiet


COMPILING = """
import os, signal, sys
class Finder:
    def find_spec(self, name, *_):
        if name == "bouncing_disk_ros.study.basins.compute":
            try:
                os.kill(os.getpid(), signal.SIGINT)
                for _ in range(1000):
                    pass  # the handler runs
            except BaseException:
                raise RuntimeError("no compiled object yet: LLVM has dropped the signal") from None
sys.meta_path.insert(0, Finder())
from bouncing_disk_ros.study.basins.options import main
sys.exit(main(["--ros-args", "-p", "width:=2", "-p", "output:=unused"]))
"""


def test_a_study_that_compiles_ends_at_once(tmp_path: Path) -> None:
    """LLVM drops an exception of a handler and goes on with another one."""
    command = [sys.executable, "-c", COMPILING]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (130, "")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("argv0", "is_ours"),
    [
        ("/ws/install/bouncing_disk_ros/lib/bouncing_disk_ros/simulator", True),
        ("/usr/bin/basins", True),
        ("/home/me/basins", False),
        ("/usr/bin/pytest", False),
        ("", False),
    ],
)
def test_only_executables_of_the_package_count(argv0: str, is_ours: bool) -> None:
    assert is_executable(argv0, ["python3"], "/usr/bin/python3") is is_ours
    assert is_executable("-m", ["python3", "-P", "-m", "bouncing_disk_ros"], "")
    assert not is_executable("-m", ["python3", "-m", "own_package.node", argv0], "")

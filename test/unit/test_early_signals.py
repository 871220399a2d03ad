"""Ctrl-C while Python imports: an executable ends without a traceback, others keep handlers."""

from __future__ import annotations

import signal
import subprocess
import sys

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

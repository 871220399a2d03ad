"""A reader that has seen enough (`| head -1`) ends nothing with a traceback; work is done."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

from support.processes import environment, finished
from support.recorded import period_one_bag


def piped(*arguments: str) -> tuple[int, str]:
    """Exit code and stderr of an executable whose stdout is closed."""
    process = subprocess.Popen(
        [sys.executable, "-m", "bouncing_disk_ros", *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=environment({"PYTHONUNBUFFERED": None}),
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.close()
    said = process.stderr.read()
    process.stderr.close()
    return process.wait(100.0), said


def test_the_overview_ends_quietly() -> None:
    assert piped() == (0, "")


def test_closed_streams_are_no_files(tmp_path: Path, warm_kernels: None) -> None:
    """With `2>&-` a study ended with a traceback, and the next file became stderr."""
    arguments = ["toss_paths", "--ros-args", "-p", f"output:={tmp_path}", "-p", "figures:=none"]
    command = shlex.join([sys.executable, "-m", "bouncing_disk_ros", *arguments])
    finished("sh", "-c", f"exec {command} <&- >&- 2>&-")
    assert (tmp_path / "result.zarr").is_dir()


def test_a_report_is_written_all_the_same(tmp_path: Path, warm_kernels: None) -> None:
    folder = str(period_one_bag(tmp_path / "run", 2.0))
    code, said = piped("bag_report", folder, "--figures", "none")
    assert (code, "Error" in said) == (0, False), said
    assert (tmp_path / "run_report.html").is_file()

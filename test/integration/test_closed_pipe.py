"""A reader that has seen enough (`| head -1`) ends nothing with a traceback; work is done."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from support.processes import environment
from support.recorded import period_one_bag


def piped(*arguments: str, lines: int = 1) -> tuple[int, str]:
    """Exit code and stderr of an executable whose stdout is closed after some lines."""
    process = subprocess.Popen(
        [sys.executable, "-m", "bouncing_disk_ros", *arguments],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=environment({"PYTHONUNBUFFERED": None}),
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stderr is not None
    for _ in range(lines):
        process.stdout.readline()
    process.stdout.close()
    said = process.stderr.read()
    process.stderr.close()
    return process.wait(100.0), said


@pytest.mark.parametrize("arguments", [(), ("basins", "--help")], ids=["overview", "help"])
def test_help_ends_quietly(arguments: tuple[str, ...]) -> None:
    assert piped(*arguments, lines=0) == (0, "")


def test_a_report_is_written_all_the_same(tmp_path: Path, warm_kernels: None) -> None:
    folder = str(period_one_bag(tmp_path / "run", 2.0))
    code, said = piped("bag_report", folder, lines=0)
    assert (code, "Error" in said) == (0, False), said
    assert (tmp_path / "run_report.html").is_file()
    code, said = piped("replay", folder, lines=1)
    assert (code, "Error" in said) == (0, False), said


def test_a_study_is_written_all_the_same(tmp_path: Path) -> None:
    given = {"points": 16, "output": tmp_path / "s", "figures": "none"}
    options = [word for key, value in given.items() for word in ("-p", f"{key}:={value}")]
    code, said = piped("toss_paths", "--ros-args", *options, lines=0)
    assert (code, "Error" in said) == (0, False), said
    assert os.path.getsize(tmp_path / "s" / "result.nc") > 0  # noqa: PTH202

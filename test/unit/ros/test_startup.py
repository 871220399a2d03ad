"""The command line before and after --ros-args, and what --help shows of a table."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from bouncing_disk_ros.help_text import spec_lines
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.ros.startup import Start, parser_of


def test_help_has_every_option_with_type_default_and_unit() -> None:
    table = {"lead": Spec("lead", 0.5, "s", "how early"), "csv": Spec("csv", False, "", "as CSV")}
    text = parser_of("tool", "What it does.", table, "tool now").format_help()
    assert all(line in text for spec in table.values() for line in spec_lines(spec))
    assert "lead (double, default 0.5 s)" in text
    assert text.startswith("usage: tool [--help] [--ros-args")
    assert text.endswith("example:\n  tool now\n")


def test_a_file_for_another_node_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "other.yaml"
    for node, said in (("basins", True), ("tool", True), ("disk", False), ("/**", False)):
        file.write_text(f"{node}:\n  ros__parameters:\n    width: 3\n", encoding="utf-8")
        arguments = ["--ros-args", "--params-file", str(file)]
        Start("tool", "", {}, "", arguments, needs_ros=False, node_name="disk").parse()
        line = f"tool: --params-file {file}: it sets nothing for a node called disk, and is ignored"
        assert capsys.readouterr().err == (f"{line}\n" if said else "")


_INTERRUPTED = """
import sys
from bouncing_disk_ros.ros.startup import run_without_ros
sys.exit(run_without_ros("it", lambda: exec("raise KeyboardInterrupt")))
"""


def test_an_interrupt_within_generated_code_ends_with_130(tmp_path: Path) -> None:
    """Not by SIGINT, as CPython would end a process of `python -m` after it."""
    (tmp_path / "interrupted_tool.py").write_text(_INTERRUPTED)
    paths = [str(tmp_path), os.environ.get("PYTHONPATH", "")]
    done = subprocess.run(
        [sys.executable, "-m", "interrupted_tool"], capture_output=True, text=True, timeout=60,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "it: interrupted\n")

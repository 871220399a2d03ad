"""The command line before and after --ros-args, and what --help shows of a table."""

from __future__ import annotations

from pathlib import Path

import pytest

from bouncing_disk_ros.command_line.start import Start, parser_of
from bouncing_disk_ros.help_text import spec_lines
from bouncing_disk_ros.parameters import Spec


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


def test_a_parameter_before_ros_args_is_told_its_place(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        Start("tool", "", {}, "", ["width:=3"], needs_ros=False).parse()
    assert ended.value.code == 2
    assert "come after --ros-args: --ros-args -p NAME:=VALUE" in capsys.readouterr().err

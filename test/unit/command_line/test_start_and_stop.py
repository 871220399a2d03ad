"""How executables start and end: where modules are looked for, options, help, signals."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import bouncing_disk_ros
from bouncing_disk_ros.command_line.safe_path import leave_current_folder_out
from bouncing_disk_ros.command_line.start import Start, parser_of
from bouncing_disk_ros.command_line.stop import Answer, Stop, executable_name
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.executables import module_of
from bouncing_disk_ros.help_text import spec_lines
from bouncing_disk_ros.parameters import Spec
from support.processes import finished

BIN = sys.executable.rpartition("/")[0]
INTERRUPTED = """
import gc, importlib, json, os, signal, sys
gc.disable()
import matplotlib.figure, numba, rclpy, xarray  # what most of them share is loaded once
class Finder:
    def find_spec(self, name, *_):
        if name == interrupted:
            try:
                os.kill(os.getpid(), signal.SIGINT)
                for _ in range(1000):
                    pass  # the handler runs
            except BaseException:  # as numpy does, and LLVM for a kernel
                raise RuntimeError("an import makes another error of it") from None
for argv0, module, interrupted, arguments in json.loads(sys.argv[1]):
    sys.stderr.flush()
    if os.fork() == 0:
        sys.argv, sys.orig_argv = [argv0], ["python", "-m", "bouncing_disk_ros"]
        sys.meta_path.insert(0, Finder())
        sys.exit(importlib.import_module(module).main(arguments))
    code = os.waitstatus_to_exitcode(os.wait()[1])
    print("code", code, file=sys.stderr)
"""
MOMENTS = [
    ("-m", "bag_report", "kernel_cache", "bouncing_disk_ros: interrupted\n"),
    (f"{BIN}/bag_report", "bag_report", "kernel_cache", "bag_report: interrupted\n"),
    ("-c", "bag_report x", "report.report_text", "bag_report: interrupted\n"),
    ("-c", "bag_report x --prove", "proof.bag_proof", "bag_report: interrupted\n"),
    ("-c", "bag_recover x", "bag.walk", "bag_recover: interrupted\n"),
    ("-c", "replay x", "nodes.replay.bag_streams", "replay: interrupted\n"),
    ("-c", "reference_cases", "cases.files", "reference_cases: interrupted\n"),
    ("-c", "fit_impacts x", "measured.fit", "fit_impacts: interrupted\n"),
    ("-c", "basins --ros-args -p output:=x", "study.basins.compute", "basins: interrupted\n"),
    ("-c", "perform", "nodes.performer", "perform: interrupted\n"),
    ("-c", "demo", "nodes.demo.demo_node", "demo: interrupted\n"),
    ("-c", "recorder", "nodes.recorder.recorder_node", ""),
    ("-c", "simulator", "nodes.simulator.simulator_node", ""),
]  # fmt: skip
"""How it is called, what is called, the module whose import is interrupted, what is said."""


def test_an_interrupted_start_is_one_line_at_most(tmp_path: Path) -> None:
    """Each in a process of its own, forked from one that has the libraries they share."""
    calls, expected = [], ""
    for argv0, command, module, said in MOMENTS:
        name, *arguments = command.split()
        calls.append((argv0, module_of(name), f"bouncing_disk_ros.{module}", arguments))
        expected += f"{said}code {130 if said else 0}\n"
    done = finished(sys.executable, "-c", INTERRUPTED, json.dumps(calls), cwd=tmp_path)
    assert done.stderr == expected
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("argv0", "name"),
    [
        ("/ws/install/bouncing_disk_ros/lib/bouncing_disk_ros/simulator", "simulator"),
        ("/usr/bin/basins", "basins"),
        ("/home/me/basins", ""),
        ("/usr/bin/pytest", ""),
        ("", ""),
    ],
)
def test_only_executables_of_the_package_count(argv0: str, name: str) -> None:
    assert executable_name(argv0, ["python3"], "/usr/bin/python3") == name
    assert executable_name("-m", ["python3", "-P", "-m", "bouncing_disk_ros"], "")
    assert not executable_name("-m", ["python3", "-m", "own_package.node", argv0], "")


def test_a_program_that_imports_the_package_keeps_its_handlers() -> None:
    code = (
        "import signal; before = signal.getsignal(2); import bouncing_disk_ros.report.bag_report;"
    )
    code += "assert signal.getsignal(2) is before is signal.default_int_handler"
    finished(sys.executable, "-c", code)


@pytest.fixture
def handlers() -> Iterator[None]:
    kept = {number: signal.getsignal(number) for number in (1, 2, 15)}
    yield
    for number, handler in kept.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_work_is_interrupted_or_looks_for_a_signal(handlers: None, number: int) -> None:
    """Also where a shell in the background had SIGINT ignored."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # the tests may run under nohup
    stop = Stop("it", ExitCode.INTERRUPTED).install()
    stop.answer = Answer.NOTE
    signal.raise_signal(number)
    assert stop.asked
    stop.answer = Answer.INTERRUPT
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(number)


def test_nohup_keeps_it_from_ending_with_the_terminal(handlers: None) -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    Stop().install()
    assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN


_WORK = """
import sys
from bouncing_disk_ros.command_line.start import Start
from bouncing_disk_ros.errors import ExitCode
start = Start("it", "", None, "", [], ExitCode.INTERRUPTED)
sys.exit(start.run(lambda: exec("raise KeyboardInterrupt"), unfinished="; so"))
"""


def test_an_interrupt_within_generated_code_ends_with_130(tmp_path: Path) -> None:
    """Not by SIGINT, as CPython would end a process of `python -m` after it."""
    (tmp_path / "interrupted_tool.py").write_text(_WORK)
    paths = [str(tmp_path), os.environ.get("PYTHONPATH", "")]
    env = {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    done = finished(sys.executable, "-m", "interrupted_tool", code=130, env=env)
    assert done.stderr == "it: interrupted; so\n"


# --- options --------------------------------------------------------------------------------------
def test_help_has_every_option_and_a_parameter_before_ros_args_is_told_its_place(
    capsys: pytest.CaptureFixture[str],
) -> None:
    table = {"lead": Spec("lead", 0.5, "s", "how early"), "csv": Spec("csv", False, "", "as CSV")}
    text = parser_of("tool", "What it does.", table, "tool now").format_help()
    assert all(line in text for spec in table.values() for line in spec_lines(spec))
    assert "lead (double, default 0.5 s)" in text
    assert text.startswith("usage: tool [--help] [--ros-args")
    assert text.endswith("example:\n  tool now\n")
    with pytest.raises(SystemExit) as ended:
        Start("tool", "", {}, "", ["width:=3"], needs_ros=False).parse()
    assert ended.value.code == 2
    assert "come after --ros-args: --ros-args -p NAME:=VALUE" in capsys.readouterr().err


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


# --- where modules are looked for -----------------------------------------------------------------
ROOT = Path(bouncing_disk_ros.__file__).resolve().parents[1]


@pytest.fixture
def search(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> pytest.MonkeyPatch:
    """As `python -m` has it while it looks for its module, in a folder of somebody's."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["-m"])
    monkeypatch.setattr(sys, "path", [str(tmp_path), "/usr/lib/python3", str(tmp_path)])
    monkeypatch.setenv("PYTHONSAFEPATH", "")
    return monkeypatch


def test_the_current_folder_is_left_out_here_and_in_processes(
    search: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    leave_current_folder_out()
    assert sys.path == ["/usr/lib/python3", str(tmp_path)]  # PYTHONPATH may name it too
    assert os.environ["PYTHONSAFEPATH"] == "1"


def test_where_the_package_lies_in_it_it_is_searched_last(search: pytest.MonkeyPatch) -> None:
    search.chdir(ROOT)
    search.setattr(sys, "path", [str(ROOT), "/usr/lib/python3"])
    leave_current_folder_out()
    assert sys.path == ["/usr/lib/python3", str(ROOT)]
    assert os.environ["PYTHONSAFEPATH"] == ""


def test_outside_of_python_m_and_where_it_is_safe_already_nothing_changes(
    search: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    safe = ["/usr/lib/python3", str(tmp_path)]
    cases = [(argv, list(sys.path)) for argv in (["script.py"], ["-c"], [])]
    for argv, path in (*cases, (["-m"], safe)):
        search.setattr(sys, "argv", argv)
        search.setattr(sys, "path", list(path))
        leave_current_folder_out()
        assert sys.path == path

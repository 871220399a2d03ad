"""Signals: an executable ends at any moment of its start with one line at most, others do not."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from bouncing_disk_ros.command_line.stop import Answer, Stop, executable_name
from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.executables import module_of

BIN = sys.executable.rpartition("/")[0]
INTERRUPTED = """
import importlib, json, os, signal, sys
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
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, json.dumps(calls)],
        capture_output=True, text=True, timeout=100, cwd=tmp_path, check=True,
    )  # fmt: skip
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
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


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
    done = subprocess.run(
        [sys.executable, "-m", "interrupted_tool"], capture_output=True, text=True, timeout=60,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "it: interrupted; so\n")

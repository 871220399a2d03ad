"""Runs the tools that read bags in processes that have their libraries already, and measures them.

Started as `python -m support.tool_server`; `ToolServer` is its other end. A tool is called many
times in one process; a call that ends this process (or takes too long) is told by its signal, and
those after it are made in another one.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import io
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, NamedTuple

TOOLS = {
    "bag_report": "bouncing_disk_ros.report.bag_report:main",
    "replay": "bouncing_disk_ros.nodes.replay.replay:main",
    "bag_recover": "bouncing_disk_ros.report.bag_recover:main",
    "read": "support.tool_server:read",
    "study": "support.tool_server:study",
}
KILLED_AFTER = 120
"""Seconds by the clock that a call may take: far more than what is allowed of the processor, which
a loaded machine gives slowly."""
MOST_ADDED = 3 << 30
"""Bytes of address space that calls may add; with more they get a MemoryError."""


class Done(NamedTuple):
    """How one call ended."""

    code: int  # below 0: the signal that ended the process
    out: str
    err: str
    seconds: float  # of the processor
    megabytes: float  # most resident memory of the process so far


class ToolServer:
    """A process that runs tools on demand."""

    def __init__(self, warm: Path) -> None:
        """`warm`: a bag that every tool reads once beforehand."""
        paths = [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "support.tool_server", str(warm)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
        )  # fmt: skip
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == "ready\n"

    def run(self, tool: str, calls: Sequence[Sequence[str]], folder: Path) -> list[Done]:
        """Call a tool with each of some command lines, in a folder."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        request = {"tool": tool, "calls": [list(call) for call in calls], "folder": str(folder)}
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return [Done(*row) for row in json.loads(self._process.stdout.readline())]

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.stdout.close()
        self._process.wait(timeout=60)


# --- tools of the tests ---------------------------------------------------------------------------
def read(arguments: Sequence[str]) -> int:
    """The tool `read`: everything that the library can read of a bag; 0, or 2 and one line."""
    from support.reading import read_all

    refused = read_all(arguments[0])
    if refused:
        print(refused[0], file=sys.stderr)
    return 2 if refused else 0


def study(arguments: Sequence[str]) -> int:
    """The tool `study`: what a study takes from a bag, and how its node ends if it cannot."""
    from bouncing_disk_ros.errors import InputError
    from bouncing_disk_ros.study.bifurcation.options import DEFINITION
    from bouncing_disk_ros.study.from_run import read_bag

    wanted = ("axial_forcing", "restitution", "phase_lag")
    try:
        found = read_bag(arguments[0], None, {name: DEFINITION.options[name] for name in wanted})
    except InputError as error:
        print(f"study: {error.line}", file=sys.stderr)
        return 2
    print(found.text)
    return 0


# --- the process ----------------------------------------------------------------------------------
def _serve(warm: str) -> None:
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        os.chdir(folder)
        _tool("read")([warm])
        _tool("bag_report")([warm, "--text-only"])
        _tool("bag_report")([warm, "--prove", "--every", "9"])
        _tool("replay")([warm, "--what-if", "restitution:=0.4"])
        _tool("bag_recover")([warm, "recovered"])
        _tool("study")([warm])
        os.chdir("/")
    gc.freeze()
    print("ready", flush=True)
    for line in sys.stdin:
        print(json.dumps(_run(**json.loads(line))), flush=True)


def _tool(name: str) -> Callable[[Sequence[str]], int]:
    module, _, function = TOOLS[name].partition(":")
    main: Callable[[Sequence[str]], int] = getattr(importlib.import_module(module), function)
    return main


def _run(tool: str, calls: list[list[str]], folder: str) -> list[Done]:
    done: list[Done] = []
    while len(done) < len(calls):
        with tempfile.TemporaryFile("w+") as results:
            child = os.fork()
            if child == 0:
                _be(tool, calls[len(done) :], folder, results)
            _, status, usage = os.wait4(child, 0)
            results.seek(0)
            done += [Done(*json.loads(line)) for line in results]
        if len(done) < len(calls):
            seconds, most = usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024
            done.append(Done(os.waitstatus_to_exitcode(status), "", "", seconds, most))
    return done


def _be(tool: str, calls: list[list[str]], folder: str, results: IO[str]) -> None:
    """Make the calls in this process, which ends with the last."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + MOST_ADDED
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.chdir(folder)
    for call in calls:
        results.write(json.dumps(_call(_tool(tool), call)) + "\n")
        results.flush()
    os._exit(0)


def _call(main: Callable[[Sequence[str]], int], arguments: list[str]) -> Done:
    """One call."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        os.dup2(out.fileno(), 1)
        os.dup2(err.fileno(), 2)
        signal.alarm(KILLED_AFTER)  # without a handler: it also ends what hangs in the kernel
        begin = time.process_time()
        code = _exit_code(main, arguments)
        seconds = time.process_time() - begin
        signal.alarm(0)
        sys.stdout.flush()
        sys.stderr.flush()
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read(1_000_000).decode(errors="replace"))
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return Done(code, texts[0], texts[1], seconds, most)


def _exit_code(main: Callable[[Sequence[str]], int], arguments: list[str]) -> int:
    """The exit code of a call; 70 and a traceback on stderr for an exception."""
    try:
        return int(main(arguments))
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 71
    except BaseException:  # noqa: BLE001 (it is told)
        traceback.print_exc()
        return 70


if __name__ == "__main__":
    _serve(sys.argv[1])

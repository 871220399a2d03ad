"""Runs the tools that read bags, each in a process of its own that has its libraries already.

Started as `python -m support.tool_server`; `ToolServer` is its other end. A run is measured: time
of the processor and of the clock, and the most memory it had.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import io
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

TOOLS = {
    "bag_report": "bouncing_disk_ros.nodes.bags.bag_report",
    "replay": "bouncing_disk_ros.nodes.replay.replay",
    "bag_recover": "bouncing_disk_ros.nodes.bags.bag_recover",
    "read": "support.tool_server",
}
KILLED_AFTER = 60.0


class Done(NamedTuple):
    """How one run ended."""

    code: int
    out: str
    err: str
    seconds: float  # of the processor
    took: float  # by the clock
    megabytes: float  # most resident memory


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

    def run(self, tool: str, arguments: Sequence[str], folder: Path) -> Done:
        """Run a tool in a folder."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        request = {"tool": tool, "arguments": list(arguments), "folder": str(folder)}
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return Done(*json.loads(self._process.stdout.readline()))

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(timeout=60)


def main(arguments: Sequence[str]) -> int:
    """The tool `read`: everything that the library can read of a bag; 0, or 2 and one line."""
    from bouncing_disk_ros import bag
    from bouncing_disk_ros.bag import decode
    from bouncing_disk_ros.errors import InputError

    refused: list[str] = []

    def attempt(work: Any) -> None:
        try:
            work()
        except (bag.BagError, InputError) as error:
            refused.append(" ".join(str(error).split()))

    def everything() -> None:
        with bag.open(arguments[0]) as run:
            run.info()
            attempt(lambda: run.attachments)
            attempt(lambda: sum(1 for _ in run.messages()))
            for name, topic in run.topics.items():
                attempt(lambda name=name: sum(1 for _ in run.decoded(name)))
                attempt(lambda name=name: run.columns(name))
                if topic.type == decode.CLOUD:
                    attempt(lambda name=name: run.rows(name, 0, 2**62))

    attempt(everything)
    if refused:
        print(refused[0], file=sys.stderr)
    return 2 if refused else 0


def _serve(warm: str) -> None:
    with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stdout(io.StringIO()):
        os.chdir(folder)
        _tool("read")([warm])
        _tool("bag_report")([warm, "report"])
        _tool("replay")([warm, "--what-if", "restitution:=0.4"])
        _tool("bag_recover")([warm, "recovered"])
        os.chdir("/")
    gc.freeze()
    print("ready", flush=True)
    for line in sys.stdin:
        request = json.loads(line)
        print(json.dumps(_run(**request)), flush=True)


def _tool(name: str) -> Callable[[Sequence[str]], int]:
    main: Callable[[Sequence[str]], int] = importlib.import_module(TOOLS[name]).main
    return main


def _run(tool: str, arguments: list[str], folder: str) -> Done:
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        begin = time.monotonic()
        child = os.fork()
        if child == 0:
            _be(tool, arguments, folder, out.fileno(), err.fileno())
        code, usage = _wait(child, begin)
        took = time.monotonic() - begin
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read(1_000_000).decode(errors="replace"))
    seconds = usage.ru_utime + usage.ru_stime
    return Done(code, texts[0], texts[1], seconds, took, usage.ru_maxrss / 1024)


def _wait(child: int, begin: float) -> tuple[int, resource.struct_rusage]:
    """Exit code of a child and what it used; it is killed when it takes too long."""
    while True:
        ended, status, usage = os.wait4(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status), usage
        if time.monotonic() - begin > KILLED_AFTER:
            os.kill(child, 9)
            _, status, usage = os.wait4(child, 0)
            return os.waitstatus_to_exitcode(status), usage
        time.sleep(0.002)


def _be(tool: str, arguments: list[str], folder: str, out: int, err: int) -> None:
    """Be the tool; does not return."""
    code = 70
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(out, 1)
        os.dup2(err, 2)
        os.chdir(folder)
        code = int(_tool(tool)(arguments))
    except SystemExit as exit_:
        code = exit_.code if isinstance(exit_.code, int) else 71
    except BaseException:  # noqa: BLE001 (it is told)
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


if __name__ == "__main__":
    _serve(sys.argv[1])

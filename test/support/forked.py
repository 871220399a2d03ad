"""Processes forked from one that has the package's libraries: a start without a second of imports.

Started as `python -m support.forked`; `ForkServer` is its other end. All that follows the imports
is as in a process of `python -m bouncing_disk_ros`. A forked process becomes a child of the tests'
own, as Linux gives it to the nearest "subreaper" when the process between them has ended.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import importlib
import json
import os
import runpy
import select
import socket
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import IO, NoReturn

from bouncing_disk_ros.executables import STUDIES
from bouncing_disk_ros.folders import PACKAGE
from bouncing_disk_ros.kernel_cache import use_numba_cache

ROOT = Path(__file__).resolve().parents[2]
PR_SET_CHILD_SUBREAPER = 36
NODES = ("simulator.simulator_node", "recorder.recorder_node", "performer", "impact_printer")
LOADED: dict[str, tuple[str, ...]] = {
    "workbench": ("workbench.page_server", "workbench.workbench_node"),
    **dict.fromkeys(STUDIES, ("study.runner", "matplotlib_figures")),
}
"""Modules that an executable loads besides those of NODES."""


class Forked:
    """A running process, with what support/processes.py uses of a `subprocess.Popen`."""

    def __init__(self, pid: int, stdout: IO[str], stderr: IO[str]) -> None:
        self.pid, self.stdout, self.stderr = pid, stdout, stderr
        self._file = os.pidfd_open(pid)
        self._code: int | None = None

    def wait(self, timeout: float | None = None) -> int:
        """The exit code (-N: killed by signal N), once it has ended."""
        if self._code is None:
            if not select.select([self._file], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired(str(self.pid), timeout or 0.0)
            self._code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
            os.close(self._file)
        return self._code

    def poll(self) -> int | None:
        """The exit code, or None while it runs."""
        try:
            return self.wait(0.0)
        except subprocess.TimeoutExpired:
            return None

    def send_signal(self, number: int) -> None:
        """Send a signal to it, if it still runs."""
        if self.poll() is None:
            os.kill(self.pid, number)


class ForkServer:
    """The process that forks; it ends with this one."""

    def __init__(self) -> None:
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1)
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        paths = [str(ROOT / "test"), os.environ.get("PYTHONPATH", "")]
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "support.forked", str(theirs.fileno())],
                pass_fds=[theirs.fileno()], start_new_session=True, text=True,
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1",
                     "PYTHONPATH": os.pathsep.join(filter(None, paths))},
            )  # fmt: skip
        atexit.register(self.close)

    def start(self, arguments: Sequence[str], environment: Mapping[str, str]) -> Forked:
        """Run `python -m bouncing_disk_ros` with these arguments in a session of its own."""
        ends = [os.pipe() for _ in range(2)]
        given = [[*arguments], {**environment}, str(Path.cwd())]
        socket.send_fds(self._socket, [json.dumps(given).encode()], [end for _, end in ends])
        for _, end in ends:
            os.close(end)
        out, err = (open(end, errors="replace") for end, _ in ends)  # noqa: PTH123, SIM115
        pid = self._socket.recv(64)
        assert pid, self._process.communicate()[0]
        return Forked(int(pid), out, err)

    def close(self) -> None:
        """End the process."""
        self._socket.close()
        self._process.communicate()


@cache
def fork_server() -> ForkServer:
    """The one of this process, started when it is first asked for."""
    return ForkServer()


# --- the process ----------------------------------------------------------------------------------
def _serve(connection: socket.socket) -> None:
    use_numba_cache()
    modules = [f"nodes.{name}" for name in NODES]
    while True:
        message, files, *_ = socket.recv_fds(connection, 1 << 20, 2)
        if not message:
            return
        arguments, environment, folder = json.loads(message)
        for module in (*modules, *LOADED.get(arguments[0], ())):
            importlib.import_module(f"{PACKAGE}.{module}")
        gc.freeze()
        if os.fork() == 0:
            between = os.getpid()
            if os.fork():
                os._exit(0)
            while os.getppid() == between:
                time.sleep(1e-3)
            connection.send(str(os.getpid()).encode())
            connection.close()
            os.chdir(folder)
            _become(files, arguments, environment)
        os.wait()
        for file in files:
            os.close(file)


def _become(files: Sequence[int], arguments: list[str], environment: dict[str, str]) -> NoReturn:
    """Be a process of `python -m bouncing_disk_ros` with these arguments, until it ends."""
    os.setsid()
    for place, file in enumerate([os.open(os.devnull, os.O_RDONLY), *files]):
        os.dup2(file, place)
        os.close(file)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = ["-m", *arguments]
    sys.orig_argv = [sys.executable, "-m", PACKAGE, *arguments]
    runpy.run_module(PACKAGE, run_name="__main__", alter_sys=True)
    sys.exit()


if __name__ == "__main__":
    _serve(socket.socket(fileno=int(sys.argv[1])))

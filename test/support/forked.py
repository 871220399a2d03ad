"""Starts executables of the package in forks of a process that has loaded what they import.

Imports take three quarters of a start. `python -m support.forked` is that process, one for each
worker; `Forked` is what subprocess.Popen is for a process of its own. A fork ends as any process
does, with Python's own end. Other executables, and those with an environment of their own, are
started as users start them; so are simulator, recorder and perform by `demo`, and `echo_impacts`
in test_perform.py.
"""

from __future__ import annotations

import atexit
import importlib
import io
import json
import os
import select
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

_STUDY = (
    "ros.spin", "ros.node_tool", "matplotlib_figures", "study.runner", "study.exports",
    "study.outlets",
)  # fmt: skip
LOADED = {
    "simulator": ("ros.spin", "nodes.simulator.simulator_node"),
    "recorder": ("ros.spin", "nodes.recorder.recorder_node"),
    "perform": ("ros.spin", "nodes.performer"),
    "echo_impacts": ("ros.spin", "nodes.impact_printer"),
    "basins": (*_STUDY, "study.basins.compute", "study.basins.picture"),
    "basin_shares": (*_STUDY, "study.basin_shares.compute"),
}
"""Executable -> modules that it loads after it has read its command line."""
_NUMBER = struct.Struct("i")


class Forked:
    """A running fork: `pid`, `stdout` and `stderr` as texts, and how it ends."""

    def __init__(self, arguments: Sequence[str], env: Mapping[str, str]) -> None:
        ends = [os.pipe() for _ in range(3)]
        request = json.dumps([arguments, dict(env), str(Path.cwd())]).encode()
        socket.send_fds(_server(), [request], [write for _, write in ends])
        for _, write in ends:
            os.close(write)
        out, err, self._told = (read for read, _ in ends)
        self.stdout, self.stderr = (os.fdopen(fd, errors="replace") for fd in (out, err))
        self._code: int | None = None
        (self.pid,) = _NUMBER.unpack(os.read(self._told, _NUMBER.size))

    def poll(self) -> int | None:
        """The exit code (-N: by signal N); None: it runs."""
        return self._ended(0.0)

    def wait(self, timeout: float | None = None) -> int:
        """The same, when it has ended; TimeoutExpired if it has not by then."""
        code = self._ended(timeout)
        if code is None:
            raise subprocess.TimeoutExpired(str(self.pid), timeout or 0.0)
        return code

    def send_signal(self, number: int) -> None:
        """Send a signal, unless it has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def _ended(self, timeout: float | None) -> int | None:
        if self._code is None and select.select([self._told], [], [], timeout)[0]:
            (self._code,) = _NUMBER.unpack(os.read(self._told, _NUMBER.size))
            os.close(self._told)
        return self._code


@cache
def _server() -> socket.socket:
    """The other end of the process that forks; it ends with this one."""
    own, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    paths = [str(Path(__file__).resolve().parents[1]), os.environ.get("PYTHONPATH", "")]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    with other:
        process = subprocess.Popen(
            [sys.executable, "-m", "support.forked", str(other.fileno())],
            env={**env, "PYTHONUNBUFFERED": "1"}, pass_fds=[other.fileno()],
            stdin=subprocess.DEVNULL, start_new_session=True,
        )  # fmt: skip

    def close() -> None:
        own.close()
        process.wait(timeout=60)

    atexit.register(close)
    return own


# --- the process ----------------------------------------------------------------------------------
def _serve(control: socket.socket) -> int | None:
    """Fork for each request; in a fork return the exit code of its executable."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    while True:
        request, fds, _, _ = socket.recv_fds(control, 1 << 20, 3)
        if not request:
            return None
        arguments, env, folder = json.loads(request)
        for name in LOADED[arguments[0]]:
            importlib.import_module(f"bouncing_disk_ros.{name}")
        if os.fork() == 0:  # the parent of the executable: tells how it ends
            control.close()
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            child = os.fork()
            if child == 0:
                return _run(arguments, env, folder, fds)
            for fd in fds[:2]:
                os.close(fd)
            os.write(fds[2], _NUMBER.pack(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])))
            os._exit(0)
        for fd in fds:
            os.close(fd)


def _run(
    arguments: list[str], env: Mapping[str, str], folder: str, fds: Sequence[int]
) -> int | None:
    """Be the executable of these arguments."""
    from bouncing_disk_ros.__main__ import main

    os.setsid()
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.write(fds[2], _NUMBER.pack(os.getpid()))
    for number, (fd, name) in enumerate(zip(fds, ("stdout", "stderr"), strict=False), 1):
        os.dup2(fd, number)
        raw = os.fdopen(number, "wb", 0, closefd=False)
        setattr(sys, name, io.TextIOWrapper(raw, write_through=True))
    for fd in fds:
        os.close(fd)
    os.environ.clear()
    os.environ.update(env)
    os.chdir(folder)
    sys.argv = ["bouncing_disk_ros", *arguments]
    return main()


if __name__ == "__main__":
    sys.exit(_serve(socket.socket(fileno=int(sys.argv[1]))))

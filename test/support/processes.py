"""Start the package's executables as processes of their own, wait for what they print, end them.

    def test_it(start):                      # the fixture of conftest.py
        node = start("simulator", "--ros-args", "-p", "autostart:=true")
        node.wait_for(r"active")             # a line of stdout or stderr, by regex
        assert node.end(signal.SIGINT) == 0  # signals it, waits for the end, returns the code
        assert "Traceback" not in node.output

`start(name, *arguments, env={...})` runs `python -m bouncing_disk_ros name arguments`; `env` is
laid over the environment, a value of None removes a variable. `start.command([...])` runs anything
else. What still runs when the test ends is killed, with its children; the output of every process
is printed for a test that fails. `executed(name, *arguments)` waits for the end.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import IO, Any

import pytest

from bouncing_disk_ros.executables import module_of

PATIENCE = 60.0  # s; bounds a wait for a condition, long past any start-up on a loaded machine
INFORMATION = re.compile(
    r"\[INFO\]"
    r"|: compiling (the|kernels)\b"  # of a first start
    r"|: \d+ of \d+ parts$"  # of a study that takes more than ten seconds
)
"""What lines of stderr have in them that tell of nothing wrong."""
LATE = re.compile(r"real time: \w+, (\S+ s behind|\d+ samples of joint_states skipped): ")
"""What the line of a simulator has in it that got too little of the machine for a moment."""


def environment(changes: Mapping[str, str | None] | None = None) -> dict[str, str]:
    """Return the environment for a child: this one's, plain unbuffered output, and `changes`.

    A first request of a test may come before its client is known: rclpy warns of the answer that it
    drops, and the test asks again (`Nodes.meet`). An answer that is really lost ends a wait.
    """
    quiet = {"PYTHONUNBUFFERED": "1", "RCUTILS_COLORIZED_OUTPUT": "0",
             "PYTHONWARNINGS": "ignore:failed to send response:RuntimeWarning"}  # fmt: skip
    merged = {**os.environ, **quiet}
    for name, value in (changes or {}).items():
        if value is None:
            merged.pop(name, None)
        else:
            merged[name] = value
    return merged


def wait_until(
    condition: Callable[[], Any],
    between: Callable[[], object] = lambda: time.sleep(0.01),
    told: Callable[[], object] = lambda: "the condition did not hold",
    timeout: float = PATIENCE,
) -> None:
    """Do something until a condition holds, AssertionError with what is told if it takes long."""
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end, f"within {timeout} s: {told()}"
        between()


def finished(
    *command: str | Path,
    code: int | None = 0,
    env: Mapping[str, str | None] | None = None,
    cwd: Path | None = None,
    timeout: float = 100.0,
) -> subprocess.CompletedProcess[str]:
    """A command at its end, with what it printed; `code`: that it must end with, None: any."""
    done = subprocess.run(
        [*map(str, command)], env=environment(env), cwd=cwd, capture_output=True, text=True,
        timeout=timeout, check=False,
    )  # fmt: skip
    assert code in (None, done.returncode), f"{command[0]}: {done.stdout}{done.stderr}"
    return done


executed = partial(finished, sys.executable, "-m", "bouncing_disk_ros")
"""An executable of the package at its end."""


def ends(
    capfd: pytest.CaptureFixture[str], name: str, *arguments: str
) -> tuple[int, str, list[str]]:
    """Exit code, stdout and lines of stderr of an executable that is called in this process."""
    handlers = {number: signal.getsignal(number) for number in (1, 2, 15)}
    capfd.readouterr()
    try:
        code = int(importlib.import_module(module_of(name)).main(arguments))
    except SystemExit as end:
        code = int(end.code or 0)
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        gc.unfreeze()
    out, err = capfd.readouterr()
    return code, out, err.splitlines()


class Process:
    """A running command in a session of its own; its output is read as it comes."""

    def __init__(
        self,
        command: Sequence[str],
        env: Mapping[str, str | None] | None = None,
        cwd: str | None = None,
    ) -> None:
        self.command = list(command)
        self.lines: list[tuple[str, str]] = []
        self._changed = threading.Condition()
        self._popen = subprocess.Popen(
            self.command,
            env=environment(env),
            cwd=cwd,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
            start_new_session=True,
        )
        assert self._popen.stdout is not None
        assert self._popen.stderr is not None
        self._readers = [
            threading.Thread(target=self._read, args=(name, stream), daemon=True)
            for name, stream in (("stdout", self._popen.stdout), ("stderr", self._popen.stderr))
        ]
        for reader in self._readers:
            reader.start()

    def _read(self, name: str, stream: IO[str]) -> None:
        with stream:
            for line in stream:
                with self._changed:
                    self.lines.append((name, line))
                    self._changed.notify_all()
        with self._changed:
            self._changed.notify_all()

    def _text(self, *names: str) -> str:
        with self._changed:
            return "".join(line for name, line in self.lines if name in names)

    @property
    def pid(self) -> int:
        """The id of the process, which is also that of its session and group."""
        return self._popen.pid

    @property
    def stdout(self) -> str:
        """What was printed to stdout so far."""
        return self._text("stdout")

    @property
    def stderr(self) -> str:
        """What was printed to stderr so far."""
        return self._text("stderr")

    @property
    def output(self) -> str:
        """Both, in the order of arrival."""
        return self._text("stdout", "stderr")

    @property
    def complaints(self) -> list[str]:
        """The lines of stderr that are not mere information."""
        return [line for line in self.stderr.splitlines() if not INFORMATION.search(line)]

    @property
    def complaints_but_late(self) -> list[str]:
        """The same without those of a simulator that the machine, not its own fault, holds up."""
        return [line for line in self.complaints if not LATE.search(line)]

    @property
    def running(self) -> bool:
        """Whether it has not ended yet."""
        return self._popen.poll() is None

    def wait_for(self, pattern: str, timeout: float = PATIENCE) -> re.Match[str]:
        """Wait until a line of the output matches `pattern` (re.search) and return the match."""
        deadline = time.monotonic() + timeout
        seen = 0
        with self._changed:
            while True:
                for _, line in self.lines[seen:]:
                    seen += 1
                    if match := re.search(pattern, line):
                        return match
                reading = any(reader.is_alive() for reader in self._readers)
                left = deadline - time.monotonic()
                if not reading and seen == len(self.lines):
                    raise AssertionError(self._told(f"ended without printing {pattern!r}"))
                if left <= 0:
                    raise AssertionError(self._told(f"did not print {pattern!r} in {timeout} s"))
                self._changed.wait(min(left, 0.2))

    def wait(self, timeout: float = PATIENCE) -> int:
        """Wait for the end, with all output read; return the exit code (-N: killed by signal N)."""
        try:
            code = self._popen.wait(timeout)
        except subprocess.TimeoutExpired:
            raise AssertionError(self._told(f"still runs after {timeout} s")) from None
        for reader in self._readers:
            reader.join(timeout=5.0)  # a grandchild may hold the pipe open
        return code

    def send(self, number: int) -> None:
        """Send a signal to the process and its children, as a terminal does."""
        os.killpg(self.pid, number)

    def end(self, number: int = signal.SIGINT, timeout: float = PATIENCE) -> int:
        """Send a signal to the process alone, wait for the end and return the exit code."""
        self._popen.send_signal(number)
        return self.wait(timeout)

    def kill(self) -> None:
        """Kill the process and its children if any still run."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)
        self._popen.wait()

    def _told(self, what: str) -> str:
        output = "".join(f"  {name}: {line}" for name, line in self.lines)
        return f"{' '.join(self.command)} {what}; exit code {self._popen.poll()}; output:\n{output}"


def recorder(start: Starter, folder: Path, *parameters: str) -> Process:
    """A recorder at work, with parameters name:=value."""
    options = [part for parameter in parameters for part in ("-p", parameter)]
    process = start("recorder", str(folder), "--ros-args", *options)
    process.wait_for("recording to")
    return process


def any_ends(processes: Sequence[Process], timeout: float = PATIENCE) -> None:
    """Wait until one of several processes has ended."""
    wait_until(
        lambda: not all(one.running for one in processes),
        told=lambda: "all still run",
        timeout=timeout,
    )


class Starter:
    """Starts processes and keeps them, so that none outlives the test."""

    def __init__(self) -> None:
        self.processes: list[Process] = []

    def __call__(
        self, name: str, *arguments: str, env: Mapping[str, str | None] | None = None
    ) -> Process:
        """Start the executable `name` of this package."""
        return self.command([sys.executable, "-m", "bouncing_disk_ros", name, *arguments], env=env)

    def command(
        self,
        command: Sequence[str],
        env: Mapping[str, str | None] | None = None,
        cwd: str | None = None,
    ) -> Process:
        """Start any command."""
        process = Process(command, env, cwd)
        self.processes.append(process)
        return process

    def close(self) -> None:
        """Kill what still runs and print what everything printed (pytest shows it on failure)."""
        for process in self.processes:
            process.kill()
            print(f"--- {' '.join(process.command)}\n{process.output}")

"""Executables of this package as processes that end with the one that started them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import weakref
from types import TracebackType

_RUN = """
import os, sys
import bouncing_disk_ros  # makes the search for modules safe, before others are looked for
import ctypes, signal
PR_SET_PDEATHSIG = 1
ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
if os.getppid() != int(sys.argv.pop(1)):
    sys.exit(1)
from bouncing_disk_ros.__main__ import main
sys.exit(main())
"""
"""What the process runs. Linux, prctl(2): the kernel signals it when its parent dies, however that
dies. It asks for that itself: a parent with threads can run nothing between fork and exec."""


class Child:
    """A started executable; leaving the `with` block ends it.

    To be started by the main thread: the end of the thread that starts it counts as the parent's.
    """

    def __init__(self, name: str, *arguments: str) -> None:
        self.name = name
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 (closed with this object)
        weakref.finalize(self, self._log.close)
        self._process = subprocess.Popen(
            [sys.executable, "-c", _RUN, str(os.getpid()), name, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=self._log,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C is for the parent, which ends this one in order
        )

    def __enter__(self) -> Child:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.end()

    @property
    def code(self) -> int | None:
        """Exit code, or None while it runs."""
        return self._process.poll()

    def wait(self) -> int:
        """The exit code, once it has ended."""
        return self._process.wait()

    @property
    def log(self) -> str:
        """All it has printed."""
        size = self._log.seek(0, 2)
        self._log.seek(0)
        return self._log.read(size).decode("utf-8", "replace")

    @property
    def last_line(self) -> str:
        """The last line that it has printed."""
        return (self.log.strip().splitlines() or ["it said nothing"])[-1]

    def end(self, seconds: float = 20.0) -> int:
        """Interrupt it, wait, kill it if need be; the exit code."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(seconds)
            except subprocess.TimeoutExpired:
                self._process.kill()
        return self._process.wait()

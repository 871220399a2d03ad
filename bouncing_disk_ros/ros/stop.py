"""SIGINT, SIGTERM, SIGHUP: leave at once while starting, end in order later; without rclpy."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from bouncing_disk_ros.errors import ExitCode


def ending_signals() -> list[signal.Signals]:
    """The signals that end a process in order; SIGHUP not where nohup has it ignored."""
    found = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        found.append(signal.SIGHUP)
    return found


def interrupt_on_signals() -> None:
    """Let these signals raise KeyboardInterrupt, also where a shell had SIGINT ignored."""
    for number in ending_signals():
        signal.signal(number, signal.default_int_handler)


@contextmanager
def _without_cycle_search() -> Iterator[None]:
    """Around slow imports: Python's searches for cycles would take a tenth of their time."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()  # what is imported stays: later searches leave it out
        gc.enable()


@contextmanager
def ending_at_once(name: str) -> Iterator[None]:
    """Around slow imports: a signal ends the process with one line and exit code INTERRUPTED.

    KeyboardInterrupt within an import may come out as another error, with a traceback. Nothing may
    be in progress that has to be undone. The handlers of before are put back.
    """

    def end(_number: int, _frame: FrameType | None) -> None:
        os.write(2, f"{name}: interrupted\n".encode())
        os._exit(int(ExitCode.INTERRUPTED))

    numbers = ending_signals()
    before = [signal.signal(number, end) for number in numbers]
    try:
        with _without_cycle_search():
            yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


class Stop:
    """Takes over the ending signals of the process; `asked` turns true on the first.

    Install it before the slow imports. A signal then unwinds with exit code `code` until `running`
    is set, when a loop looks at `asked`. Within `importing` there is nothing to unwind: the process
    ends at once, however deep in a compiler that would print a traceback.
    """

    def __init__(self, code: ExitCode = ExitCode.DONE) -> None:
        self.code = code
        self.asked = False
        self._unwinds = True
        self.running = False

    def install(self) -> Stop:
        """Take over SIGINT, SIGTERM and SIGHUP."""
        for number in ending_signals():
            signal.signal(number, self._ask)
        return self

    @contextmanager
    def importing(self) -> Iterator[None]:
        """Around the slow imports."""
        self._unwinds = False
        try:
            with _without_cycle_search():
                yield
        finally:
            self._unwinds = True

    def _ask(self, _number: int, _frame: FrameType | None) -> None:
        self.asked = True
        if not self._unwinds:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(int(self.code))
        if not self.running:
            sys.exit(int(self.code))

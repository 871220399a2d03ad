"""SIGINT, SIGTERM and SIGHUP in the executables of the package: one handler, three answers.

The package loads this file first, and installs the handler in a process that is one of its
executables. A program that imports the package keeps its handlers.
"""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from enum import Enum
from types import FrameType

from bouncing_disk_ros.errors import ExitCode
from bouncing_disk_ros.executables import EXECUTABLES

_PACKAGE = "bouncing_disk_ros"


class Answer(Enum):
    """What a signal does, beside that `Stop.asked` turns true."""

    END = "ends the process at once, with the exit code: there is nothing to undo"
    INTERRUPT = "raises KeyboardInterrupt, wherever the main thread is"
    NOTE = "does nothing more: a loop looks at `asked` and ends in order"


class Stop:
    """The answer of an executable to the signals that end it; `asked`: whether one has come.

    It answers END until it is told otherwise. `name`: of the executable. `code`: what a signal ends
    it with; INTERRUPTED is said on stderr, DONE is not.
    """

    def __init__(self, name: str = "", code: int = ExitCode.DONE) -> None:
        self.name, self.code = name, code
        self.asked = False
        self.answer = Answer.END

    def install(self) -> Stop:
        """Take over the signals, also SIGINT that a shell had ignored; not SIGHUP under nohup."""
        signal.signal(signal.SIGINT, self._on_signal)
        signal.signal(signal.SIGTERM, self._on_signal)
        if signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
            signal.signal(signal.SIGHUP, self._on_signal)
        return self

    @contextlib.contextmanager
    def loading(self) -> Iterator[None]:
        """Around slow imports: answer END, however deep in a compiler; and no search for cycles.

        An exception within an import may come out as another one, with a traceback. The searches
        would take a tenth of the time.
        """
        before, self.answer = self.answer, Answer.END
        gc.disable()
        try:
            yield
        finally:
            gc.freeze()  # what is imported stays: later searches leave it out
            gc.enable()
            self.answer = before

    def say(self, more: str = "") -> None:
        """Say on stderr that it is interrupted, where that is what its exit code says."""
        if self.code == ExitCode.INTERRUPTED:
            begin = "\n" if os.isatty(2) else ""  # a bar of progress, or ^C
            os.write(2, f"{begin}{self.name}: interrupted{more}\n".encode())

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self.asked = True
        if self.answer is Answer.INTERRUPT:
            raise KeyboardInterrupt
        if self.answer is Answer.END:
            with contextlib.suppress(Exception):  # the signal may come amid a print
                sys.stdout.flush()
            self.say()
            os._exit(int(self.code))


def executable_name(argv0: str, original: Sequence[str], interpreter: str) -> str:
    """The executable of the package that has this sys.argv[0] and sys.orig_argv; "": none has.

    `python -m` has not put a name into argv yet when it imports the package of what it runs;
    scripts lie beside the interpreter, or in the package's folder of a ROS workspace.
    """
    if argv0 == "-m":
        asked = list(original)[1:]
        module = asked[asked.index("-m") + 1] if "-m" in asked[:-1] else ""
        return _PACKAGE if module.partition(".")[0] == _PACKAGE else ""
    folder, name = os.path.split(argv0)
    near = folder == os.path.dirname(interpreter)  # noqa: PTH120 (pathlib is not loaded yet)
    is_ours = near or os.path.basename(folder) == _PACKAGE  # noqa: PTH119
    return name if name in EXECUTABLES and is_ours else ""


if _name := executable_name(sys.argv[0] if sys.argv else "", sys.orig_argv, sys.executable):
    Stop(_name, ExitCode.INTERRUPTED).install()

"""Ctrl-C while an executable of the package is still being imported: it ends without a traceback.

Loaded first by the package, so that hardly anything comes before it. Only in a process that is one
of the executables: a program that imports the package keeps its handlers.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence

from bouncing_disk_ros.executables import EXECUTABLES


def is_executable(argv0: str, original: Sequence[str], interpreter: str) -> bool:
    """Whether a process with this sys.argv[0] and sys.orig_argv is an executable of the package.

    `python -m` has not put a name into argv yet when it imports the package of what it runs;
    scripts lie beside the interpreter, or in the package's folder of a ROS workspace.
    """
    if argv0 == "-m":
        asked = list(original)[1:]
        name = asked[asked.index("-m") + 1] if "-m" in asked[:-1] else ""
        return name.partition(".")[0] == "bouncing_disk_ros"
    folder, name = os.path.split(argv0)
    near = folder == os.path.dirname(interpreter)  # noqa: PTH120 (pathlib is not loaded yet)
    return name in EXECUTABLES and (near or os.path.basename(folder) == "bouncing_disk_ros")  # noqa: PTH119


def end_quietly_while_starting() -> None:
    """Let SIGINT end an executable as it ends any program, until its `main` takes it over."""
    if not is_executable(sys.argv[0] if sys.argv else "", sys.orig_argv, sys.executable):
        return
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)


end_quietly_while_starting()

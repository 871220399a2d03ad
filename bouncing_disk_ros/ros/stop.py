"""SIGINT and SIGTERM: leave at once while starting, end in order later. Imports no rclpy."""

from __future__ import annotations

import signal
import sys
from types import FrameType

from bouncing_disk_ros.errors import ExitCode


class Stop:
    """Takes over both signals of the process; `asked` turns true once it runs.

    Install it before the slow imports: until `running` is set a signal ends the process with code
    0 at once, for there is nothing to finish yet.
    """

    def __init__(self) -> None:
        self.asked = False
        self.running = False

    def install(self) -> Stop:
        """Take over SIGINT and SIGTERM."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._ask)
        return self

    def _ask(self, _number: int, _frame: FrameType | None) -> None:
        self.asked = True
        if not self.running:
            sys.exit(int(ExitCode.DONE))

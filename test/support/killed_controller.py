"""The controller of a page, which kills itself: `killed_controller.py FILE NUMBER EDGE GATE`.

EDGE: before the input, before the answer or after the answer to that gate. What it has published
has been delivered then.
"""

from __future__ import annotations

import os
import runpy
import signal
import sys
from typing import Any

import rclpy


def main() -> None:
    """Spin until it is dead."""
    path, number, edge, last = sys.argv[1:]
    base: Any = runpy.run_path(path)["Controller"]

    class Killed(base):
        """Ends at one edge."""

        def on_gate(self, msg: Any) -> None:
            """A gate is closed."""
            super().on_gate(msg)
            if self.answered and self.answered[0] == int(last):
                self.proceed.wait_for_all_acked()
                os.kill(os.getpid(), signal.SIGKILL)

        def move(self, gate: int) -> None:
            """Publish the input."""
            if gate == int(last) and edge == "before the input":
                os.kill(os.getpid(), signal.SIGKILL)
            super().move(gate)
            if gate == int(last) and edge == "before the answer":
                self.out.wait_for_all_acked()
                os.kill(os.getpid(), signal.SIGKILL)

    rclpy.init()
    rclpy.spin(Killed(int(number)))


if __name__ == "__main__":
    main()

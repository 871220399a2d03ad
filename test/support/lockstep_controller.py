"""A controller in a process of its own: `lockstep_controller.py NUMBER GATES EXECUTOR LOAD`.

It answers so many gates (see controllers.GateController) and says how long they took. LOAD: it
sleeps for a random time of up to so many seconds before some of its answers.
"""

from __future__ import annotations

import random
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import rclpy
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor, SingleThreadedExecutor
from std_msgs.msg import UInt64MultiArray

from support.controllers import GateController


class Sleepy(GateController):
    """Sleeps now and then before it answers."""

    def __init__(self, number: int, load: float) -> None:
        super().__init__(number)
        self._load = load

    def on_gate(self, msg: UInt64MultiArray) -> None:
        """A gate is closed; the controller takes its time."""
        if self._load and random.random() < 0.3:
            time.sleep(random.random() * self._load)
        super().on_gate(msg)


def main() -> None:
    """Run until so many gates are answered."""
    number, gates, executor, load = sys.argv[1:]
    rclpy.init()
    node = Sleepy(int(number), float(load))
    kinds = {"single": SingleThreadedExecutor, "multi": MultiThreadedExecutor}
    if executor == "events":
        from rclpy.experimental.events_executor import EventsExecutor

        kinds["events"] = EventsExecutor
    runner = kinds[executor]()
    runner.add_node(node)
    begin = 0.0
    try:
        while node.gates < int(gates):
            runner.spin_once(timeout_sec=0.5)
            if node.gates and not begin:
                begin = time.monotonic()
    except (KeyboardInterrupt, ExternalShutdownException):
        return
    print(f"answered {node.gates} gates in {time.monotonic() - begin:.2f} s", flush=True)
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()

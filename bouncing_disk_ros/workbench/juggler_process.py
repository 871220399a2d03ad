"""The executable `juggle` as a process of the workbench: started, restarted, ended; its status."""

from __future__ import annotations

from dataclasses import replace

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String

from bouncing_disk_ros.ros.child import Child
from bouncing_disk_ros.workbench.actions import Juggle, Names, juggle_arguments, lines
from bouncing_disk_ros.workbench.run_history import RunHistory

TOPIC = "juggle/status"
FACTOR = "real_time_factor"


class JugglerProcess:
    """Keeps at most one process. What `juggle/status` says, whoever runs it, is in the history.

    All methods are for the thread that starts processes, whose end is theirs.
    """

    def __init__(self, node: Node, history: RunHistory) -> None:
        self._node, self._history = node, history
        self._child: Child | None = None
        self._action = Juggle("none")
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        node.create_subscription(String, TOPIC, self._on_status, latched)

    def _on_status(self, msg: String) -> None:
        self._history.juggling = str(msg.data)

    def start(self, action: Juggle) -> None:
        """Start it in place of the one before."""
        self.end()
        self._action = action
        self._history.juggling = f"{action.strategy}: juggle starts …"
        space = ("-r", f"__ns:={self._node.get_namespace()}")
        self._child = Child("juggle", "--ros-args", *space, *juggle_arguments(action))

    def stop(self) -> None:
        """End it; say so where there is none of this workbench."""
        if self._child is None and self._history.juggling:
            self._history.note(
                "juggle was not started by this workbench: end it where it runs", is_refusal=True
            )
        self.end()

    def end(self) -> None:
        """End it if it runs: the platform ends the trajectory that it was given."""
        if self._child is not None:
            self._child.end()
            self._child, self._history.juggling = None, ""

    def tick(self, names: Names) -> None:
        """See whether it ended, and whether it knows how fast simulated time goes."""
        child, history = self._child, self._history
        if child is None:
            if history.juggling and not self._node.count_publishers(TOPIC):
                history.juggling = ""  # somebody's own one has ended
        elif child.code is not None:
            said = child.log.strip().splitlines() or ["it said nothing"]
            history.note(f"juggle ended: {said[-1]}", is_refusal=True)
            self._child, history.juggling = None, ""
        else:
            self._follow_factor(names)

    def _follow_factor(self, names: Names) -> None:
        """Start it again where the real-time factor is another one: its stamps depend on that."""
        given, factor = self._action.options, float(self._history.own_values()[FACTOR])
        if factor != given.get(FACTOR, 1.0):
            action = replace(self._action, options={**given, FACTOR: factor})
            self._history.note(
                f"juggle begins anew, for another {FACTOR}: {lines(action, names)[0]}"
            )
            self.start(action)

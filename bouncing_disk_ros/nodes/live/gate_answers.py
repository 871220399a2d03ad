"""A controller's part in a lockstep: it answers each gate once it has heard all impacts before."""

from __future__ import annotations

from array import array

from rclpy.node import Node
from std_msgs.msg import UInt64MultiArray

from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.topics import LOCKSTEP_TOPICS

SIMULATOR = "bouncing_disk"
"""Name of the simulator's node: `bouncing_disk/gate` can be remapped."""


class GateAnswers:
    """Answers the gates of a simulator.

    Call `begin` once, `sent` after each input and `heard` after the impacts of a message.
    """

    def __init__(self, node: Node, number: int) -> None:
        self._number, self._rows, self._inputs = number, -1, 0
        self._is_ready = False
        self._open: tuple[int, int] | None = None
        gate, proceed = (LOCKSTEP_TOPICS[f"~/{name}"] for name in ("gate", "proceed"))
        self._out = node.create_publisher(
            UInt64MultiArray, f"{SIMULATOR}/proceed", profile_of(proceed)
        )
        node.create_subscription(
            UInt64MultiArray, f"{SIMULATOR}/gate", self._on_gate, profile_of(gate)
        )

    def begin(self) -> None:
        """The controller knows what it needs from the start: gates may be answered."""
        self._is_ready = True
        self._answer()

    def sent(self) -> None:
        """Count an input that has been published."""
        self._inputs += 1

    def heard(self, rows: int) -> None:
        """Impacts up to so many rows of the run have been answered."""
        self._rows = rows
        self._answer()

    def _on_gate(self, msg: UInt64MultiArray) -> None:
        gate, _, rows = msg.data
        if self._rows < 0:  # what came before this controller it cannot hear
            self._rows = rows
        self._open = (gate, rows)
        self._answer()

    def _answer(self) -> None:
        if not self._is_ready or self._open is None or self._rows < self._open[1]:
            return
        gate, _ = self._open
        self._open = None
        data = array("Q", (self._number, gate, self._inputs))
        self._inputs = 0
        self._out.publish(UInt64MultiArray(data=data))

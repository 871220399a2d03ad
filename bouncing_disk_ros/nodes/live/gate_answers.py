"""A controller's part in a lockstep: it answers each gate once it has heard all impacts before."""

from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import UInt64MultiArray

from bouncing_disk_ros.ros.numbered_subscription import WithInfo
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.topics import LOCKSTEP_TOPICS

SIMULATOR = "bouncing_disk"
"""Name of the simulator's node: `bouncing_disk/gate` can be remapped."""


class GateAnswers:
    """Answers the gates of a simulator.

    Call `begin` once, `sent` after each input and `heard` after the impacts of a message. Rows
    below `first_row` came before the first gate that was heard: they are not to be answered, or it
    would depend on who was started first.
    """

    def __init__(self, node: Node, number: int, outputs: Sequence[Publisher]) -> None:
        """`outputs` publish the controller's inputs."""
        self._number, self._inputs = number, 0
        self._outputs = outputs
        self.first_row: int | None = None  # None: no gate was heard yet
        self._rows = 0
        self._is_ready = False
        self._gate, self._gate_rows, self._message = -1, 0, 0
        self._answered: UInt64MultiArray | None = None  # to the gate heard last
        gate, proceed = (LOCKSTEP_TOPICS[f"~/{name}"] for name in ("gate", "proceed"))
        self._out = node.create_publisher(
            UInt64MultiArray, f"{SIMULATOR}/proceed", profile_of(proceed)
        )
        node.create_subscription(
            UInt64MultiArray, f"{SIMULATOR}/gate", WithInfo(self._on_gate), profile_of(gate)
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
        if self._answered is None:
            self._answer()

    def _on_gate(self, msg: UInt64MultiArray, info: Mapping[str, Any]) -> None:
        gate, _, rows = msg.data
        message = info["publication_sequence_number"]
        is_anew = message is not None and message <= self._message
        if self.first_row is None or is_anew or gate < self._gate:
            self.first_row = self._rows = rows  # a run that has begun before, or anew
            self._inputs, self._answered = 0, None
        self._message = message or 0
        if gate != self._gate:
            self._answered = None
        self._gate, self._gate_rows = gate, rows
        self._answer()

    def _answer(self) -> None:
        """Answer the gate; one that comes again gets the same answer.

        Without a subscriber yet, what is sent would be lost: the gate will come again.
        """
        if not self._is_ready or self.first_row is None or self._rows < self._gate_rows:
            return
        if not all(one.get_subscription_count() for one in (self._out, *self._outputs)):
            return
        if self._answered is None:
            data = array("Q", (self._number, self._gate, self._inputs))
            self._answered, self._inputs = UInt64MultiArray(data=data), 0
        self._out.publish(self._answered)

"""The topics of a lockstep: ~/gate says that simulated time stands, ~/proceed that it may go on."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.node import Node
from std_msgs.msg import UInt64MultiArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Value, items_of
from bouncing_disk_ros.ros.numbered_subscription import WithInfo
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.run.gates import Gates
from bouncing_disk_ros.topics import LOCKSTEP_TOPICS


class GateTopics(Gates):
    """Gates with their topics; `on_complete` is called when one may be closed."""

    def __init__(
        self,
        node: Node,
        values: Mapping[str, Value],
        refuse: Callable[[InputError], None],
        on_complete: Callable[[], None],
    ) -> None:
        numbers = [int(item) for item in items_of(str(values["lockstep_controllers"]))]
        gate, proceed = LOCKSTEP_TOPICS["~/gate"], LOCKSTEP_TOPICS["~/proceed"]
        super().__init__(numbers, 0, lambda: node.count_publishers(proceed.name))
        self._node, self._refuse, self._on_complete = node, refuse, on_complete
        self.set_timeout(values)
        self._publisher = node.create_publisher(UInt64MultiArray, gate.name, profile_of(gate))
        self._subscription = node.create_subscription(
            UInt64MultiArray, proceed.name, WithInfo(self._on_proceed), profile_of(proceed)
        )
        self._shown = UInt64MultiArray()

    def destroy(self) -> None:
        """Take the topics away."""
        self._node.destroy_publisher(self._publisher)
        self._node.destroy_subscription(self._subscription)

    def publish(self, now_ns: int, time_ns: int, rows: int) -> None:
        """Open the next gate, and tell its number."""
        super().publish(now_ns, time_ns, rows)
        self._shown = UInt64MultiArray(data=array("Q", (self.number, time_ns, rows)))
        self._publisher.publish(self._shown)

    def _on_proceed(self, msg: UInt64MultiArray, info: Mapping[str, Any]) -> None:
        try:
            self.answer(msg.data, info["publication_sequence_number"])
        except InputError as error:
            self._refuse(error)
            return
        self.go_on()

    def go_on(self) -> None:
        """See whether the gate is complete."""
        for one in self.drop_predecessors():
            given = "an input of a controller that ended before its answer"
            self._refuse(InputError(one.topic, given, "those of the one started since"))
        if self.is_complete:
            self._on_complete()

    def watch(self, now_ns: int) -> None:
        """Publish the gate again where an answer is missing; log what time waits for, once."""
        if self.look(now_ns):
            self._publisher.publish(self._shown)
        if words := self.newly_overdue(now_ns):
            wait = f"simulated time waits for longer than {self.timeout_ns / 1e9:g} s"
            self._node.get_logger().error(f"lockstep: {words}: {wait}")

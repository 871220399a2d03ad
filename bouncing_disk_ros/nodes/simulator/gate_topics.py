"""The topics of a lockstep: ~/gate says that simulated time stands, ~/proceed that it may go on."""

from __future__ import annotations

import time
from array import array
from collections.abc import Callable, Mapping

from rclpy.node import Node
from std_msgs.msg import UInt64MultiArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import Value, items_of
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.run.gates import Gates
from bouncing_disk_ros.run.time_map import nanoseconds
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
        super().__init__(numbers, 0)
        self._node, self._refuse, self._on_complete = node, refuse, on_complete
        self.set_timeout(values)
        gate, proceed = LOCKSTEP_TOPICS["~/gate"], LOCKSTEP_TOPICS["~/proceed"]
        self._publisher = node.create_publisher(UInt64MultiArray, gate.name, profile_of(gate))
        self._subscription = node.create_subscription(
            UInt64MultiArray, proceed.name, self._on_proceed, profile_of(proceed)
        )

    def set_timeout(self, values: Mapping[str, Value]) -> None:
        """Take over the parameter of the silence allowed."""
        self.timeout_ns = nanoseconds(float(values["lockstep_timeout"]))

    def destroy(self) -> None:
        """Take the topics away."""
        self._node.destroy_publisher(self._publisher)
        self._node.destroy_subscription(self._subscription)

    def publish(self, time_ns: int, rows: int) -> None:
        """Open a gate at an instant of simulated time, with so many rows of impacts published."""
        number = self.open(time.monotonic_ns())
        self._publisher.publish(UInt64MultiArray(data=array("Q", (number, time_ns, rows))))

    def _on_proceed(self, msg: UInt64MultiArray) -> None:
        try:
            self.answer(msg.data)
        except InputError as error:
            self._refuse(error)
            return
        self.go_on()

    def go_on(self) -> None:
        """See whether the gate is complete."""
        if self.is_complete:
            self._on_complete()

    def report(self) -> None:
        """Log, once for each gate, which controllers are silent."""
        for number in self.newly_silent(time.monotonic_ns()):
            self._node.get_logger().error(
                f"lockstep: controller {number} has said nothing at gate {self.number} for "
                f"{self.timeout_ns / 1e9:g} s: simulated time waits for it"
            )

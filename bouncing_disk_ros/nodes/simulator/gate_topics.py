"""The topics of a lockstep: ~/gate says that simulated time stands, ~/proceed that it may go on."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rclpy.node import Node
from std_msgs.msg import UInt64MultiArray

from bouncing_disk_ros.ros.numbered_subscription import WithInfo
from bouncing_disk_ros.ros.qos import publisher_of, subscription_to
from bouncing_disk_ros.topics import LOCKSTEP_TOPICS


class GateTopics:
    """The topics of a lockstep; `on_answer` is given an answer and its number on ~/proceed."""

    def __init__(self, node: Node, on_answer: Callable[[Iterable[int], int], object]) -> None:
        gate, proceed = LOCKSTEP_TOPICS["~/gate"], LOCKSTEP_TOPICS["~/proceed"]
        self._node, self._on_answer = node, on_answer
        self._publisher = publisher_of(node, gate)
        self._subscription = subscription_to(node, proceed, WithInfo(self._on_proceed))

    def destroy(self) -> None:
        """Take the topics away."""
        self._node.destroy_publisher(self._publisher)
        self._node.destroy_subscription(self._subscription)

    def publishers(self) -> int:
        """How many publishers ~/proceed has."""
        return self._node.count_publishers(self._subscription.topic_name)

    def announce(self, number: int, time_ns: int, rows: int) -> None:
        """Publish the number of a gate, its simulated time and rows."""
        self._publisher.publish(UInt64MultiArray(data=array("Q", (number, time_ns, rows))))

    def _on_proceed(self, msg: UInt64MultiArray, info: Mapping[str, Any]) -> None:
        self._on_answer(msg.data, info["publication_sequence_number"])

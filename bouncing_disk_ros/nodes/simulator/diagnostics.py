"""/diagnostics of the simulator: the health report once a second of the steady clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node

from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.run.health import Health, Reading, Status
from bouncing_disk_ros.topics import TOPICS


class Diagnostics:
    """Publishes a report on what `read` reads."""

    def __init__(self, node: Node, health: Health, read: Callable[[], Reading]) -> None:
        self._node, self._health, self._read = node, health, read
        self._full_name = node.get_fully_qualified_name().lstrip("/")
        topic = TOPICS["/diagnostics"]
        self._publisher = node.create_publisher(DiagnosticArray, topic.name, profile_of(topic))

    def publish(self, lateness: Mapping[str, float]) -> list[Status]:
        """Take a reading and publish the report on it."""
        report = self._health.report(self._read(), lateness)
        msg = DiagnosticArray(status=[self._to_msg(status) for status in report])
        msg.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(msg)
        return report

    def _to_msg(self, status: Status) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=bytes([status.level]),
            name=f"{self._full_name}: {status.task}",
            message=status.message,
            hardware_id=self._full_name,
            values=[KeyValue(key=key, value=value) for key, value in status.values.items()],
        )

"""/diagnostics of a node: a report in rows, as one message."""

from __future__ import annotations

from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.serialization import serialize_message

from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.run.health import Status
from bouncing_disk_ros.topics import TOPICS


class DiagnosticsPublisher:
    """Publishes reports; `last` is the newest message as it was sent."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._full_name = node.get_fully_qualified_name().lstrip("/")
        topic = TOPICS["/diagnostics"]
        self.publisher = node.create_publisher(DiagnosticArray, topic.name, profile_of(topic))
        self.last = b""

    def publish(self, report: Sequence[Status]) -> None:
        """Publish a report."""
        msg = DiagnosticArray(status=[self._to_msg(status) for status in report])
        msg.header.stamp = self._node.get_clock().now().to_msg()
        self.last = serialize_message(msg)
        self.publisher.publish(self.last)

    def _to_msg(self, status: Status) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=bytes([status.level]),
            name=f"{self._full_name}: {status.task}",
            message=status.message,
            hardware_id=self._full_name,
            values=[KeyValue(key=key, value=value) for key, value in status.values.items()],
        )

"""/diagnostics of a node: a report in rows, as one message."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.serialization import serialize_message

from bouncing_disk_ros.ros.qos import publisher_of
from bouncing_disk_ros.run.health import Status
from bouncing_disk_ros.topics import TOPICS


class DiagnosticsPublisher:
    """Publishes reports; `sent` holds the newest messages as they were sent."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._full_name = node.get_fully_qualified_name().lstrip("/")
        self.publisher = publisher_of(node, "/diagnostics")
        self.sent: deque[bytes] = deque(maxlen=TOPICS["/diagnostics"].qos.depth)

    def publish(self, report: Sequence[Status]) -> None:
        """Publish a report."""
        msg = DiagnosticArray(status=[self._to_msg(status) for status in report])
        msg.header.stamp = self._node.get_clock().now().to_msg()
        data = serialize_message(msg)
        data += bytes(-len(data) % 4)  # as DDS delivers it
        self.sent.append(data)
        self.publisher.publish(data)

    def _to_msg(self, status: Status) -> DiagnosticStatus:
        return DiagnosticStatus(
            level=bytes([status.level]),
            name=f"{self._full_name}: {status.task}",
            message=status.message,
            hardware_id=self._full_name,
            values=[KeyValue(key=key, value=value) for key, value in status.values.items()],
        )

"""/diagnostics of the simulator: the health report once a second; refusals, counted and logged."""

from __future__ import annotations

from collections.abc import Mapping

from rclpy.node import Node

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros.diagnostics_publisher import DiagnosticsPublisher
from bouncing_disk_ros.run.health import Health, Level, Reading
from bouncing_disk_ros.run.refusal_log import RefusalLog


class Diagnostics:
    """Publishes the health report of a run, and logs what has changed in it."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._health = Health()
        self._refusals = RefusalLog(node.get_logger().warning)
        self._levels: dict[str, Level] = {}
        self._publisher = DiagnosticsPublisher(node)

    def refuse(self, error: InputError) -> None:
        """Count a refused input; log it unless its reason was on the log a moment ago."""
        self._health.refuse(error)
        self._refusals.note(error)

    def publish(self, reading: Reading, lateness: Mapping[str, float]) -> None:
        """Publish the report on a reading, and log each task whose level has changed."""
        self._refusals.flush()
        report = self._health.report(reading, lateness)
        self._publisher.publish(report)
        for status in report:
            if self._levels.get(status.task, Level.OK) == status.level:
                continue
            self._levels[status.task] = status.level
            line = f"{status.task}: {status.message}"
            if status.level == Level.OK:  # rclpy wants a line of its own for each severity
                self._node.get_logger().info(line)
            else:
                self._node.get_logger().warning(line)

"""/diagnostics of the simulator: the health report once a second; refusals, counted and logged."""

from __future__ import annotations

from collections.abc import Mapping

from rclpy.node import Node

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros.diagnostics_publisher import DiagnosticsPublisher
from bouncing_disk_ros.ros.qos import publisher_of
from bouncing_disk_ros.ros.to_messages import named_numbers_to_msg
from bouncing_disk_ros.run.health import Health, Level, Reading, run_values
from bouncing_disk_ros.run.throttled_log import ThrottledLog


class Diagnostics:
    """Publishes the health report of a run, and logs what has changed in it."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._health = Health()
        logger = node.get_logger()
        self._refusals = ThrottledLog(logger.warning)
        # rclpy wants a line of source of its own for each severity
        self._accepted = ThrottledLog(lambda line: logger.info(line))
        self._remarks = ThrottledLog(lambda line: logger.warning(line))
        self._levels: dict[str, Level] = {}
        self._publisher = DiagnosticsPublisher(node)
        self._run_state = publisher_of(node, "disk/run_state")

    def note_refusal(self, error: InputError) -> None:
        """Count a refused input; log it unless its reason was on the log a moment ago."""
        self._health.count_refusal(error)
        self._refusals.note_refusal(error)

    def log_accepted(self, field: str, line: str, remark: str = "") -> None:
        """Log an accepted input unless one of its kind was on the log a moment ago."""
        if remark:
            self._remarks.note(field, lambda: f"accepted: {field}: {line}; {remark}")
        else:
            self._accepted.note(field, lambda: f"accepted: {field}: {line}")

    def publish(
        self, reading: Reading, lateness: Mapping[str, float], stamp_ns: int | None = None
    ) -> None:
        """Publish the report on a reading, and log each task whose level has changed.

        `stamp_ns`: of disk/run_state where time is simulated; None: now.
        """
        for lines in (self._refusals, self._accepted, self._remarks):
            lines.flush()
        report = self._health.report(reading, lateness)
        self._publisher.publish(report)
        stamp = self._node.get_clock().now().nanoseconds if stamp_ns is None else stamp_ns
        values = run_values(reading, self._health.refused)
        self._run_state.publish(named_numbers_to_msg(values, stamp))
        for status in report:
            if self._levels.get(status.task, Level.OK) == status.level:
                continue
            self._levels[status.task] = status.level
            line = f"{status.task}: {status.message}"
            if status.level == Level.OK:  # rclpy wants a line of its own for each severity
                self._node.get_logger().info(line)
            elif status.level == Level.WARN:
                self._node.get_logger().warning(line)
            else:
                self._node.get_logger().error(line)

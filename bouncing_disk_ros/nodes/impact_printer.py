"""The node of `echo_impacts`."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from uuid import uuid4

from rclpy.node import Node
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2

from bouncing_disk_ros.command_line.stdout import reader_is_gone
from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.errors import ExitCode, FailedError, InputError
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.report import impact_text
from bouncing_disk_ros.ros.from_messages import impacts_from_msg
from bouncing_disk_ros.ros.node_tool import options, wait_for
from bouncing_disk_ros.ros.qos import subscription_to
from bouncing_disk_ros.run.throttled_log import ThrottledLog
from bouncing_disk_ros.running_numbers import Gaps

PAGE = 40
"""Rows after which the heading is repeated."""
HINT_SECONDS = 5.0
"""A first wait longer than this is explained."""


class ImpactPrinter(Node):
    """Prints rows until it has printed what was asked."""

    def __init__(self, table: Mapping[str, Spec]) -> None:
        # a name of its own, as those of ros2 topic echo: several may run beside each other
        super().__init__(f"echo_impacts_{uuid4().hex[:8]}")
        values = options(self, table)
        self._once, self._csv = bool(values["once"]), bool(values["csv"])
        self._count, self._timeout = int(values["count"]), float(values["timeout"])
        self.printed = 0
        self._finished = False
        self._error: Exception | None = None
        self._last = time.monotonic()
        self._gaps = Gaps()
        self._refusals = ThrottledLog(_remark)
        self._subscription = subscription_to(self, "disk/impacts", self._on_impacts, raw=True)

    def print_all(self, stop: Stop) -> int:
        """Print until done, interrupted or out of patience; the exit code."""
        if self._csv:
            print(impact_text.csv_heading(), flush=True)
        limit = self._timeout or float("inf")
        if not wait_for(self, stop, self._is_over, min(HINT_SECONDS, limit)) and not stop.asked:
            if self.printed == 0:
                self._explain()
            wait_for(self, stop, self._is_over, float("inf"))
        if self._error is not None:
            raise self._error
        if not self._finished and not stop.asked:
            topic = self._subscription.topic_name
            raise FailedError(f"no impact on {topic} for {self._timeout:g} s")
        return ExitCode.DONE

    def _is_over(self) -> bool:
        late = self._timeout and time.monotonic() - self._last > self._timeout
        return bool(self._finished or self._error or late)

    def _explain(self) -> None:
        """Why nothing may have come."""
        topic = self._subscription.topic_name
        known = self.count_publishers(topic)
        why = "no impact yet" if known else "no node publishes it"
        domain = f"ROS_DOMAIN_ID {self.context.get_domain_id()}"
        print(f"echo_impacts: waiting for {topic} in {domain}: {why}", file=sys.stderr, flush=True)

    def _on_impacts(self, data: bytes) -> None:
        if self._finished or self._error is not None:
            return
        self._refusals.flush()
        try:
            self._print(_cloud(data))
        except InputError as error:  # a cloud that is none of a simulator: the next one may be
            self._refusals.note_refusal(error)
        except OSError as error:  # raised where the node's work ends in order
            self._error = error

    def _print(self, cloud: PointCloud2) -> None:
        rows = impacts_from_msg(cloud)
        if len(rows) == 0:
            return
        self._last = time.monotonic()
        remark = impact_text.lost_rows(self._gaps, rows)
        if remark:
            _remark(remark)
        if self._count:
            rows = rows[: self._count - self.printed]
        lines: list[str] = []
        for row in rows:
            if not self._csv and self.printed % PAGE == 0:
                lines.append(impact_text.heading())
            lines.append(impact_text.csv_line(row) if self._csv else impact_text.line(row))
            self.printed += 1
        print("\n".join(lines), flush=True)
        enough = self._count > 0 and self.printed >= self._count
        self._finished = self._once or enough or reader_is_gone()


def _cloud(data: bytes) -> PointCloud2:
    """The message of these bytes, or InputError: rclpy would end the node."""
    try:
        return deserialize_message(data, PointCloud2)
    except Exception:  # noqa: BLE001 (rclpy raises several private types)
        given = f"{len(data)} bytes"
        raise InputError("cloud", given, "a message of sensor_msgs/msg/PointCloud2") from None


def _remark(line: str) -> None:
    print(f"echo_impacts: {line}", file=sys.stderr, flush=True)

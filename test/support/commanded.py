"""The commands of a simulator without a middleware: serialized messages in, records out."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from rclpy.node import Node

from bouncing_disk_ros import parameters
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.nodes.simulator.commands import Commands
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.command_validation import Instant
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.run.work_turns import WorkTurns
from bouncing_disk_ros.units import NS

WALL_NS = 1_700_000_000 * NS
"""ROS time at simulated time 0."""


class NoNode:
    """Stands for a node: it subscribes to nothing, and logs nothing."""

    def create_subscription(self, _kind: type, topic: str, *_: Any, **__: Any) -> Any:
        return SimpleNamespace(topic_name=topic)

    def get_publishers_info_by_topic(self, _topic: str) -> list[Any]:
        return []

    def create_timer(self, _period: float, _callback: Any, **_: Any) -> Any:
        return SimpleNamespace(cancel=lambda: None)

    def get_logger(self) -> Any:
        return SimpleNamespace(debug=lambda _line: None)


class CommandedSession:
    """A session that is commanded as a simulator is; real time stands at its simulated time."""

    def __init__(self, **values: Value) -> None:
        self.records: list[Record] = []
        self.refused = 0
        self.lines: list[str] = []
        self.last: InputError | None = None
        self.session = Session(parameters.complete(values), self.records.append)
        node = cast("Node", NoNode())
        self.commands = Commands(node, self)
        self.commands.turns = WorkTurns(lambda: None, spent=lambda: 0)  # all acts at once

    def arrival(self, _field: str) -> tuple[Session, Instant]:
        times = TimeMap(0, 0, WALL_NS, 1.0, False)
        return self.session, Instant(self.session.input_ns, times, NS // 10)

    def hold(self, *_: object) -> bool:
        """There is no lockstep."""
        return False

    def publish_consequences(self) -> None:
        """Nobody subscribes to anything."""

    def refuse(self, error: InputError) -> None:
        """Count a refused input, and keep the last one."""
        self.refused += 1
        self.last = error

    def log_accepted(self, field: str, line: str, remark: str = "") -> None:
        """Keep the lines about accepted inputs."""
        self.lines.append(f"{field}: {line}; {remark}")

    def take(self, topic: str, data: bytes) -> bool:
        """A message of a command topic; False when it was refused."""
        return bool(self.commands.subscriptions[topic].take(data))

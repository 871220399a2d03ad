"""Nodes of the test itself: one hears and commands a simulator, one publishes to a recorder.

Every wait is for a condition: nothing is sent before the other side is matched, nothing sleeps.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
from std_srvs.srv import Trigger

from bouncing_disk_ros.core.model import join_rows
from bouncing_disk_ros.ros.from_messages import impacts_from_msg, time_to_ns
from bouncing_disk_ros.ros.qos import publisher_of, subscription_to
from bouncing_disk_ros.ros.to_messages import trajectory_to_msg
from bouncing_disk_ros.run.command_validation import PointRequest, ProgrammeRequest
from bouncing_disk_ros.run.input_records import Record, from_json
from bouncing_disk_ros.topics import TOPICS, Direction
from support.processes import wait_until
from support.ros import Nodes, overrides_of

RELIABLE = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)


class Peer(Nodes):
    """Hears every topic of the simulator in a namespace: `heard[topic]` is the list of messages."""

    def __init__(
        self,
        namespace: str = "",
        node: str = "bouncing_disk",
        without: tuple[str, ...] = ("/clock",),
    ) -> None:
        super().__init__()
        self.node = self.new_node("peer", namespace=namespace)
        self._simulator = node
        self._publishers: dict[str, Any] = {}
        self._records: list[Record] = []
        self.heard: dict[str, list[Any]] = {}
        for name, topic in TOPICS.items():
            if topic.direction is Direction.OUT and name not in without:
                self.heard[name] = []
                subscription_to(self.node, topic, self.heard[name].append)

    def settle(self) -> None:
        """Wait until all the topics have a publisher."""
        names = [name for name in self.heard if name not in ("/diagnostics", "/clock")]
        self.spin_until(lambda: all(self.node.count_publishers(name) for name in names))

    def spin_once(self) -> None:
        """Run what is due."""
        self.executor.spin_once(timeout_sec=0.0)

    def publisher(self, name: str) -> Any:
        """The publisher of a command topic, once somebody listens."""
        publisher = self._publishers.get(name)
        if publisher is None:
            publisher = self._publishers[name] = publisher_of(self.node, name)
        self.spin_until(lambda: publisher.get_subscription_count() > 0)
        return publisher

    def publish(self, name: str, msg: Any) -> None:
        """Publish on a command topic, once somebody listens."""
        self.publisher(name).publish(msg)

    def command(self, *points: tuple[float, dict[str, float]], stamp_ns: int = 0) -> None:
        """Publish a programme: (seconds after the stamp, {name: value}), the same names in each."""
        names = tuple(points[0][1]) if points else ()
        requests = tuple(
            PointRequest(tuple(values.values()), round(after * 1e9)) for after, values in points
        )
        msg = trajectory_to_msg(ProgrammeRequest(names, requests, stamp_ns))
        self.publish("platform/command", msg)

    def call(self, kind: type[Any], name: str, request: Any = None) -> Any:
        """Call a service of the simulator."""
        return self.call_of(self._simulator, name, kind, request)

    def set_parameters(self, **values: Any) -> Any:
        """Set parameters atomically; the result (successful, reason)."""
        from rcl_interfaces.srv import SetParametersAtomically

        request = SetParametersAtomically.Request()
        request.parameters = [one.to_parameter_msg() for one in overrides_of(values)]
        return self.call(SetParametersAtomically, "set_parameters_atomically", request).result

    def now_ns(self) -> int:
        """ROS time."""
        now: int = self.node.get_clock().now().nanoseconds
        return now

    def latest(self, topic: str) -> Any:
        """The newest message of a topic; waits for the first."""
        self.spin_until(lambda: self.heard[topic])
        return self.heard[topic][-1]

    @property
    def records(self) -> list[Record]:
        """All records of disk/inputs; each is read once."""
        new = self.heard["disk/inputs"][len(self._records) :]
        self._records += [from_json(msg.data) for msg in new]
        return self._records

    @property
    def rows(self) -> NDArray[np.void]:
        """All rows of disk/impacts."""
        return join_rows([impacts_from_msg(msg) for msg in self.heard["disk/impacts"]])

    @property
    def phases(self) -> list[str]:
        """All phases heard."""
        return [msg.data for msg in self.heard["disk/phase"]]

    def diagnostic(self, task: str, node: str = "bouncing_disk") -> tuple[int, str, dict[str, str]]:
        """Level, message and values of a task in the newest diagnostics of a node; waits for it."""
        name = f"{node}: {task}"

        def found() -> Any:
            messages = reversed(self.heard["/diagnostics"])
            return next((row for msg in messages for row in msg.status if row.name == name), None)

        self.spin_until(found)
        status = found()
        return status.level[0], status.message, {pair.key: pair.value for pair in status.values}

    def wait_for_record(self, kind: str) -> Record:
        """Wait until the newest record of an input is of a kind, and return it."""

        def newest() -> Record | None:  # snapshots come between
            return next((one for one in reversed(self.records) if one["kind"] != "snapshot"), None)

        self.spin_until(lambda: (found := newest()) is not None and found["kind"] == kind)
        found = newest()
        assert found is not None
        return found

    def next_diagnostics(self) -> None:
        """Wait for diagnostics of now: older ones, or another node's, may be on their way."""
        node, now = f"{self.node.get_namespace()}/{self._simulator}: ".lstrip("/"), self.now_ns()

        def is_heard() -> bool:
            return any(
                time_to_ns(msg.header.stamp) >= now
                and any(row.name.startswith(node) for row in msg.status)
                for msg in self.heard["/diagnostics"][-10:]
            )

        self.spin_until(is_heard)


class Talker(Nodes):
    """A node of the test that publishes and calls services."""

    def __init__(self) -> None:
        super().__init__()
        self.node = self.new_node("talker")

    def publisher(
        self, topic: str, kind: type[Any] = String, qos: QoSProfile = RELIABLE,
        node: Node | None = None,
    ) -> Publisher:  # fmt: skip
        """A publisher that the recorder hears."""
        publisher = (node or self.node).create_publisher(kind, topic, qos)
        wait_until(lambda: publisher.get_subscription_count() > 0)
        return publisher

    def call(self, name: str) -> str:
        """Call a service of the recorder; its message."""
        answer = self.call_of("/recorder", name, Trigger)
        assert answer.success
        return str(answer.message)

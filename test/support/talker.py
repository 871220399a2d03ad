"""A node of the test that publishes to a recorder and calls its services."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String
from std_srvs.srv import Trigger

from support.processes import PATIENCE
from support.ros import Nodes

RELIABLE = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


class Talker(Nodes):
    """A node of the test that publishes and calls services."""

    def __init__(self) -> None:
        super().__init__()
        self._clients: dict[str, Any] = {}
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
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self.node.create_client(Trigger, f"/recorder/{name}")
            self.spin_until(client.service_is_ready)
            self.meet(self.node, "/recorder")
        answer = self.call_service(client, Trigger.Request())
        assert answer.success
        return str(answer.message)

"""A node of the test that publishes to a recorder and calls its services."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String
from std_srvs.srv import Trigger

from support.processes import PATIENCE
from support.ros_peer import meet

RELIABLE = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


class Talker:
    """A node of the test that publishes and calls services."""

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=[], signal_handler_options=SignalHandlerOptions.NO)
        self.nodes: list[Node] = []
        self._clients: dict[str, Any] = {}
        self._executor = SingleThreadedExecutor(context=self.context)
        self.node = self.new_node("talker")

    def new_node(self, name: str, **options: Any) -> Node:
        """Another node; `options` are those of rclpy's Node."""
        node = rclpy.create_node(name, context=self.context, use_global_arguments=False, **options)
        self.nodes.append(node)
        self._executor.add_node(node)
        return node

    def publisher(
        self, topic: str, kind: type[Any] = String, qos: QoSProfile = RELIABLE,
        node: Node | None = None,
    ) -> Publisher:  # fmt: skip
        """A publisher that the recorder hears."""
        publisher = (node or self.node).create_publisher(kind, topic, qos)
        wait_until(lambda: publisher.get_subscription_count() > 0)
        return publisher

    def spin_until(self, condition: Callable[[], Any]) -> None:
        """Run the callbacks of the nodes until a condition holds."""
        end = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < end, "the condition did not hold"
            self._executor.spin_once(timeout_sec=0.02)

    def call(self, name: str) -> str:
        """Call a service of the recorder; its message."""
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self.node.create_client(Trigger, f"/recorder/{name}")
            self.spin_until(client.service_is_ready)
            meet(self.node, "/recorder", self.spin_until)
        future = client.call_async(Trigger.Request())
        self.spin_until(future.done)
        assert future.result().success
        return str(future.result().message)

    def close(self) -> None:
        self._executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        rclpy.shutdown(context=self.context)

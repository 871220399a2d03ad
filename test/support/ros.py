"""Nodes of the test itself, which look at and command those of other processes.

Every wait is for a condition: nothing is sent before the other side is matched, nothing sleeps.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from contextlib import redirect_stderr
from functools import partial
from typing import Any

import rclpy
from rcl_interfaces.srv import GetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions

from bouncing_disk_ros.nodes.simulator.simulator_node import SimulatorNode
from bouncing_disk_ros.ros.spin import EventsExecutor
from support.processes import PATIENCE, wait_until


def overrides_of(values: Mapping[str, Any]) -> list[Parameter]:
    """Parameters as a node takes them."""
    return [Parameter(name, value=value) for name, value in values.items()]


class Nodes:
    """Nodes in a context of their own, and the executor that runs their callbacks.

    It is that of the package's processes: it takes a third of the processor time of the other.
    """

    def __init__(self) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, args=[], signal_handler_options=SignalHandlerOptions.NO)
        with redirect_stderr(sys.__stderr__):  # it wants a file, which that of `pytest -s` is not
            self.executor = (EventsExecutor or SingleThreadedExecutor)(context=self.context)
        self.nodes: list[Node] = []
        self._clients: dict[str, Any] = {}

    def add(self, node: Node) -> None:
        """Run the callbacks of a node, and destroy it at the end."""
        self.nodes.append(node)
        self.executor.add_node(node)

    def new_node(self, name: str, **options: Any) -> Node:
        """Another node; `options` are those of rclpy's Node."""
        node = rclpy.create_node(name, context=self.context, use_global_arguments=False, **options)
        self.add(node)
        return node

    def simulator(
        self, node_name: str = "bouncing_disk", namespace: str = "", **values: Any
    ) -> SimulatorNode:
        """A simulator in real time, with parameters by name.

        It answers over DDS like a process of its own, without the seconds that one takes to start.
        """
        node = SimulatorNode(
            node_name, namespace=namespace, context=self.context,
            parameter_overrides=overrides_of(values), use_global_arguments=False,
        )  # fmt: skip
        self.add(node)
        return node

    def spin_until(
        self, condition: Callable[[], Any], timeout: float = PATIENCE, what: str = "the condition"
    ) -> None:
        """Run callbacks until a condition holds."""
        spin = partial(self.executor.spin_once, timeout_sec=0.02)
        wait_until(condition, spin, lambda: f"{what} did not hold", timeout)

    def meet(self, node: Node, target: str) -> None:
        """Wait until the node `target` knows all clients that another has made by now.

        The middleware drops the answer to a client that it does not know yet. Clients become known
        in the order in which they were made: one more is made, and asks until it is answered.
        """
        client = node.create_client(GetParameters, f"{target}/get_parameters")
        self.spin_until(client.service_is_ready)
        answers: list[Any] = []
        while not any(answer.done() for answer in answers):
            answers.append(client.call_async(GetParameters.Request()))
            end = time.monotonic() + 1.0
            self.spin_until(lambda: answers[-1].done() or time.monotonic() > end)  # noqa: B023
            assert len(answers) < PATIENCE, f"{target} does not answer"
        node.destroy_client(client)

    def call_service(self, client: Any, request: Any) -> Any:
        """The answer to a request."""
        future = client.call_async(request)
        self.spin_until(future.done)
        return future.result()

    def call_of(self, target: str, name: str, kind: type[Any], request: Any = None) -> Any:
        """The answer of a service of the node `target` to a request of the first node."""
        client = self._clients.get(name)
        if client is None:
            client = self._clients[name] = self.nodes[0].create_client(kind, f"{target}/{name}")
            self.spin_until(client.service_is_ready)
            self.meet(self.nodes[0], target)
        return self.call_service(client, kind.Request() if request is None else request)

    def close(self) -> None:
        """Leave the domain; again: nothing."""
        if not self.context.ok():
            return
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        rclpy.shutdown(context=self.context)


def wait_for_message(
    kind: type, topic: str, *, latched: bool = False, timeout: float = PATIENCE
) -> Any:
    """Return the first message of type `kind` that arrives on `topic`, in a context of its own."""
    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    received: list[Any] = []
    nodes = Nodes()
    nodes.new_node("test_listener").create_subscription(
        kind, topic, received.append, QoSProfile(depth=10, durability=durability)
    )
    try:
        nodes.spin_until(lambda: received, timeout, f"a message on {topic}")
        return received[0]
    finally:
        nodes.close()

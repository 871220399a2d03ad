"""Simulators in real time in the process of the test: a peer runs their callbacks.

They answer over DDS like a process of their own, without the seconds that one takes to start.
"""

from __future__ import annotations

from typing import Any

from rclpy.parameter import Parameter

from bouncing_disk_ros.nodes.simulator.simulator_node import SimulatorNode
from support.ros_peer import Peer


class LiveSimulators:
    """Makes simulators, and destroys them at the end."""

    def __init__(self) -> None:
        self._made: list[SimulatorNode] = []

    def __call__(
        self, peer: Peer, node_name: str = "bouncing_disk", namespace: str = "", **values: Any
    ) -> SimulatorNode:
        """A simulator with parameters by name, whose callbacks a peer runs."""
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        node = SimulatorNode(
            node_name, namespace=namespace, context=peer.context,
            parameter_overrides=overrides, use_global_arguments=False,
        )  # fmt: skip
        self._made.append(node)
        peer.add(node)
        return node

    def close(self) -> None:
        """Destroy them."""
        for node in self._made:
            node.destroy_node()

"""What the nodes of the small executables share: options from a table, and waiting."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

from rclpy.node import Node

from bouncing_disk_ros.command_line.start import option_values
from bouncing_disk_ros.command_line.stop import Stop
from bouncing_disk_ros.parameters import Spec, Value, items_of
from bouncing_disk_ros.ros.spin import spin_until
from bouncing_disk_ros.ros.validated_parameters import descriptor_of


def options(node: Node, table: Mapping[str, Spec]) -> dict[str, Value]:
    """Declare the options of a table on a node; unknown names and wrong values are InputErrors."""
    values = option_values(overrides_of(node), table)
    for name, spec in table.items():
        # an empty list has no type: a list of one empty text stands for it
        shown = (items_of(str(values[name])) or [""]) if spec.listed else values[name]
        node.declare_parameter(name, shown, descriptor_of(spec), True)
    return values


def overrides_of(node: Node) -> dict[str, object]:
    """What the command line and parameter files give a node."""
    return {name: override.value for name, override in node._parameter_overrides.items()}


def publishing_nodes(node: Node, topic: str) -> list[str]:
    """Full names of the nodes that publish a topic; those that rmw cannot name yet are left out."""
    return [
        f"{one.node_namespace.rstrip('/')}/{one.node_name}"
        for one in node.get_publishers_info_by_topic(node.resolve_topic_name(topic))
        if not one.node_name.startswith("_NODE_NAME_UNKNOWN")
    ]


def wait_for(node: Node, stop: Stop, condition: Callable[[], object], timeout: float) -> bool:
    """Run callbacks until a condition holds, a signal came or `timeout` seconds passed.

    Returns whether the condition holds.
    """
    end = time.monotonic() + timeout
    spin_until(node, lambda: bool(condition()) or stop.asked or time.monotonic() > end)
    return bool(condition())

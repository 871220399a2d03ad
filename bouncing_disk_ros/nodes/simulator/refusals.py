"""Refusals of the simulator's node that are not of one input alone, in words."""

from __future__ import annotations

from rclpy.node import Node

from bouncing_disk_ros.errors import InputError


def second_clock() -> InputError:
    """The refusal to be the second publisher of /clock."""
    hint = "Start it without publish_clock, or in another ROS_DOMAIN_ID."
    return InputError("publish_clock", True, "false: /clock has a publisher", hint)


def ended(node: Node, field: str) -> InputError:
    """The refusal of an input by a run that a fault has ended."""
    name = node.get_fully_qualified_name()
    hint = f"Start a new run: ros2 lifecycle set {name} deactivate, cleanup, configure, activate."
    return InputError(field, "an input after the run has ended", "inputs while a run goes on", hint)


def inactive(node: Node, field: str, state: str) -> InputError:
    """The refusal of an input by a node that is not active."""
    name = node.get_fully_qualified_name()
    hint = f"Activate it first: ros2 lifecycle set {name} activate."
    if state == "unconfigured":
        hint = f"First: ros2 lifecycle set {name} configure, then activate."
    return InputError(field, f"an input while {state}", "inputs while the node is active", hint)

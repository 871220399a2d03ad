"""A look at the topics of other processes, from within a test."""

from __future__ import annotations

import time
from typing import Any

from support.processes import PATIENCE


def wait_for_message(
    kind: type, topic: str, *, latched: bool = False, timeout: float = PATIENCE
) -> Any:
    """Return the first message of type `kind` that arrives on `topic`, in a context of its own."""
    import rclpy
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.qos import DurabilityPolicy, QoSProfile

    context = Context()
    rclpy.init(context=context)
    node = rclpy.create_node("test_listener", context=context)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    received: list[Any] = []
    node.create_subscription(
        kind, topic, received.append, QoSProfile(depth=10, durability=durability)
    )
    deadline = time.monotonic() + timeout
    try:
        while not received:
            assert time.monotonic() < deadline, f"no message on {topic} within {timeout} s"
            executor.spin_once(timeout_sec=0.05)
        return received[0]
    finally:
        executor.shutdown()
        node.destroy_node()
        context.try_shutdown()

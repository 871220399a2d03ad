"""Subscriptions that give serialized messages, and count those that did not arrive.

The middleware drops messages in silence when a reader's queue is full; its event of lost messages
says nothing of that. The numbers that each publisher gives its messages do.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.subscription import Subscription

from bouncing_disk_ros.ros.qos import subscription_to
from bouncing_disk_ros.running_numbers import Gids, MessageLoss
from bouncing_disk_ros.topics import Qos, Topic

_TWO_ARGUMENTS = inspect.Signature(
    [inspect.Parameter(name, inspect.Parameter.POSITIONAL_ONLY) for name in ("data", "info")]
)


class NumberedSubscription:
    """Subscribes to a topic; `take` gets each message as bytes, `lost` counts the others."""

    def __init__(self, node: Node, topic: Topic, take: Callable[[bytes], object]) -> None:
        self.topic = topic.name
        self.lost = MessageLoss(self._gids)
        self._node, self.take, self._row = node, take, topic
        self.number: int | None = None  # of the message taken last, as its publisher counts
        self._subscription = self._subscribe()

    def _subscribe(self) -> Subscription:
        return subscription_to(
            self._node, self._row, WithInfo(self.on_message), raw=True,
            event_callbacks=SubscriptionEventCallbacks(),
        )  # fmt: skip

    def set_qos(self, qos: Qos) -> None:
        """Subscribe anew where another quality of service is asked for."""
        if qos != self._row.qos:
            self._node.destroy_subscription(self._subscription)
            self._row = replace(self._row, qos=qos)
            self._subscription = self._subscribe()

    def _gids(self) -> Gids:
        found = self._node.get_publishers_info_by_topic(self._subscription.topic_name)
        return frozenset(bytes(info.endpoint_gid) for info in found)

    def on_message(self, data: bytes, info: dict[str, Any]) -> None:
        """A message with what the middleware says of it."""
        self.number = info["publication_sequence_number"]
        self.lost.note(self.number)
        self.take(data)


class WithInfo:
    """A callback with a message and what the middleware says of it, for any executor of rclpy.

    The events executor passes the two as one tuple, and crashes an ordinary callback of two.
    """

    __signature__ = _TWO_ARGUMENTS

    def __init__(self, take: Callable[[Any, dict[str, Any]], None]) -> None:
        self._take = take

    def __call__(self, *received: Any) -> None:
        """Pass on what an executor gives."""
        data, info = received if len(received) == 2 else received[0]
        self._take(data, info)

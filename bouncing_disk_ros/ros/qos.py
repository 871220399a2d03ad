"""Publishers and subscriptions of the topic table: their types, names and quality of service."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from bouncing_disk_ros.topics import TOPICS, Qos, Topic


def profile_of(qos: Qos | Topic) -> QoSProfile:
    """The rclpy profile of a row of the table."""
    qos = qos.qos if isinstance(qos, Topic) else qos
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST if qos.depth else HistoryPolicy.KEEP_ALL,
        depth=qos.depth,
        reliability=ReliabilityPolicy.RELIABLE if qos.reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if qos.latched else DurabilityPolicy.VOLATILE),
    )


def message_class(kind: str) -> type[Any]:
    """The class of a type package/msg/Name; ImportError, AttributeError: it is not installed."""
    package, folder, name = kind.split("/")
    found: type[Any] = getattr(import_module(f"{package}.{folder}"), name)
    return found


def publisher_of(node: Node, topic: Topic | str, name: str = "") -> Publisher:
    """A new publisher of a topic, or of the one in TOPICS; `name`: where another node has it."""
    row = TOPICS[topic] if isinstance(topic, str) else topic
    return node.create_publisher(message_class(row.type), name or row.name, profile_of(row))


def subscription_to(
    node: Node, topic: Topic | str, callback: Callable[..., object], name: str = "", **options: Any
) -> Subscription:
    """A new subscription, as `publisher_of`; `options` are those of rclpy."""
    row = TOPICS[topic] if isinstance(topic, str) else topic
    kind, profile = message_class(row.type), profile_of(row)
    return node.create_subscription(kind, name or row.name, callback, profile, **options)

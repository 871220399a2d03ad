"""Quality of service profiles of the topic table."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from bouncing_disk_ros.topics import Qos, Topic


def profile_of(qos: Qos | Topic) -> QoSProfile:
    """The rclpy profile of a row of the table."""
    qos = qos.qos if isinstance(qos, Topic) else qos
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST if qos.depth else HistoryPolicy.KEEP_ALL,
        depth=qos.depth,
        reliability=ReliabilityPolicy.RELIABLE if qos.reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if qos.latched else DurabilityPolicy.VOLATILE),
    )

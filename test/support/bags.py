"""Bags for tests: messages with exact bytes, written without ROS running."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import TwistStamped
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray, String

from bouncing_disk_ros import bag
from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.ros.to_messages import impacts_to_msg

START_NS = 1_700_000_000_123_456_789
STEP_NS = 1_000_000


Sent = bag.Message
"""One message given to the writer."""
TYPES = {
    "/disk/impacts": "sensor_msgs/msg/PointCloud2",
    "/joint_states": "sensor_msgs/msg/JointState",
    "/disk/rotor_speed": "geometry_msgs/msg/TwistStamped",
    "/disk/phase": "std_msgs/msg/String",
    "/numbers": "std_msgs/msg/Float64MultiArray",
    "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
}
QOS = bag.OfferedQos(durability="transient_local")


def impact_rows(first: int, count: int, seed: int = 0) -> NDArray[np.void]:
    """Rows with numbers of every kind in every field."""
    rng = np.random.default_rng(seed + first)
    rows = np.zeros(count, IMPACT_DTYPE)
    for name in IMPACT_DTYPE.names or ():
        rows[name] = rng.integers(0, 3, count) if name == "kind" else rng.normal(size=count) * 10
    rows["time"] = np.abs(rows["time"])
    rows["index"] = np.arange(first, first + count)
    rows["count"] = 1
    return rows


def message(topic: str, number: int) -> Any:
    """Message `number` of a topic; its content follows from both."""
    match topic:
        case "/disk/impacts":
            return impacts_to_msg(impact_rows(3 * number, 3), START_NS + number)
        case "/joint_states":
            values = [array("d", (0.5 * number, -float(part))) for part in range(3)]
            return JointState(name=["a", "b"], position=values[0], velocity=values[1],
                              effort=values[2])  # fmt: skip
        case "/disk/rotor_speed":
            twist = TwistStamped()
            twist.header.stamp.sec, twist.header.stamp.nanosec = number, 7
            twist.twist.angular.z = 1.5 * number
            return twist
        case "/disk/phase":
            return String(data=f"flight ü {number}")
        case _:
            return Float64MultiArray(data=array("d", np.arange(20.0) + number))


def messages(count: int = 100) -> Iterator[Sent]:
    """Messages of all topics but /diagnostics in turn, a millisecond between them."""
    topics = [topic for topic in TYPES if topic != "/diagnostics"]
    for place in range(count):
        topic, number = topics[place % len(topics)], place // len(topics)
        time_ns = START_NS + place * STEP_NS
        data = serialize_message(message(topic, number))
        yield Sent(topic, time_ns, time_ns - 1000, number + 1, data)


def read(path: Path) -> list[bag.Message]:
    """The messages of a bag."""
    with bag.open(path) as run:
        return list(run.messages())


def write(writer: bag.Writer, sent: list[Sent]) -> None:
    """Give messages to a writer, with their topics and one that stays empty."""
    for topic, kind in TYPES.items():
        writer.add_topic(topic, kind, [QOS])
    for row in sent:
        writer.write(row.topic, row.data, row.log_time_ns, row.publish_time_ns, row.sequence)


def make(folder: Path, sent: list[Sent], **options: Any) -> Path:
    """A bag of messages; its folder."""
    with bag.Writer(folder, bag.Options(**options), version="1.2.3") as writer:
        writer.attach("parameters.yaml", "text/yaml", b"friction: 0.6\n")
        write(writer, sent)
    return folder

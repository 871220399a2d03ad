"""The frames of one disk: their names, the robot description (URDF) with them, and /tf."""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping
from typing import Any, NamedTuple
from xml.etree import ElementTree as ET

from geometry_msgs.msg import TransformStamped
from rclpy.node import Node
from std_msgs.msg import String

from bouncing_disk_ros.core.model import Sample
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.folders import share_directory
from bouncing_disk_ros.parameters import TABLE, Value, complete
from bouncing_disk_ros.ros.qos import publisher_of
from bouncing_disk_ros.ros.to_messages import ns_to_time
from bouncing_disk_ros.topics import TRANSFORM_TOPICS

IMPACTS_PLACE = (0.5, 0.0, 0.5)
"""Where the next-collision section is shown, in the world's frame (m)."""
_LENGTHS = ("radius", "length", "size", "xyz")
"""Attributes of a shape's origin and geometry that are lengths."""


class Frames(NamedTuple):
    """Full names of the frames, the prefix included; by default as in the URDF file."""

    world: str = "world"
    platform: str = "platform"
    disk: str = "disk"
    impacts: str = "next_collision"

    @classmethod
    def of(cls, values: Mapping[str, Value]) -> Frames:
        """The frames of a set of parameters."""
        prefix = str(values["frame_prefix"])
        return cls(*(prefix + str(values[f"{name}_frame"]) for name in cls._fields))

    @property
    def platform_carriage(self) -> str:
        """The frame that moves with the platform but does not turn with it."""
        return f"{self.platform}_carriage"

    @property
    def disk_carriage(self) -> str:
        """The frame that moves with the disk but does not turn with it."""
        return f"{self.disk}_carriage"

    @property
    def links(self) -> dict[str, str]:
        """Name of a link in the URDF file -> the frame."""
        names = ("world", "platform_carriage", "platform", "disk_carriage", "disk")
        return {name: getattr(self, name) for name in names} | {"next_collision": self.impacts}


def robot_description(values: Mapping[str, object]) -> str:
    """The URDF of platform and disk: links named as the frames, sizes of this disk.

    The file draws the disk of the default parameters, a uniform one; all its lengths go with the
    radius of gyration. `values` may be any part of the parameters.
    """
    whole = complete(values)
    links = Frames.of(whole).links
    scale = float(whole["gyration_radius"]) / float(TABLE["gyration_radius"].default)
    root = ET.parse(share_directory() / "urdf" / "bouncing_disk.urdf").getroot()  # noqa: S314 (ours)
    for link in root.iter("link"):
        link.set("name", links[link.attrib["name"]])
    for tag in ("parent", "child"):
        for end in root.iter(tag):
            end.set("link", links[end.attrib["link"]])
    for visual in root.iter("visual"):
        for element in visual.iter():
            _scale(element, scale)
    return ET.tostring(root, encoding="unicode")


def _scale(element: ET.Element, scale: float) -> None:
    """Multiply the lengths among the attributes of an element."""
    for name in _LENGTHS:
        if name in element.attrib:
            lengths = (scale * float(length) for length in element.attrib[name].split())
            element.set(name, " ".join(f"{length:.9g}" for length in lengths))


# ------------------------------------------------------------------------------------------------
# The transforms of platform and disk as the node itself publishes them: /tf and the URDF.


def tf_message() -> Any:
    """The class tf2_msgs/msg/TFMessage, or InputError where it is not installed."""
    try:
        return importlib.import_module("tf2_msgs.msg").TFMessage
    except ImportError:
        hint = "Without tf2_msgs (sudo apt install ros-jazzy-tf2-msgs), use robot_state_publisher."
        raise InputError("publish_tf", True, "false: tf2_msgs is not there", hint) from None


class TransformPublisher:
    """Publishes the frames of one disk on /tf, and once its robot_description.

    The frames are those that robot_state_publisher makes of joint_states and the same URDF.
    """

    def __init__(self, node: Node, values: Mapping[str, Value]) -> None:
        self._kind = tf_message()
        self._messages = TransformMessages(Frames.of(values))
        self._tf = publisher_of(node, TRANSFORM_TOPICS["/tf"])
        self._description = publisher_of(node, TRANSFORM_TOPICS["robot_description"])
        self._description.publish(String(data=robot_description(values)))
        self.publishers = [self._tf, self._description]

    def publish(self, sample: Sample, stamp_ns: int) -> None:
        """Publish the transforms of a sample."""
        self._tf.publish(self._kind(transforms=self._messages.fill(sample, stamp_ns)))


class TransformMessages:
    """Transforms of one disk, filled in place (much cheaper than new ones)."""

    def __init__(self, frames: Frames) -> None:
        rows = (
            (frames.world, frames.platform_carriage),
            (frames.platform_carriage, frames.platform),
            (frames.world, frames.disk_carriage),
            (frames.disk_carriage, frames.disk),
            (frames.world, frames.impacts),
        )
        self._all = [TransformStamped() for _ in rows]
        for msg, (parent, child) in zip(self._all, rows, strict=True):
            msg.header.frame_id, msg.child_frame_id = parent, child
        place = self._all[4].transform.translation
        place.x, place.y, place.z = IMPACTS_PLACE

    def fill(self, sample: Sample, stamp_ns: int) -> list[TransformStamped]:
        """The transforms of a sample; valid until the next call."""
        stamp = ns_to_time(stamp_ns)
        for msg in self._all:
            msg.header.stamp = stamp
        platform, platform_turn, disk, disk_turn, _ = (msg.transform for msg in self._all)
        platform.translation.z = sample.platform_position
        disk.translation.z = sample.axial_position
        _turn(platform_turn.rotation, sample.platform_angle)
        _turn(disk_turn.rotation, sample.angle)  # without whole turns
        return self._all


def _turn(rotation: Any, angle: float) -> None:
    """Set a quaternion to a rotation about the vertical axis."""
    rotation.z, rotation.w = math.sin(0.5 * angle), math.cos(0.5 * angle)

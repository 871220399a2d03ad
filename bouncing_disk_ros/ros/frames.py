"""Names of the coordinate frames of one disk, and its robot description (URDF) with these names.

Imports nothing of ROS, so that a launch file may use it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple
from xml.etree import ElementTree as ET

from bouncing_disk_ros.folders import share_directory
from bouncing_disk_ros.parameters import TABLE, Value, complete

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

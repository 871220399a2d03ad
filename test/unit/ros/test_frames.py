"""Frames, the URDF with their names and this disk's sizes, and the transforms of a sample."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from xml.etree import ElementTree as ET

import pytest

from bouncing_disk_ros import parameters
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros.transforms import (
    IMPACTS_PLACE,
    Frames,
    TransformMessages,
    robot_description,
    tf_message,
)
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.topics import IMPACT_FRAME, WORLD_FRAME
from bouncing_disk_ros.units import NS


def test_frames_are_the_parameters_behind_their_prefix() -> None:
    assert Frames.of(parameters.DEFAULTS) == Frames()
    assert (Frames().world, Frames().impacts) == (WORLD_FRAME, IMPACT_FRAME)
    values = parameters.complete({"frame_prefix": "a/", "disk_frame": "rotor"})
    assert Frames.of(values) == ("a/world", "a/platform", "a/rotor", "a/next_collision")


@pytest.mark.parametrize(
    ("field", "given"),
    [
        ("disk_frame", ""),
        ("disk_frame", "/disk"),
        ("world_frame", "a b"),
        ("frame_prefix", "/a/"),
        ("frame_prefix", "a\x00"),
        ("disk_frame", "platform"),
        ("impacts_frame", "disk_carriage"),
    ],
)
def test_frames_that_tf2_would_not_take_are_refused(field: str, given: str) -> None:
    with pytest.raises(InputError) as refused:
        parameters.complete({field: given})
    assert (refused.value.field, refused.value.given) == (field, given)


def radius(description: str, link: str) -> float:
    found = ET.fromstring(description).find(f"link[@name='{link}']/visual/geometry/cylinder")
    assert found is not None
    return float(found.attrib["radius"])


def test_the_disk_is_drawn_in_its_size_and_the_section_stays_where_it_is() -> None:
    """A uniform disk of radius r has the radius of gyration r/√2."""
    sets: list[Mapping[str, parameters.Value]] = [{}, load_preset("swum"), {"gyration_radius": 3.0}]
    for values in sets:
        gyration = float(parameters.complete(values)["gyration_radius"])
        text = robot_description(values)
        assert radius(text, "disk") == pytest.approx(gyration * math.sqrt(2.0), rel=1e-6)
        assert radius(text, "platform") > radius(text, "disk")
    joint = ET.fromstring(robot_description({"gyration_radius": 3.0})).find(
        "joint[@name='next_collision_place']/origin"
    )
    assert joint is not None
    assert tuple(map(float, joint.attrib["xyz"].split())) == IMPACTS_PLACE


def test_transforms_are_those_of_the_sample() -> None:
    session = Session(parameters.complete({"initial_angular_velocity": 30.0}), lambda _: None)
    session.advance(NS)
    sample = session.simulation.sample()
    assert abs(sample.unwrapped_angle) > math.tau
    messages = TransformMessages(Frames())
    messages.fill(sample, 0)
    by_child = {msg.child_frame_id: msg for msg in messages.fill(sample, 5 * NS + 7)}
    assert {(m.header.stamp.sec, m.header.stamp.nanosec) for m in by_child.values()} == {(5, 7)}
    heights = (sample.platform_position, sample.axial_position)
    for name, height in zip(("platform_carriage", "disk_carriage"), heights, strict=True):
        assert by_child[name].transform.translation.z == height
    angles = (sample.platform_angle, sample.unwrapped_angle)
    for name, angle in zip(("platform", "disk"), angles, strict=True):
        turn = by_child[name].transform.rotation
        assert (turn.x, turn.y) == (0.0, 0.0)
        turned = 2.0 * math.atan2(turn.z, turn.w)
        assert math.cos(turned) == pytest.approx(math.cos(angle), abs=1e-12)
        assert math.sin(turned) == pytest.approx(math.sin(angle), abs=1e-12)
    place = by_child["next_collision"].transform.translation
    assert (place.x, place.y, place.z) == IMPACTS_PLACE


def test_without_tf2_msgs_the_transforms_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "tf2_msgs", None)
    monkeypatch.delitem(sys.modules, "tf2_msgs.msg", raising=False)
    with pytest.raises(InputError, match=r"publish_tf: got True, allowed: false: tf2_msgs is not"):
        tf_message()

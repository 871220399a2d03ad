"""The bytes of the command topics as requests: as rclpy reads them, within limits, else refused."""

from __future__ import annotations

import contextlib
import math
import re
import struct
from array import array
from collections.abc import Callable
from typing import Any

import pytest
from geometry_msgs.msg import WrenchStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Float64, Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import COMMAND_BYTES, COMMAND_NAMES, COMMAND_POINTS
from bouncing_disk_ros.ros import from_messages
from bouncing_disk_ros.ros import to_messages as c
from bouncing_disk_ros.ros.command_bytes import (
    impulse_from_bytes,
    programme_from_bytes,
    trajectory_from_bytes,
    value_from_bytes,
)
from bouncing_disk_ros.run.command_validation import ImpulseRequest, PointRequest, ProgrammeRequest
from bouncing_disk_ros.run.trajectory_validation import TrajectoryRequest
from bouncing_disk_ros.topics import MOTION_NAMES, OFFSET_JOINTS
from bouncing_disk_ros.units import NS
from reference.cases import examples
from support.checks import refused

finite = st.floats(allow_nan=False, allow_infinity=False)
stamps = st.integers(-(2**31) * NS, (2**31) * NS - 1)
texts = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=20)
LITTLE = b"\x00\x01\x00\x00"


def programme(data: bytes) -> ProgrammeRequest:
    return programme_from_bytes("platform/command", data)


def impulse(data: bytes) -> ImpulseRequest:
    return impulse_from_bytes("disk/impulse", data)


def value(data: bytes) -> ProgrammeRequest:
    return value_from_bytes("frequency", "platform/frequency", data)


READERS: dict[type[Any], Callable[[bytes], Any]] = {
    JointTrajectory: programme,
    WrenchStamped: impulse,
    Float64: value,
}


# --- pairs ----------------------------------------------------------------------------------------


numbers = st.lists(finite, max_size=4).map(tuple)


@given(
    names=st.lists(st.sampled_from(OFFSET_JOINTS), max_size=4),
    points=st.lists(st.builds(PointRequest, numbers, stamps, numbers, numbers, st.just(False)),
                    max_size=4),
    stamp=stamps,
)  # fmt: skip
def test_trajectories_come_back(names: list[str], points: list[PointRequest], stamp: int) -> None:
    request = TrajectoryRequest(tuple(names), tuple(points), stamp)
    data = serialize_message(c.trajectory_to_msg(request))
    assert trajectory_from_bytes(request.field, data) == request
    for length in range(4, len(data) - 3, 7):
        with contextlib.suppress(InputError):  # what ends between two points may be a whole one
            trajectory_from_bytes(request.field, data[:length])


@given(st.tuples(finite, finite, finite), st.tuples(finite, finite, finite), stamps)
def test_impulses_come_back(
    force: tuple[float, float, float], torque: tuple[float, float, float], stamp: int
) -> None:
    request = ImpulseRequest(force, torque, stamp)
    assert impulse(serialize_message(c.impulse_to_msg(request))) == request


def test_numbers_may_be_in_the_other_order_of_bytes() -> None:
    assert value(b"\0\0\0\0" + struct.pack(">d", 2.5)).points[0].positions == (2.5,)
    frame, name = b"\0\0\0\x02a\0\0\0", b"\0\0\0\x02b\0\0\0"
    point = struct.pack(">I4xdIIIiI", 1, 0.25, 0, 0, 0, 3, 4)
    data = b"\0\0\0\0" + struct.pack(">iI", 1, 2) + frame + b"\0\0\0\1" + name
    request = programme(data + b"\0\0\0\1" + point)
    assert request == ProgrammeRequest(("b",), (PointRequest((0.25,), 3 * NS + 4),), NS + 2)


# --- against rclpy --------------------------------------------------------------------------------
lists = st.lists(st.floats(), max_size=4).map(lambda values: array("d", values))


@st.composite
def trajectories(draw: st.DrawFn) -> JointTrajectory:
    """Messages with every field in use, names and frames of any length."""
    kinds = ("positions", "velocities", "accelerations", "effort")
    used = draw(st.sets(st.sampled_from(kinds)))
    points = []
    for _ in range(draw(st.integers(0, 4))):
        fields = {kind: draw(lists) if kind in used else array("d") for kind in kinds}
        points.append(JointTrajectoryPoint(**fields))
        points[-1].time_from_start = c.ns_to_duration(draw(stamps))
    header = Header(stamp=c.ns_to_time(draw(stamps)), frame_id=draw(texts))
    names = draw(st.lists(texts, max_size=4))
    return JointTrajectory(header=header, joint_names=names, points=points)


def same(first: tuple[float, ...], second: Any) -> bool:
    return struct.pack(f"{len(first)}d", *first) == struct.pack(f"{len(second)}d", *second)


@settings(max_examples=examples(30))
@given(trajectories())
def test_every_field_is_read_as_rclpy_reads_it(sent: JointTrajectory) -> None:
    data = serialize_message(sent)
    msg, request = deserialize_message(data, JointTrajectory), programme(data)
    assert request.names == tuple(msg.joint_names)
    assert request.stamp_ns == from_messages.time_to_ns(msg.header.stamp)
    assert len(request.points) == len(msg.points)
    for point, wanted in zip(request.points, msg.points, strict=True):
        assert same(point.positions, wanted.positions)
        assert point.after_ns == from_messages.time_to_ns(wanted.time_from_start)
        assert same(point.velocities, wanted.velocities)
        assert same(point.accelerations, wanted.accelerations)
        assert point.has_effort == bool(wanted.effort)


@pytest.mark.parametrize("kind", READERS, ids=lambda kind: kind.__name__)
@given(data=st.binary(max_size=200), whole=st.booleans())
def test_any_bytes_are_read_or_refused(kind: type[Any], data: bytes, whole: bool) -> None:
    with contextlib.suppress(InputError):
        READERS[kind](LITTLE + data if whole else data)


@pytest.mark.parametrize("kind", READERS, ids=lambda kind: kind.__name__)
def test_a_message_cut_anywhere_is_refused(kind: type[Any]) -> None:
    msg = kind()
    if kind is JointTrajectory:
        points = [JointTrajectoryPoint(positions=[1.0]), JointTrajectoryPoint(effort=[1.0, 2.0])]
        msg = JointTrajectory(joint_names=["frequency"], points=points)
    whole = serialize_message(msg)
    lengths = [length for length in range(len(whole) + 1) if is_read(kind, whole[:length])]
    assert lengths == list(range(lengths[0], len(whole) + 1))
    for length in lengths:  # rclpy pads
        assert READERS[kind](whole[:length]) == READERS[kind](whole)
        deserialize_message(whole[:length], kind)


def is_read(kind: type[Any], data: bytes) -> bool:
    try:
        READERS[kind](data)
    except InputError as error:
        return not re.search("bytes that end too early|encoding of ROS 2", error.line)
    return True


# --- sizes ----------------------------------------------------------------------------------------
def test_sizes_are_refused_before_anything_is_read() -> None:
    names = serialize_message(JointTrajectory(joint_names=["x"] * (COMMAND_NAMES + 1)))
    refused(r"joint_names: got '5 of them', allowed: at most 4", programme, names)
    points = serialize_message(
        JointTrajectory(points=[JointTrajectoryPoint()] * (COMMAND_POINTS + 1))
    )
    refused(r"points: got '1001 of them', allowed: at most 1000", programme, points)
    numbers = JointTrajectoryPoint(positions=array("d", [0.0] * 5))
    with pytest.raises(InputError, match=r"points\[0\].positions: got '5 of them'"):
        programme(serialize_message(JointTrajectory(points=[numbers])))
    for read in READERS.values():
        with pytest.raises(InputError, match=f"bytes', allowed: at most {COMMAND_BYTES} bytes"):
            read(LITTLE + bytes(COMMAND_BYTES))
    header = LITTLE + struct.pack("<iII4x", 0, 0, 1)
    for count in (COMMAND_NAMES + 1, 10**6, 2**32 - 1):
        refused("joint_names", programme, header + struct.pack("<I", count))
        refused("points", programme, header + struct.pack("<II", 0, max(count, COMMAND_POINTS + 1)))


def test_a_long_name_is_cut_and_the_most_points_are_within_the_limit_of_bytes() -> None:
    name = MOTION_NAMES[0] + "x" * 50_000
    (read,) = programme(serialize_message(JointTrajectory(joint_names=[name]))).names
    assert len(read) < 200
    assert read not in MOTION_NAMES
    points = [
        JointTrajectoryPoint(positions=[0.1] * COMMAND_NAMES, time_from_start=c.ns_to_duration(i))
        for i in range(COMMAND_POINTS)
    ]
    data = serialize_message(JointTrajectory(joint_names=list(MOTION_NAMES), points=points))
    assert len(programme(data).points) == COMMAND_POINTS
    assert math.isclose(len(data), 72_100, rel_tol=0.01)

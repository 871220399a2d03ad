"""x_to_msg and msg_to_x are inverse, keep every bit, and refuse what they do not know."""

from __future__ import annotations

import math
from array import array
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState, PointCloud2, PointField
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros.core.model import IMPACT_DTYPE, Motion, MotionInForce, Phase, Sample
from bouncing_disk_ros.ros import from_messages
from bouncing_disk_ros.ros import to_messages as c
from bouncing_disk_ros.units import NS
from support.checks import refused

NAN, INF = math.nan, math.inf
finite = st.floats(allow_nan=False, allow_infinity=False)
stamps = st.integers(-(2**31) * NS, (2**31) * NS - 1)


def rows(count: int) -> np.ndarray[Any, Any]:
    rng = np.random.default_rng(1)
    data = np.zeros(count, IMPACT_DTYPE)
    for name in IMPACT_DTYPE.names or ():
        data[name] = rng.integers(0, 3, count) if name == "kind" else rng.normal(size=count) ** 2
    data["index"] = np.arange(count)
    return data


def wired(msg: Any) -> Any:
    """The message as another process receives it."""
    return deserialize_message(serialize_message(msg), type(msg))


# --- time -----------------------------------------------------------------------------------------
@given(stamps)
def test_stamps_come_back(stamp: int) -> None:
    assert from_messages.time_to_ns(c.ns_to_time(stamp)) == stamp
    assert from_messages.time_to_ns(c.ns_to_duration(stamp)) == stamp


def test_motion_in_force_comes_back_and_stamps_end_where_the_message_does() -> None:
    assert c.ns_to_time(10**19) == c.ns_to_time(2**31 * NS - 1)
    assert c.ns_to_time(-(10**19)).sec == -(2**31)
    start, target = Motion(0.1, 0.2, 3.0, 0.4), Motion(0.5, 0.6, 5.0, -0.8)
    motion = MotionInForce(2 * NS, 2 * NS + NS // 2, start, target, 6, 1.5)
    assert from_messages.msg_to_motion(wired(c.motion_to_msg(motion, 99))) == motion


# --- impacts --------------------------------------------------------------------------------------
@pytest.mark.parametrize("count", [1, 2, 1000])
def test_impacts_come_back_bit_for_bit(count: int) -> None:
    sent = rows(count)
    cloud = wired(c.impacts_to_msg(sent, 5 * NS + 7))
    assert from_messages.impacts_from_msg(cloud).tobytes() == sent.tobytes()
    assert from_messages.time_to_ns(cloud.header.stamp) == 5 * NS + 7
    assert cloud.header.frame_id == "next_collision"


def test_layout_of_the_cloud_is_that_of_the_contract() -> None:
    cloud = c.impacts_to_msg(rows(3), 0)
    assert (cloud.point_step, cloud.width, cloud.height, cloud.is_bigendian) == (112, 3, 1, False)
    assert cloud.point_step % 8 == 0
    fields = [(f.name, f.offset, f.datatype) for f in cloud.fields]
    assert fields[:4] == [
        ("x", 0, PointField.FLOAT32),
        ("y", 4, PointField.FLOAT32),
        ("z", 8, PointField.FLOAT32),
        ("count", 12, PointField.UINT32),
    ]
    names = (
        "index time cycles forcing_phase axial_impact_velocity angular_impact_velocity "
        "axial_impulse angular_impulse axial_position axial_velocity angular_velocity"
    )
    assert [name for name, *_ in fields[4:-1]] == names.split()
    assert [offset for _, offset, _ in fields[4:-1]] == list(range(16, 104, 8))
    assert {datatype for *_, datatype in fields[4:-1]} == {PointField.FLOAT64}
    assert fields[-1] == ("kind", 104, PointField.UINT8)


def test_impacts_are_a_view_that_cannot_be_written() -> None:
    cloud = c.impacts_to_msg(rows(2), 0)
    view = from_messages.impacts_from_msg(cloud)
    assert np.shares_memory(view, np.frombuffer(cloud.data, np.uint8))
    with pytest.raises(ValueError, match="read-only"):
        view["index"] = 0


def spoilt(**changes: Any) -> PointCloud2:
    cloud = wired(c.impacts_to_msg(rows(2), 0))
    for name, value in changes.items():
        setattr(cloud, name, value)
    return cloud


@pytest.mark.parametrize(
    ("cloud", "message"),
    [
        (spoilt(fields=[]), "cloud fields"),
        (spoilt(is_bigendian=True), "cloud layout"),
        (spoilt(point_step=120), "cloud data"),
        (spoilt(point_step=0), "cloud fields"),
        (spoilt(width=3), "cloud data: got '224 bytes', allowed: 3 rows"),
        (spoilt(data=array("B", b"abc")), "cloud data"),
    ],
)
def test_other_clouds_are_refused(cloud: PointCloud2, message: str) -> None:
    refused(message, from_messages.impacts_from_msg, cloud)


@pytest.mark.parametrize(
    "wrong", [np.zeros(0, IMPACT_DTYPE), np.zeros(3), np.zeros((2, 2), IMPACT_DTYPE)]
)
def test_an_empty_or_foreign_array_is_never_sent(wrong: np.ndarray[Any, Any]) -> None:
    refused("nonempty array of IMPACT_DTYPE", c.impacts_to_msg, wrong, 0)


# --- states ---------------------------------------------------------------------------------------
SAMPLE = Sample(
    NS, Phase.FLIGHT, 3, 0.5, 0.1, 0.2, 0.3, 0.4, 0.05, 0.15, -0.6, 7, 1.25, 9.0, 2.5, -0.75
)


def test_a_sample_becomes_four_joints() -> None:
    msg = wired(c.fill_joint_state(c.new_joint_state(), SAMPLE, 12 * NS + 34))
    assert from_messages.time_to_ns(msg.header.stamp) == 12 * NS + 34
    assert from_messages.msg_to_joints(msg) == {
        "disk_axial": (0.15, -0.6, 2.5),
        "disk_rotation": (14 * math.pi + 1.25, 9.0, -0.75),
        "platform_axial": (0.1, 0.2, -2.5),
        "platform_rotation": (0.3, 0.4, 0.75),
    }


def test_a_reused_message_equals_a_new_one_and_no_force_has_a_sign() -> None:
    reused = c.fill_joint_state(c.new_joint_state(), SAMPLE, 1)
    later = SAMPLE._replace(time_ns=2 * NS, gap=0.0, axial_force=0.0, friction_torque=0.0)
    msg = c.fill_joint_state(reused, later, 2)
    assert msg == c.fill_joint_state(c.new_joint_state(), later, 2)
    assert [math.copysign(1.0, effort) for effort in msg.effort] == [1.0] * 4


def test_joints_of_other_lengths_are_refused() -> None:
    refused("joint_states", from_messages.msg_to_joints, JointState(name=["a"], position=[1.0]))


def test_mean_speed_keeps_its_digits_after_a_million_turns() -> None:
    first = SAMPLE._replace(turns=10**6, angle=3.0)
    second = SAMPLE._replace(
        time_ns=NS + NS // 10, turns=10**6 + 1, angle=-3.0, axial_position=0.25
    )
    axial, angular = first.mean_speeds(second)
    assert axial == pytest.approx(1.0, rel=1e-15)
    assert angular == pytest.approx((math.tau - 6.0) / 0.1, rel=1e-15)


@given(finite, finite, stamps)
def test_speeds_come_back(axial: float, angular: float, stamp: int) -> None:
    assert from_messages.msg_to_speed(wired(c.speed_to_msg((axial, angular), stamp))) == (
        axial,
        angular,
    )


def test_the_end_of_a_cross_fade_lies_the_mean_frequency_on() -> None:
    start, target = Motion(0.1, 0.2, 3.0, 0.4), Motion(0.1, 0.2, 5.0, 0.4)
    msg = c.motion_to_msg(MotionInForce(0, NS, start, target, 0, math.pi), 0)
    end = dict(zip(msg.joint_names, msg.points[1].positions, strict=True))
    assert end["cycles"] == 4.0  # half a cycle and (3 + 5) / 2 cycles
    assert end["forcing_phase"] == pytest.approx(math.pi, rel=1e-12)
    assert end["simulated_time"] == 1.0


@pytest.mark.parametrize(
    ("place", "value"),
    [(0, NAN), (3, INF), (5, 1e19), (6, -INF), (2, 0.0), (2, -3.0), (6, 1e300)],
)
def test_numbers_that_no_motion_has_are_refused(place: int, value: float) -> None:
    start, target = Motion(0.01, 0.2, 3.0, 0.1), Motion(0.02, 0.3, 5.0, -0.1)
    for point in (0, 1):
        msg = c.motion_to_msg(MotionInForce(0, NS, start, target, 6, 1.5), 0)
        msg.points[point].positions[place] = value
        refused("platform/motion", from_messages.msg_to_motion, msg)
        msg.points[point].positions = msg.points[point].positions[:place]
        for other in (msg, JointTrajectory(joint_names=["a"])):
            refused("platform/motion", from_messages.msg_to_motion, other)


@pytest.mark.parametrize(
    ("name", "value"),
    [("index", NAN), ("index", INF), ("index", -1.0), ("index", 2.0**53), ("time", NAN),
     ("time", 1e11), ("time", -0.5), ("kind", 3)],
)  # fmt: skip
def test_rows_that_count_or_time_cannot_follow_are_refused(name: str, value: float) -> None:
    sent = rows(5)
    sent[name][3] = value
    refused(f"cloud {name}: got", from_messages.impacts_from_msg, c.impacts_to_msg(sent, 0))

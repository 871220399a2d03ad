"""Rulings on commands: what is accepted, with which effect, and every way to be refused."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.core.model import Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.command_validation import (
    ImpulseRequest,
    Instant,
    PointRequest,
    ProgrammeRequest,
    accept_programme,
    schedule_impulse,
)
from bouncing_disk_ros.run.time_map import TimeMap
from bouncing_disk_ros.units import NS

WALL = 1_800_000_000 * NS
NOW = 20 * NS + 1  # next unsimulated nanosecond
LATEST = Motion(0.04, 0.5, 3.0, 0.1)


def instant(factor: float = 1.0, tolerance: float = 0.1) -> Instant:
    """At 20 s of simulated time; ROS time WALL stands for 10 s of it."""
    return Instant(NOW, TimeMap(10 * NS, 0, WALL, factor), round(tolerance * NS))


def at(seconds: float) -> int:
    """The ROS stamp of an instant of simulated time (real time)."""
    return WALL + round((seconds - 10) * NS)


def programme(
    *points: tuple[float, tuple[float, ...]],
    names: tuple[str, ...] = ("axial_amplitude",),
    stamp_ns: int = 0,
) -> ProgrammeRequest:
    requests = tuple(PointRequest(values, round(after * NS)) for after, values in points)
    return ProgrammeRequest(names, requests, stamp_ns)


def ruled(request: ProgrammeRequest, **kwargs: Any) -> tuple[tuple[int, Motion], ...]:
    return accept_programme(request, instant(**kwargs), LATEST)


# --- accepted -------------------------------------------------------------------------------------
ONE = (0.0, (0.05,))
CASES: dict[str, tuple[ProgrammeRequest, list[int]]] = {
    "stamp zero acts now": (programme(ONE), [NOW]),
    "times from start count from now without a stamp": (
        programme((0.5, (0.05,)), (1.5, (0.05,))), [NOW + NS // 2, NOW + 3 * NS // 2]),
    "a future stamp is exact to the nanosecond": (
        programme((1.0, (0.05,)), stamp_ns=at(21) + 7), [22 * NS + 7]),
    "a point as old as the tolerance is taken": (
        programme(ONE, stamp_ns=WALL + (NOW - 10 * NS) - NS // 10), [NOW]),
    "a slightly old stamp acts now": (programme(ONE, stamp_ns=at(19.95)), [NOW]),
    "points within the tolerance keep their order": (
        programme(ONE, (0.02, (0.05,)), stamp_ns=at(19.95)), [NOW, NOW + 1]),
    "of a programme partly past the rest runs": (
        programme((0.0, (0.01,)), (4.0, (0.02,)), (6.0, (0.05,)), stamp_ns=at(15)), [21 * NS]),
    "no points cancel what is pending": (ProgrammeRequest((), ()), []),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_an_accepted_programme_acts_at(case: str) -> None:
    request, whens = CASES[case]
    motion = LATEST._replace(axial_amplitude=0.05)
    assert ruled(request) == tuple((when, motion) for when in whens)


def test_slow_motion_stretches_ros_time_and_a_target_beyond_a_century_is_refused() -> None:
    ((when, _),) = ruled(programme((1.0, (0.05,))), factor=0.25)
    assert when == NOW + NS // 4
    with pytest.raises(InputError, match="at most a century"):
        ruled(programme((0.0, (0.05,)), stamp_ns=2**31 * NS), factor=1e9)


def test_names_may_come_in_any_order_the_others_inherit_and_a_phase_lag_wraps() -> None:
    request = programme(
        (0.0, (5.0, 0.07, 4.0)), names=("frequency", "axial_amplitude", "phase_lag")
    )
    ((_, motion),) = ruled(request)
    lag = math.remainder(4.0, math.tau)
    assert motion == Motion(0.07, LATEST.angular_amplitude, 5.0, lag)
    ((_, motion),) = ruled(programme((0.0, (5.0,)), names=("frequency",)))
    assert motion == LATEST._replace(frequency=5.0)


# --- refused --------------------------------------------------------------------------------------


@given(
    names=st.lists(st.sampled_from([*Motion._fields, "x"]), max_size=5),
    points=st.lists(
        st.tuples(
            st.lists(st.floats(), max_size=5),
            st.integers(-NS, 10 * NS),
        ),
        max_size=4,
    ),
    stamp=st.integers(-(2**31), 2**31).map(lambda seconds: seconds * NS) | st.just(0),
    factor=st.sampled_from([1.0, 0.1, 0.0, 1e3]),
)
def test_anything_is_either_refused_or_safe_for_the_core(
    names: list[str], points: list[tuple[list[float], int]], stamp: int, factor: float
) -> None:
    requests = tuple(PointRequest(tuple(values), after) for values, after in points)
    request = ProgrammeRequest(tuple(names), requests, stamp)
    try:
        accepted = ruled(request, factor=factor)
    except InputError:
        return
    whens = [when for when, _ in accepted]
    assert all(NOW <= when < 2**62 for when in whens)
    assert whens == sorted(set(whens))
    for _, motion in accepted:
        assert all(math.isfinite(value) for value in motion)
        assert motion.frequency > 0.0
        assert min(motion.axial_amplitude, motion.angular_amplitude) >= 0.0
        assert abs(motion.phase_lag) <= math.pi


# --- kicks ----------------------------------------------------------------------------------------
def impulse(
    *force: float, torque: tuple[float, ...] = (0.0, 0.0, 0.0), stamp: int = 0
) -> ImpulseRequest:
    return ImpulseRequest(force, torque, stamp)  # type: ignore[arg-type]


def test_a_kick_acts_now_or_at_its_stamp() -> None:
    assert schedule_impulse(impulse(0.0, 0.0, 0.5, torque=(0.0, 0.0, -0.25)), instant()) == (
        NOW,
        0.5,
        -0.25,
    )
    assert schedule_impulse(impulse(0.0, 0.0, 0.5, stamp=at(30)), instant()) == (30 * NS, 0.5, 0.0)
    assert schedule_impulse(impulse(0.0, 0.0, 0.5, stamp=at(19.95)), instant()) == (NOW, 0.5, 0.0)

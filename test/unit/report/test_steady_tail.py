"""The part at the end of a segment whose mean speed is reported."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.core.model import IMPACT_DTYPE, Disk, Motion
from bouncing_disk_ros.report.estimate import Estimate
from bouncing_disk_ros.report.spans import Segment
from bouncing_disk_ros.report.steady_speed import (
    angle_of_means,
    mean_in_flight,
    mean_of_angle,
    tail_begin,
)
from bouncing_disk_ros.report.transient import Transient, TransientKind

NONE = Estimate(math.nan, math.nan, math.nan, 0, "")
LEVEL = Transient(TransientKind.NONE, True, 1.0, 1.0, NONE, NONE, math.nan, "")
LINE = LEVEL._replace(kind=TransientKind.LINEAR)
CURVE = LEVEL._replace(
    kind=TransientKind.EXPONENTIAL, time_constant=Estimate(0.1, 0.09, 0.11, 50, "")
)
DISK = Disk(0.5, 0.5, 0.5, 0.1, 0.1, 10.0)


def segment(length: float, frequency: float = 100.0) -> Segment:
    return Segment(5.0, 5.0 + length, "start", Motion(0.01, 0.1, frequency, 0.0), DISK)


@pytest.mark.parametrize(
    ("length", "transient", "tail"),
    [
        (1.0, LEVEL, 1.0),
        (60.0, LEVEL, 2.0),
        (1.0, LINE._replace(end=5.4), 0.54),  # 0.6 without their first tenth
        (60.0, LINE._replace(end=5.4), 2.0),
        (1.0, LINE._replace(end=5.99), 0.2),
        (1.0, LINE._replace(finished=False), 0.2),
        (1.0, CURVE, 0.3),
        (0.5, CURVE, 0.1),
        (1.0, None, 0.2),
    ],
)
def test_a_transient_is_left_out(length: float, transient: Transient | None, tail: float) -> None:
    part = segment(length)
    assert part.end - tail_begin(part, transient) == pytest.approx(tail)


def test_at_least_three_periods_are_in_it() -> None:
    assert tail_begin(segment(1.5, 3.0), None) == pytest.approx(5.5)
    assert tail_begin(segment(0.5, 3.0), None) == 5.0


def test_between_impacts_a_load_takes_speed_on_a_line() -> None:
    """After each impact 3 rad/s; a brake takes 1 rad/s until the next one, or stops the rotor."""
    rows = np.zeros(4, IMPACT_DTYPE)
    rows["index"], rows["time"], rows["angular_velocity"] = np.arange(4), [0.0, 1.0, 2.0, 3.0], 3.0
    rows["axial_velocity"], rows["count"] = 5.0, 1  # back after a second, with g = 10 m/s²
    rows["angular_impulse"] = DISK.inertia * 1.0
    assert mean_in_flight(rows, DISK) == 3.0
    braked = DISK._replace(brake_torque=DISK.inertia * 1.0)
    assert mean_in_flight(rows, braked) == pytest.approx(2.5)
    rows["angular_impulse"] = DISK.inertia * 3.0
    assert math.isnan(mean_in_flight(rows, braked))
    rows["index"][3] = 4.0
    assert math.isnan(mean_in_flight(rows, DISK)), "a row was lost"
    rows["index"][3], rows["axial_velocity"][1] = 3.0, 0.0
    assert math.isnan(mean_in_flight(rows, DISK)), "the second impact led into contact"


def test_means_are_angle_over_time() -> None:
    times = np.arange(0.0, 10.0, 0.1)
    angles = 2.0 * times + 0.3 * np.sin(math.tau * times / 0.7)
    whole = mean_of_angle(times, angles, 7.0, 0.7)
    assert whole.value == pytest.approx(2.0, abs=1e-9)
    assert whole.end - whole.begin == pytest.approx(4 * 0.7)
    other = mean_of_angle(times, angles, 7.0, 0.0)
    assert other.value == pytest.approx((angles[99] - angles[70]) / 2.9)
    assert math.isnan(mean_of_angle(times[:1], angles[:1], 0.0, 0.0).value)
    # each mean is since the message before; one is missing at 3 s
    at, turned = angle_of_means(np.array([1.0, 2.0, 4.0, 5.0, 6.0]), np.array([9, 9, 9, 2.0, 4.0]))
    assert (at.tolist(), turned.tolist()) == ([4.0, 5.0, 6.0], [0.0, 2.0, 6.0])
    at, turned = angle_of_means(np.array([1.0, 6.0]), np.array([9.0, 2.0]))
    assert (len(at), len(turned)) == (0, 0), "means between these two may be missing"

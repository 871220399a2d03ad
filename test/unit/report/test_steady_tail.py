"""The part at the end of a segment whose mean speed is reported."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.core.model import IMPACT_DTYPE, Disk
from bouncing_disk_ros.report.steady_speed import (
    mean_in_flight,
)

DISK = Disk(0.5, 0.5, 0.5, 0.1, 0.1, 10.0)


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

"""The linearised map against differences of the map itself, and what it says of orbits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros import simulate
from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.maps.axial_map import MAP_IMPACT, axial_orbit
from bouncing_disk_ros.maps.map_tangent import log_growth
from bouncing_disk_ros.report import stability
from bouncing_disk_ros.report.stability import Path, chaos_of, cycle_near, path_of
from bouncing_disk_ros.run.session import motion_of as motion_in
from support.checks import there
from support.map_rows import DISK, map_rows, motion_of


def step(tau: float, w: float, axial_forcing: float, restitution: float) -> tuple[float, float]:
    """One impact of the map: τ' not wrapped, and w'."""
    out = np.empty((1, 4))
    axial_orbit(tau, w, axial_forcing, restitution, 1, out)
    assert out[0, 3] == MAP_IMPACT
    return tau + out[0, 2], out[0, 1]


def test_rows_of_the_simulator_follow_the_map_until_a_kick() -> None:
    result = simulate(40.0, preset="pizza_multiple_toss", impulses=[(20.1, 0.02, 0.0)])
    disk = Disk.of(result.parameters)
    motion = motion_in(result.parameters)
    rows = result.impacts
    assert len(path_of(rows, motion, disk).tau) == np.sum(rows["time"] > 20.1)
    assert len(path_of(rows[rows["time"] < 20.0], motion, disk).tau) == np.sum(rows["time"] < 20.0)
    wrong = disk._replace(restitution=0.49)
    assert len(path_of(rows, motion, wrong).tau) <= 1
    assert len(path_of(rows[:0], motion, disk).tau) == 0


def test_exponent_is_the_rate_at_which_two_orbits_part() -> None:
    """Γ = 0.549: the mean of ln(distance growth) of twin orbits, put close again at each impact."""
    rows = map_rows(0.549, 4000, skip=1000)
    path = path_of(rows, motion_of(0.549), DISK)
    exponent = there(chaos_of(path))
    near, growth = 1e-7, []
    away = np.array([near, 0.0])
    for tau, w, t, w1 in zip(path.tau, path.w, path.delay, path.w[1:], strict=False):
        twin = np.array(step(tau + away[0], w + away[1], 0.549, 0.5)) - (tau + t, w1)
        size = float(np.hypot(*twin))
        growth.append(math.log(size / near))
        away = twin * near / size
    # second derivatives (below 1e3) times 1e-7, both here and along all of the orbit
    assert exponent.value == pytest.approx(np.mean(growth), abs=1e-3)
    assert exponent.low < exponent.value < exponent.high
    assert exponent.impacts == len(growth)


def test_intervals_of_the_exponent_cover() -> None:
    """30 parts of one chaotic orbit: the exponent of the whole is in at least 24 intervals of 95 %.

    Fewer than 24 of 30 have a chance of 4e-4 at 95 %, and the seed is the orbit: it is fixed.
    """
    path = path_of(map_rows(0.549, 60_001, skip=1000), motion_of(0.549), DISK)
    growth = log_growth(stability.jacobians(path))
    whole = float(np.mean(growth))
    parts = [stability.exponent_of(part) for part in np.array_split(growth, 30)]
    assert sum(part.low <= whole <= part.high for part in parts) >= 24


def test_the_interval_of_the_exponent_is_student_s_of_its_batches() -> None:
    """Twenty batches whose means are 1 to 20: their mean ± t(97.5 %, 19) · deviation / √20."""
    exponent = stability.exponent_of(np.repeat(np.arange(1.0, 21.0), 3))
    half = 2.0930240544 * math.sqrt(35.0) / math.sqrt(20.0)
    assert exponent.value == 10.5
    assert (exponent.low, exponent.high) == pytest.approx((10.5 - half, 10.5 + half), rel=1e-6)


def test_negative_exponent_is_no_chaos_and_restitution_zero_forgets_everything() -> None:
    """On a stable cycle it is the logarithm of the multiplier, within ln(condition)/1000."""
    path = path_of(map_rows(0.40, 2000), motion_of(0.40), DISK)
    growth = log_growth(stability.jacobians(path))
    cycle = there(cycle_near(path, 1))
    assert np.mean(growth[1000:]) == pytest.approx(math.log(abs(cycle.multipliers[0])), abs=5e-3)
    assert chaos_of(path) is None
    flat = Path(np.full(100, 0.7), np.full(100, -2.0), np.full(99, 6.28), 0.5, 0.0)
    assert chaos_of(flat) is None
    assert log_growth(np.zeros((3, 2, 2))).tolist() == [-math.inf] * 3

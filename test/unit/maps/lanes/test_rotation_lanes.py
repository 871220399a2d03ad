"""Lanes with rotation are the next-collision map with rotation."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, MAP_REST, ORBIT_KIND
from bouncing_disk_ros.maps.lanes.axial_lanes import (
    COUNT_CONTACTS,
    COUNT_RESTS,
    iterate_axial,
)
from bouncing_disk_ros.maps.lanes.lane_table import LANES
from bouncing_disk_ros.maps.lanes.rotation_lanes import SUM_TIME, iterate_rotation
from bouncing_disk_ros.maps.lanes.rotation_lanes import SUM_TURNED as SUM_TURNED
from bouncing_disk_ros.maps.rotation_map import ORBIT_SPEED, ORBIT_TURNED, collision_orbit

Floats = NDArray[np.float64]


class Starts(NamedTuple):
    tau: Floats
    w: Floats
    speed: Floats
    forcing: Floats
    restitution: Floats
    phase_lag: Floats
    angular_forcing: Floats


def starts(n: int, seed: int) -> Starts:
    rng = np.random.default_rng(seed)
    fall = np.where(np.arange(n) % 3 == 0, 10.0 ** rng.uniform(-8, 0, n), rng.uniform(0, 5, n))
    return Starts(
        rng.uniform(0, math.tau, n),
        -fall,
        rng.uniform(-1.5, 1.5, n),
        rng.uniform(0.2, 1.2, n),
        rng.uniform(0, 1, n),
        rng.uniform(-math.pi, math.pi, n),
        10.0 ** rng.uniform(-1, 3, n),
    )


def carried(
    start: Starts, impacts: int, workers: int = 1
) -> tuple[Starts, NDArray[np.int64], Floats]:
    end = Starts(*(a.copy() for a in start))
    counts, sums = np.zeros((len(start.tau), 2), np.int64), np.zeros((len(start.tau), 2))
    iterate_rotation(*end, impacts, counts, sums, workers=workers)
    return end, counts, sums


def test_single_steps_are_those_of_the_map() -> None:
    n = 4000
    start = starts(n, 41)
    found, counts, sums = carried(start, 1)
    steps = np.full((n, ORBIT_TURNED + 1), np.nan)
    for i, one in enumerate(zip(*start, strict=True)):
        collision_orbit(*one, 1, steps[i : i + 1])
    np.testing.assert_array_equal(counts[:, COUNT_CONTACTS], steps[:, ORBIT_KIND] == MAP_CONTACT)
    np.testing.assert_array_equal(counts[:, COUNT_RESTS], steps[:, ORBIT_KIND] == MAP_REST)
    assert counts.sum(axis=0).min() > 20
    fine = counts[:, COUNT_RESTS] == 0
    # platform and lane turn the phase lag by other sums of products: two roundings of each term
    np.testing.assert_allclose(found.speed[fine], steps[fine, ORBIT_SPEED], rtol=0, atol=1e-15)
    # the delay has the rounding of the gap over the slope, here below 100 roundings
    np.testing.assert_allclose(
        sums[fine, SUM_TURNED], steps[fine, ORBIT_TURNED], rtol=1e-13, atol=1e-13
    )
    assert np.isnan(found.speed[~fine]).all()


def test_the_axial_part_has_the_bits_of_the_axial_lanes() -> None:
    n = LANES + 3
    start = starts(n, 42)._replace(forcing=np.full(n, 0.45), restitution=np.full(n, 0.5))
    start = start._replace(tau=np.full(n, 0.7) + 1e-3 * start.speed, w=np.full(n, -1.3))
    found, _, _ = carried(start, 500)
    tau, w = start.tau.copy(), start.w.copy()
    iterate_axial(tau, w, start.forcing, start.restitution, 500, np.zeros((n, 2), np.int64))
    np.testing.assert_array_equal(found.tau, tau)
    np.testing.assert_array_equal(found.w, w)


def test_the_disk_reaches_the_speed_of_eq_4() -> None:
    n, lag = 3, -0.7
    phase = math.acos(1.0 / (3.0 * 0.45))
    start = Starts(*(np.full(n, v) for v in (phase + 1e-3, -4 / 3, 0.0, 0.45, 0.5, lag, 100.0)))
    found, counts, sums = carried(start, 1000)
    np.testing.assert_allclose(found.speed, math.cos(phase + lag), rtol=0, atol=1e-14)
    np.testing.assert_allclose(sums[:, SUM_TIME], 1000 * math.tau, rtol=0, atol=1e-2)
    assert not counts.any()


def test_trajectories_know_nothing_of_each_other() -> None:
    n = 20 * LANES
    start = starts(n, 43)
    whole = carried(start, 30)
    order = np.random.default_rng(44).permutation(n)[: LANES + 5]
    part = carried(Starts(*(a[order] for a in start)), 30)
    shared = carried(start, 30, workers=2)
    for a, b, c in zip(
        (*whole[0], *whole[1:]), (*part[0], *part[1:]), (*shared[0], *shared[1:]), strict=True
    ):
        np.testing.assert_array_equal(a[order], b)
        np.testing.assert_array_equal(a, c)

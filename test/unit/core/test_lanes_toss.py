"""Tosses in lanes are the rides of the stepper."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros.core import ride
from bouncing_disk_ros.core.engine import disk_record
from bouncing_disk_ros.core.lanes_rides import tosses
from bouncing_disk_ros.core.layout import BOOKS, STATE_DTYPE
from bouncing_disk_ros.core.model import Disk

DOUGH = Disk(0.3, 0.5, 0.6, 0.12, 0.3 / math.sqrt(8.0), 10.0)
FREQUENCY = 3.0
ARC = 0.25
Floats = NDArray[np.float64]


def starts(n: int, seed: int, from_rest: bool) -> Floats:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, math.pi / 2, n)
    table = np.empty((n, 5))
    table[:, ride.AXIAL_AMPLITUDE] = ARC * np.cos(angle)
    table[:, ride.ANGULAR_AMPLITUDE] = ARC * np.sin(angle) / DOUGH.friction_radius
    table[:, ride.PHASE_LAG] = rng.uniform(-math.pi, math.pi, n)
    table[:, ride.FORCING_PHASE] = 1.5 * math.pi if from_rest else rng.uniform(0, math.tau, n)
    table[:, ride.START_SPEED] = 0.0 if from_rest else rng.uniform(-30, 30, n)
    return table


def by_ride(table: Floats, disk: Disk) -> tuple[Floats, NDArray[np.int8]]:
    out, codes = np.empty((len(table), 4)), np.empty(len(table), np.int8)
    state, books = np.zeros(1, STATE_DTYPE), np.zeros((2, len(BOOKS)))
    ride.rides(table, FREQUENCY, disk_record(disk, 0.0), 1000, state, books, out, codes)
    return out, codes


@pytest.mark.parametrize("from_rest", [True, False])
@pytest.mark.parametrize(
    "disk",
    [
        DOUGH,
        DOUGH._replace(friction=3.0),  # sticks often
        DOUGH._replace(friction=0.05, preload=0.5),
        DOUGH._replace(load_torque=0.01),
        DOUGH._replace(friction=0.0),
    ],
)
def test_rides_are_those_of_the_stepper(disk: Disk, from_rest: bool) -> None:
    table = starts(3000, 51, from_rest)
    expected, expected_codes = by_ride(table, disk)
    found, codes = tosses(table, FREQUENCY, disk)
    np.testing.assert_array_equal(codes, expected_codes)
    assert {ride.RIDE_SLID, ride.RIDE_STAYS} <= set(codes.tolist())
    # an instant good to a few roundings of a phase of 8 rad, times accelerations of a few hundred
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_rows_know_nothing_of_each_other() -> None:
    table = starts(3000, 52, False)
    whole = tosses(table, FREQUENCY, DOUGH)
    order = np.random.default_rng(53).permutation(3000)[:100]
    part = tosses(table[order], FREQUENCY, DOUGH)
    shared = tosses(table, FREQUENCY, DOUGH, workers=2)
    for k in range(2):
        np.testing.assert_array_equal(whole[k][order], part[k])
        np.testing.assert_array_equal(whole[k], shared[k])

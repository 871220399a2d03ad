"""Lanes settle and measure as `measure_attractor` does: the same steps and ends."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.lanes.attractor_lanes import measure_attractors
from bouncing_disk_ros.maps.rotation_map import (
    CONTACT_COUNT,
    LYAPUNOV,
    measure_attractor,
)

Floats = NDArray[np.float64]


class Found(NamedTuple):
    states: Floats  # (n, 5)
    rows: Floats  # (n, kept, 6)
    results: Floats  # (n, 5)


def carried(given: tuple[Floats, Floats], settling: int, measured: int, kept: int = 1) -> Found:
    states = given[0].copy()
    found = Found(states, np.zeros((len(states), kept, 6)), np.zeros((len(states), 5)))
    measure_attractors(states, given[1], settling, measured, *found[1:])
    return found


def one_by_one(given: tuple[Floats, Floats], settling: int, measured: int, kept: int = 1) -> Found:
    """The same by the scalar map."""
    states, parameters = given[0].copy(), given[1]
    found = Found(states, np.zeros((len(states), kept, 6)), np.zeros((len(states), 5)))
    for i, state in enumerate(states):
        arguments = (*(float(p) for p in parameters[i]), settling, measured)
        if not measure_attractor(state, *arguments, found.rows[i], found.results[i]):
            found.rows[i] = math.nan
    return found


def test_contact_rest_and_a_dead_impact_are_told_as_by_the_scalar_map() -> None:
    states = np.array(
        [
            [1.0, -0.01, 0.0, 1.0, 0.0],  # chatters, and rides on the platform
            [1.0, -0.5, 0.0, 1.0, 0.0],  # at rest for good
            [1.5 * math.pi, 0.0, 0.0, 1.0, 0.0],  # lies on the platform
            [2.0, -0.5, 0.3, 0.0, 1.0],  # ε = 0 where the platform falls: no trace of a change
            [2.0, -0.5, 0.3, 0.6, 0.8],
        ]
    )
    parameters = np.array(
        [
            [0.34, 0.5, 0.2, 100.0],
            [0.30, 0.5, 0.2, 100.0],
            [0.34, 0.5, 0.2, 100.0],
            [1.20, 0.0, 0.2, 100.0],
            [1.20, 0.0, 0.2, 100.0],
        ]
    )
    for settling, measured in ((300, 200), (0, 1)):
        found = carried((states, parameters), settling, measured, 1)
        expected = one_by_one((states, parameters), settling, measured, 1)
        np.testing.assert_allclose(found.results, expected.results, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.rows, expected.rows, rtol=0, atol=1e-9)
        np.testing.assert_allclose(found.states, expected.states, rtol=0, atol=1e-9)
    lost = found.results[:, LYAPUNOV]  # of a single impact
    assert lost[3] == -math.inf
    assert found.results[3, CONTACT_COUNT] == 0.0
    assert math.isfinite(lost[4])

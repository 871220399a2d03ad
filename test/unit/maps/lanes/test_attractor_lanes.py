"""Lanes settle and measure as `measure_attractor` does: the same steps and ends."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.axial_map import (
    MAP_CONTACT,
    ORBIT_DELAY,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
)
from bouncing_disk_ros.maps.lanes.attractor_lanes import measure_attractors
from bouncing_disk_ros.maps.rotation_map import (
    CONTACT_COUNT,
    LYAPUNOV,
    MEAN_PER_IMPACT,
    MEASURED,
    ORBIT_SPEED,
    ORBIT_TURNED,
    measure_attractor,
)

Floats = NDArray[np.float64]
ROUNDING = 2.0**-53


class Found(NamedTuple):
    states: Floats  # (n, 5)
    rows: Floats  # (n, kept, 6)
    results: Floats  # (n, 5)


def starts(n: int, seed: int) -> tuple[Floats, Floats]:
    """States (n, 5), parameters (n, 4): tiny bounces, rest, contact, ε of 0 and 1 among them."""
    rng = np.random.default_rng(seed)
    index = np.arange(n)
    fall = np.where(index % 3 == 0, 10.0 ** rng.uniform(-8, 0, n), rng.uniform(0, 5, n))
    forcing = np.where(index % 5 == 0, rng.uniform(0.0, 0.33, n), rng.uniform(0.3, 1.3, n))
    restitution = np.where(index % 7 == 0, rng.integers(0, 2, n), rng.uniform(0, 1, n))
    turned = rng.uniform(0, math.tau, n)
    states = np.stack(
        (rng.uniform(0, math.tau, n), -fall, rng.uniform(-1.5, 1.5, n), np.cos(turned),
         np.sin(turned)), axis=1
    )  # fmt: skip
    lag, angular = rng.uniform(-math.pi, math.pi, n), 10.0 ** rng.uniform(-1, 3, n)
    return states, np.stack((forcing, restitution, lag, angular), axis=1)


def carried(
    given: tuple[Floats, Floats], settling: int, measured: int, kept: int = 1, workers: int = 1
) -> Found:
    states = given[0].copy()
    found = Found(states, np.zeros((len(states), kept, 6)), np.zeros((len(states), 5)))
    measure_attractors(states, given[1], settling, measured, *found[1:], workers=workers)
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


def apart(a: Floats, b: Floats) -> Floats:
    """Distance of phases, the short way round; 0 where both are nan."""
    difference = np.abs(a - b)
    return np.where(np.isnan(a) & np.isnan(b), 0.0, np.minimum(difference, math.tau - difference))


def step_rounding(w: Floats, forcing: Floats, w1: Floats) -> Floats:
    """Of τ and w after one impact: a gap off by a rounding of its terms moves the root by that
    over the slope."""
    reach = 1.0 + np.abs(w) + forcing
    return 4e-15 * reach * (1.0 + reach / np.abs(w1))


def test_single_steps_are_those_of_the_map() -> None:
    start = starts(4000, 51)
    found, steps = carried(start, 0, 1), one_by_one(start, 0, 1)
    rests = np.isnan(steps.results[:, MEASURED])
    contact = steps.rows[:, 0, ORBIT_KIND] == MAP_CONTACT
    assert min(rests.sum(), contact.sum()) > 20
    np.testing.assert_array_equal(np.isnan(found.results), np.isnan(steps.results))
    np.testing.assert_array_equal(found.states[rests], steps.states[rests])
    for column in (ORBIT_KIND, ORBIT_DELAY, ORBIT_TAU, ORBIT_W, ORBIT_SPEED, ORBIT_TURNED):
        assert np.isnan(found.rows[rests, 0, column]).all()
    rows, expected = found.rows[~rests, 0], steps.rows[~rests, 0]
    np.testing.assert_array_equal(rows[:, ORBIT_KIND], expected[:, ORBIT_KIND])
    w, forcing = start[0][~rests, 1], start[1][~rests, 0]
    rounding = step_rounding(w, forcing, expected[:, ORBIT_W])
    assert (apart(rows[:, ORBIT_TAU], expected[:, ORBIT_TAU]) <= rounding).all()
    for column in (ORBIT_W, ORBIT_DELAY):
        assert (np.abs(rows[:, column] - expected[:, column]) <= rounding).all()
    # platform and lane turn the phase lag by other sums of products: two roundings of each term
    np.testing.assert_allclose(rows[:, ORBIT_SPEED], expected[:, ORBIT_SPEED], rtol=0, atol=1e-15)
    turned = np.abs(rows[:, ORBIT_TURNED] - expected[:, ORBIT_TURNED])
    assert (turned <= 2.0 * rounding * (1.0 + np.abs(expected[:, ORBIT_SPEED]))).all()
    for column in (MEAN_PER_IMPACT, CONTACT_COUNT, MEASURED):
        np.testing.assert_allclose(
            found.results[:, column], steps.results[:, column], rtol=0, atol=1e-15
        )


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

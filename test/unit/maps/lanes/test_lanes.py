"""Lanes are the map for many trajectories: the same impacts, labels and attractors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros.maps.axial_map import (
    MAP_CONTACT,
    MAP_REST,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
    axial_orbit,
)
from bouncing_disk_ros.maps.basin_labels import (
    LaneRule,
    StartLabels,
    known_points,
    label_lanes,
)
from bouncing_disk_ros.maps.basin_measures import UNRESOLVED
from bouncing_disk_ros.maps.lanes.attractor_lanes import measure_attractors
from bouncing_disk_ros.maps.rotation_map import (
    CONTACT_COUNT,
    LYAPUNOV,
    measure_attractor,
)

Floats = NDArray[np.float64]
CONTACT, REST = 7, 9
POINT_LABEL = 3


def orbit(tau: float, w: float, forcing: float, restitution: float, n: int) -> Floats:
    out = np.full((n, 4), np.nan)
    return out[: axial_orbit(tau, w, forcing, restitution, n, out)]


def label_of(
    steps: Floats, points: Floats, of: Sequence[int], tolerance: float, confirm: int, cap: int,
    needed: int = 0,
) -> tuple[int, int]:  # fmt: skip
    """The rule of `label_lanes` in plain words: label and impacts, from the steps of a start."""
    run, last, reached = 0, -1, 0
    m = len(of)
    before = [
        next(q for q in ((p - k) % m for k in range(1, m + 1)) if of[q] == of[p]) for p in range(m)
    ]
    for k, step in enumerate(steps):
        if step[ORBIT_KIND] in (MAP_CONTACT, MAP_REST):
            return (CONTACT if step[ORBIT_KIND] == MAP_CONTACT else REST), k
        difference = np.abs(step[ORBIT_TAU] - points[:, 0])
        near = [
            p
            for p in range(m)
            if min(difference[p], math.tau - difference[p]) <= tolerance
            and abs(step[ORBIT_W] - points[p, 1]) <= tolerance
        ]
        following = [p for p in near if before[p] == last]
        run = run + 1 if following else min(len(near), 1)
        last = next(iter(following or near), -1)
        reached = k + 1 if run == confirm else reached
        if run >= max(confirm, needed):
            return of[last], reached
    return UNRESOLVED, cap


def labelled(
    tau: Floats,
    w: Floats,
    forcing: float,
    points: Floats,
    of: Any,
    cap: int,
    repetitions: int = 1,
) -> tuple[NDArray[np.int32], NDArray[np.int32], Floats]:
    n = len(tau)
    out = StartLabels(np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n))
    rule = LaneRule(1e-3, 4.0, CONTACT, REST, cap)
    label_lanes(tau, w, forcing, 0.5, known_points(points, of, repetitions), rule, out)
    return out.label, out.impacts, out.time


@pytest.mark.parametrize(
    ("forcing", "period", "cap", "labels", "repetitions"),
    [
        (0.45, 1, 300, {POINT_LABEL, CONTACT}, 1),
        (0.5, 2, 300, {POINT_LABEL, CONTACT}, 1),
        (0.5, 2, 300, {POINT_LABEL, CONTACT}, 7),
        (0.3, 1, 60, {REST}, 1),
        (0.45, 1, 22, {POINT_LABEL, CONTACT, UNRESOLVED}, 1),
        (0.45, 1, 26, {POINT_LABEL, CONTACT, UNRESOLVED}, 9),
    ],
)
def test_labels_are_those_of_the_rule(
    forcing: float, period: int, cap: int, labels: set[int], repetitions: int
) -> None:
    phase = math.acos(min(1.0 / (3.0 * forcing), 1.0)) + 1e-3
    points = np.ascontiguousarray(orbit(phase, -4 / 3, forcing, 0.5, 5000)[-period:, : ORBIT_W + 1])
    of = np.full(len(points), POINT_LABEL, np.int32)
    rng = np.random.default_rng(34)
    tau, w = rng.uniform(0, math.tau, 400), -rng.uniform(0, 5, 400)
    found = labelled(tau, w, forcing, points, of, cap, repetitions=repetitions)
    needed = repetitions * period
    expected = [
        label_of(orbit(t, v, forcing, 0.5, cap), points, list(of), 1e-3, 4, cap, needed)
        for t, v in zip(tau, w, strict=True)
    ]
    np.testing.assert_array_equal(found[0], [e[0] for e in expected])
    np.testing.assert_array_equal(found[1], [e[1] for e in expected])
    assert set(found[0]) == labels


# --- attractors -----------------------------------------------------------------------------------
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

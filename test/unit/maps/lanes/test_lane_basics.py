"""Lanes are the next-collision map for many trajectories: the same impacts, the same labels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

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

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
    MAP_IMPACT,
    MAP_REST,
    ORBIT_DELAY,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
    axial_orbit,
)
from bouncing_disk_ros.maps.lanes.axial_lanes import (
    COUNT_CONTACTS,
    COUNT_RESTS,
    iterate_axial,
)
from bouncing_disk_ros.maps.lanes.basin_kernel import (
    UNDECIDED,
    LaneLabels,
    LaneRule,
    known_points,
    label_lanes,
)
from bouncing_disk_ros.maps.lanes.lane_flight import launch_lanes
from bouncing_disk_ros.maps.lanes.lane_table import DELAY as FIRST_DELAY
from bouncing_disk_ros.maps.lanes.lane_table import (
    FIELDS,
    LANES,
    NEEDS_SCALAR,
    assign_lane,
    in_slices,
    scratch,
)

Floats = NDArray[np.float64]
CONTACT, REST = 7, 9
POINT_LABEL = 3


def orbit(tau: float, w: float, forcing: float, restitution: float, n: int) -> Floats:
    out = np.full((n, 4), np.nan)
    return out[: axial_orbit(tau, w, forcing, restitution, n, out)]


def apart(a: Floats, b: Floats) -> Floats:
    """Distance of phases, the short way round; 0 where both are nan."""
    difference = np.abs(a - b)
    return np.where(np.isnan(a) & np.isnan(b), 0.0, np.minimum(difference, math.tau - difference))


def starts(n: int, seed: int) -> tuple[Floats, Floats, Floats, Floats]:
    rng = np.random.default_rng(seed)
    forcing = np.where(np.arange(n) % 5 == 0, rng.uniform(0.0, 0.33, n), rng.uniform(0.3, 1.3, n))
    restitution = np.where(np.arange(n) % 7 == 0, rng.integers(0, 2, n), rng.uniform(0, 1, n))
    speed = np.where(np.arange(n) % 3 == 0, 10.0 ** rng.uniform(-8, 0, n), rng.uniform(0, 5, n))
    return rng.uniform(0, math.tau, n), -speed, forcing, restitution


def carried(
    state: tuple[Floats, Floats, Floats, Floats], impacts: int, workers: int = 1
) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """τ, w and the counts of events after some impacts."""
    tau, w, forcing, restitution = (a.copy() for a in state)
    counts = np.zeros((len(tau), 2), np.int64)
    iterate_axial(tau, w, forcing, restitution, impacts, counts, workers=workers)
    return tau, w, counts


def test_single_steps_are_those_of_the_map() -> None:
    n = 5000
    tau, w, forcing, restitution = starts(n, 31)
    *found, counts = carried((tau, w, forcing, restitution), 1)
    steps = np.array([orbit(*start, 1)[0] for start in zip(*starts(n, 31), strict=True)])
    np.testing.assert_array_equal(counts[:, COUNT_CONTACTS], steps[:, ORBIT_KIND] == MAP_CONTACT)
    np.testing.assert_array_equal(counts[:, COUNT_RESTS], steps[:, ORBIT_KIND] == MAP_REST)
    assert counts[:, COUNT_CONTACTS].sum() > 20
    assert counts[:, COUNT_RESTS].sum() > 20
    # a gap that is off by a rounding of its terms moves the root by that over the slope
    slope = np.abs(steps[:, ORBIT_W])
    reach = 1.0 + np.abs(w) + forcing
    rounding = 4e-15 * reach * (1.0 + reach / np.where(slope > 0, slope, np.nan))
    fine = counts[:, COUNT_RESTS] == 0
    assert (apart(found[0], steps[:, ORBIT_TAU])[fine] <= rounding[fine]).all()
    assert (np.abs(found[1] - steps[:, ORBIT_W])[fine] <= rounding[fine]).all()
    assert np.isnan(found[0][~fine]).all()


def test_no_first_delay_passes_the_impact() -> None:
    """What `launch_lanes` says is safe is at most the delay of the impact, and seldom much less."""
    n = 20 * LANES
    tau, w, forcing, restitution = starts(n, 38)
    z = scratch(FIELDS)
    near = compared = 0
    for begin in range(0, n, LANES):
        for i, state in enumerate(
            zip(*(a[begin : begin + LANES] for a in (tau, w, forcing, restitution)), strict=True)
        ):
            assign_lane(z, i, i, 9.0, state)
        launch_lanes(z)
        for i in range(LANES):
            k = begin + i
            step = orbit(tau[k], w[k], forcing[k], restitution[k], 1)[0]
            if z[NEEDS_SCALAR + i] > 0.0 or step[ORBIT_KIND] != MAP_IMPACT:
                continue
            compared += 1
            first = z[FIRST_DELAY + i]
            assert 0.0 <= first <= step[ORBIT_DELAY] * (1.0 + 1e-14)
            near += step[ORBIT_DELAY] - first < 0.25
    assert compared > n / 2
    assert near > 0.7 * compared


def test_trajectories_know_nothing_of_each_other() -> None:
    """The same bits in any order, in any company, in one go or in two."""
    n = 30 * LANES + 7
    whole = carried(starts(n, 32), 40)
    order = np.random.default_rng(33).permutation(n)[: LANES + 9]
    tau, w, forcing, restitution = (a[order] for a in starts(n, 32))
    part = carried((tau, w, forcing, restitution), 40)
    shared = carried(starts(n, 32), 40, workers=3)
    for k in range(3):
        np.testing.assert_array_equal(whole[k][order], part[k])
        np.testing.assert_array_equal(whole[k], shared[k])


def test_the_first_error_of_a_thread_is_raised() -> None:
    def work(part: slice) -> None:
        if part.start > 0:
            raise ValueError(f"at {part.start}")

    with pytest.raises(ValueError, match=f"at {4 * LANES}$"):
        in_slices(work, 20 * LANES, 2)


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
    return UNDECIDED, cap


def labelled(
    tau: Floats,
    w: Floats,
    forcing: float,
    points: Floats,
    of: Any,
    cap: int,
    workers: int = 1,
    repetitions: int = 1,
) -> tuple[NDArray[np.int32], NDArray[np.int32], Floats]:
    n = len(tau)
    out = LaneLabels(np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n))
    rule = LaneRule(1e-3, 4.0, CONTACT, REST, cap)
    label_lanes(
        tau, w, forcing, 0.5, known_points(points, of, repetitions), rule, out, workers=workers
    )
    return out.label, out.impacts, out.time


@pytest.mark.parametrize(
    ("forcing", "period", "cap", "labels", "repetitions"),
    [
        (0.45, 1, 300, {POINT_LABEL, CONTACT}, 1),
        (0.5, 2, 300, {POINT_LABEL, CONTACT}, 1),
        (0.5, 2, 300, {POINT_LABEL, CONTACT}, 7),
        (0.3, 1, 60, {REST}, 1),
        (0.45, 1, 22, {POINT_LABEL, CONTACT, UNDECIDED}, 1),
        (0.45, 1, 26, {POINT_LABEL, CONTACT, UNDECIDED}, 9),
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

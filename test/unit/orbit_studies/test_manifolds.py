"""Manifolds of saddles and edge tracking: they are the boundary of the basins."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.angles import wrap_to_pi
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import Attractors
from bouncing_disk_ros.maps.axial_iteration import iterate_backwards, iterate_forwards
from bouncing_disk_ros.maps.basin_labels import label_starts
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap, spread_starts
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.orbit_studies.edge_states import (
    boundary_pairs,
    edge_state,
    edge_states,
    saddle_of,
)
from bouncing_disk_ros.orbit_studies.manifold_growth import (
    GrowthRule,
    Stability,
    Window,
    enclosed_part,
    enclosed_share,
    no_return,
    saddle_manifolds,
    sides,
)
from reference.cases import examples, in_soak
from support.checks import refused

SHARES = {
    (0.34, 0.5): 0.11642, (0.45, 0.5): 0.34721, (0.6, 0.3): 0.249428, (0.65, 0.3): 0.330325,
    (0.55, 0.35): 0.251774,
}  # fmt: skip
"""Checked shares of the period-1 basin in the window; in the last three a branch leaves the window
far within one repetition and comes back."""


def attractors(
    axial_forcing: float, restitution: float = 0.5
) -> tuple[NextCollisionMap, Attractors]:
    section = NextCollisionMap(axial_forcing, restitution)
    starts = [(s.forcing_phase, s.axial_impact_velocity) for s in spread_starts(200, -5.0)]
    return section, find_attractors(section, starts)


def random_states(n: int, seed: int, window: Window | None = None) -> np.ndarray:
    rng = np.random.default_rng(seed)
    low, high, begin, end = window or Window()
    return np.stack((rng.uniform(begin, end, n) % math.tau, rng.uniform(low, high, n)), axis=1)


def test_the_map_backwards_undoes_the_map() -> None:
    states = random_states(5000, 1)
    ones = np.ones(len(states), np.int64)
    there = states.copy()
    iterate_backwards(there, ones, 0.5, 0.6, 1e3)
    hard = there[:, 1] < -1e-6  # an impact that grazes is one or none by rounding
    back = there.copy()
    iterate_forwards(back, ones, 0.5, 0.6)
    # rounding grows with the derivatives, of the order of 1/w
    error = np.abs(wrap_to_pi(back - states)[hard]).max(axis=1)
    bound = 1e-13 * (1.0 + 1.0 / np.minimum(np.abs(there[hard, 1]), np.abs(states[hard, 1])))
    flown = error < 0.1  # else the flight forwards chatters, and is no flight
    assert np.all(error[flown] < 100.0 * bound[flown])
    assert flown.mean() > 0.9


WINDOWS = [
    Window(), Window(-5.0, -1.0, 1.0, 3.0), Window(-3.0, -0.5, -2.0, 14.0),
    Window(-1.0, -0.2, 1.0, 3.0),  # a branch comes back from below it
]  # fmt: skip


@pytest.mark.parametrize(
    ("axial_forcing", "restitution"),
    [(0.34, 0.5), (0.45, 0.5), (0.65, 0.3), *in_soak((0.6, 0.3), (0.55, 0.35))],
)
def test_the_stable_manifold_encloses_the_share_of_the_basin(
    axial_forcing: float, restitution: float
) -> None:
    saddle = saddle_of(fixed_point(axial_forcing, restitution))
    fine, coarse = (
        enclosed_share(saddle_manifolds(saddle, "stable", GrowthRule(distance=distance)))
        for distance in (0.01, 0.02)
    )
    # as printed
    assert fine == pytest.approx(SHARES[axial_forcing, restitution], abs=1.1e-5)
    assert abs(fine - coarse) < 1e-6
    section, known = attractors(axial_forcing, restitution)
    n = examples(10_000)
    for window in WINDOWS:
        rule = GrowthRule(lowest=window.lowest)
        found = enclosed_part(saddle_manifolds(saddle, "stable", rule), window)
        labels = label_starts(known, section, *random_states(n, 7, window).T.copy()).label
        error = math.sqrt(found.share * (1.0 - found.share) / n)
        assert np.mean(labels == 1) == pytest.approx(found.share, abs=4.0 * error), window


def test_no_impact_before_a_fast_one_is_slower() -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        axial_forcing, restitution = 10.0 ** rng.uniform(-3.0, 2.0), rng.uniform(0.01, 0.999)
        least = no_return(axial_forcing, restitution)
        w = -least * (1.0 + 10.0 ** rng.uniform(-9.0, 1.0, 100))
        states = np.stack((rng.uniform(0.0, math.tau, 100), w), axis=1)
        iterate_backwards(states, np.ones(100, np.int64), axial_forcing, restitution, math.inf)
        assert np.all(states[:, 1] < w * (1.0 - 1e-12)), (axial_forcing, restitution)
    assert no_return(0.5, 1.0) == math.inf


def test_a_branch_without_end_is_not_complete() -> None:
    """At ε near 1 it comes back from far below the window, at Γ = 0.8 it has no end within it."""
    cases = {(0.8, 0.3): "points ran out", (0.3, 0.9): "points ran out"}
    for (axial_forcing, restitution), text in cases.items():
        rule = GrowthRule(distance=0.05, most=3000)
        branches = saddle_manifolds(saddle_of(fixed_point(axial_forcing, restitution)), "stable",
                                    rule)  # fmt: skip
        assert not branches[0].complete
        assert len(branches[0].sigma[0]) <= 3000
        refused(text, enclosed_share, branches)


def test_manifolds_keep_their_bounds_and_are_cut_at_grazes() -> None:
    """Two points of an unstable manifold on both sides of a cut come from neighbours."""
    rule = GrowthRule(distance=0.02, repetitions=16.0)
    saddle = saddle_of(fixed_point(0.45, 0.5))
    found = saddle_manifolds(saddle, Stability.UNSTABLE, rule)
    cuts = 0
    for branch in found:
        for piece in branch.pieces:
            assert np.max(np.hypot(*np.diff(piece, axis=0).T)) <= 1.5 * rule.distance
        for before, after, s, t in zip(branch.pieces, branch.pieces[1:], branch.sigma,
                                       branch.sigma[1:], strict=False):  # fmt: skip
            if t[0] - s[-1] > 1e-10:
                continue
            cuts += 1
            ends = np.array([before[-1], after[0]])
            assert np.hypot(wrap_to_pi(ends[1, 0] - ends[0, 0]), ends[1, 1] - ends[0, 1]) > 0.01
    assert cuts > 5


def test_edge_tracking_ends_in_the_saddle_and_the_sides_of_its_manifold_go_apart() -> None:
    section, known = attractors(0.45)
    saddle = saddle_of(fixed_point(0.45, 0.5))
    states = random_states(4000, 3)
    labels = label_starts(known, section, *states.T.copy()).label
    own, other = (states[labels == k][: examples(10)] for k in (0, 1))
    pairs = [
        (MapState(float(a[0]), float(a[1])), MapState(float(b[0]), float(b[1])))
        for a, b in zip(own, other, strict=False)
    ]
    found, lost = edge_states(section, known, pairs)
    assert lost == 0
    assert len(found) == 1
    assert found[0].state[:2] == pytest.approx(saddle.state[:2], abs=1e-9)
    state = edge_state(section, known, *pairs[0])
    assert sorted(state.labels) == [0, 1]
    assert state.orbit is not None
    branches = saddle_manifolds(saddle_of(fixed_point(0.45, 0.5)), Stability.STABLE)
    left, right = sides(branches, -5.0)
    ends = [set(label_starts(known, section, *states.T.copy()).label) for states in (left, right)]
    assert sorted(map(sorted, ends)) == [[0], [1]]
    assert len(left) > 100


def test_pairs_lie_on_both_sides_of_boundaries() -> None:
    labels = np.array([[0, 0, 1], [0, 1, 1], [-1, 1, 2]], np.int32)
    tau, w = np.array([1.0, 2.0, 3.0]), np.array([-3.0, -2.0, -1.0])
    pairs = boundary_pairs(labels, tau, w, 5)
    places = [(a.forcing_phase, b.forcing_phase, a.axial_impact_velocity) for a, b in pairs]
    assert places == [(2.0, 3.0, -3.0), (1.0, 2.0, -2.0), (2.0, 3.0, -1.0)]


def test_what_has_no_manifold_is_said() -> None:
    node = fixed_point(0.45, 0.5)
    refused("one above and one below 1", saddle_manifolds, node, "stable")
    saddle = saddle_of(node)
    refused("stability: got 'both', allowed: stable or unstable", saddle_manifolds, saddle, "both")
    refused("distance: got 0", saddle_manifolds, saddle, "stable", GrowthRule(distance=0.0))
    with pytest.raises(InputError, match="branches of a stable manifold"):
        enclosed_share(saddle_manifolds(saddle, "unstable", GrowthRule(repetitions=3.0)))
    short = saddle_manifolds(saddle, "stable", GrowthRule(repetitions=3.0))
    refused("followed for 3 repetitions only", enclosed_share, short)
    refused("an orbit of one impact", saddle_of, saddle._replace(forcing_phase=np.zeros(2)))
    section, known = attractors(0.45)
    with pytest.raises(InputError, match="two starts that go to two attractors"):
        edge_state(section, known, MapState(1.0, -0.1), MapState(1.1, -0.1))

"""Basins: starts without an end, times, shares, errors; and regions that no impact leaves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.absorbing_region import absorbing_regions
from bouncing_disk_ros.maps.attractor_search import find_attractors, window_attractors
from bouncing_disk_ros.maps.attractors import AttractorKind, Attractors
from bouncing_disk_ros.maps.basin_labels import LabelRule, impacts_needed, label_starts
from bouncing_disk_ros.maps.basin_measures import UNRESOLVED, shares
from bouncing_disk_ros.maps.lanes.axial_lanes import iterate_axial
from bouncing_disk_ros.maps.next_collision import NextCollisionMap


def attractors(axial_forcing: float, restitution: float = 0.5) -> Attractors:
    starts = [(float(t), float(w)) for w in -np.linspace(0.1, 4.9, 12)
              for t in np.linspace(0.1, 6.2, 12)]  # fmt: skip
    return find_attractors(NextCollisionMap(axial_forcing, restitution), starts)


def plane(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    w, tau = np.meshgrid(
        -5.0 + 5.0 * (np.arange(rows) + 0.5) / rows,
        math.tau * (np.arange(columns) + 0.5) / columns,
        indexing="ij",
    )
    return tau.ravel(), w.ravel()


def test_cap_too_small_leaves_starts_unresolved_and_merges_nothing() -> None:
    found = attractors(0.45)
    rule = LabelRule(cap=3)
    labels = label_starts(found, NextCollisionMap(0.45, 0.5), *plane(20, 20), rule).label
    enough = label_starts(found, NextCollisionMap(0.45, 0.5), *plane(20, 20)).label
    assert (labels == UNRESOLVED).any()
    known = labels != UNRESOLVED
    assert np.array_equal(labels[known], enough[known])


def test_starts_come_in_any_array_of_numbers() -> None:
    known, section, (tau, w) = attractors(0.45), NextCollisionMap(0.45, 0.5), plane(4, 5)
    expected = label_starts(known, section, tau, w)
    read_only = tau.copy()
    read_only.flags.writeable = False
    for phases in (tau.tolist(), np.repeat(tau, 2)[::2], tau.astype(">f8"), read_only):
        for found, wanted in zip(label_starts(known, section, phases, w), expected, strict=True):
            np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize(
    ("tau", "w"),
    [
        ([1.0], [0.5]),
        ([1.0], [math.nan]),
        ([math.nan], [-1.0]),
        ([math.inf], [-1.0]),
        ([1.0, 2.0], [-1.0]),
        ([1.0], [-1.0, -2.0]),
        ([[1.0]], [[-1.0]]),
        (["1.0"], [-1.0]),
        ([True], [-1.0]),
        ([1.0 + 0.0j], [-1.0]),
        (np.ma.masked_array([1.0, 2.0], [False, True]), [-1.0, -1.0]),
    ],
)
def test_starts_that_are_none_are_refused(tau: Any, w: Any) -> None:
    """Numbers that are no state were labelled, shorter arrays were read beyond their end."""
    with pytest.raises(InputError) as refused:
        label_starts(attractors(0.45), NextCollisionMap(0.45, 0.5), tau, w)
    assert refused.value.field in {"tau", "w", "tau, w"}


def test_times_do_not_depend_on_the_periods_of_other_attractors() -> None:
    """The eighth impact on an orbit counts, however long it must be followed to be sure."""
    known, section = attractors(0.45), NextCollisionMap(0.45, 0.5)
    one = next(a for a in known.found if a.kind is AttractorKind.PERIODIC)
    nowhere = one._replace(
        forcing_phases=np.linspace(0.0, 6.0, 20), velocities=np.full(20, -400.0), cycles=20
    )
    more = known._replace(found=(*known.found, nowhere))
    twelve = one._replace(forcing_phases=np.repeat(one.forcing_phases, 12),
                          velocities=np.repeat(one.velocities, 12), cycles=12)  # fmt: skip
    longer = known._replace(found=tuple(twelve if a is one else a for a in known.found))
    alone = label_starts(known, section, *plane(20, 20))
    for others in (more, longer):
        found = label_starts(others, section, *plane(20, 20))
        for first, second in zip(alone, found, strict=True):
            np.testing.assert_array_equal(first, second)


def test_slow_attractors_get_more_impacts_and_a_share_the_error_of_its_boundary() -> None:
    assert impacts_needed(attractors(0.45), 1e-4) < 1000
    assert impacts_needed(attractors(0.4859), 1e-4) > 10_000
    labels = (np.arange(100)[:, None] >= 50).repeat(80, 1).astype(np.int32)
    one = shares(labels, 2)[1]
    assert one.fraction == 0.5
    assert one.uncertainty == 0.5 * math.sqrt(80) / 8000


# --- absorbing regions ----------------------------------------------------------------------------
def found_attractors(axial_forcing: float) -> Attractors:
    centres = (np.arange(24) + 0.5) / 24
    section = NextCollisionMap(axial_forcing, 0.5)
    return window_attractors(section, math.tau * centres, -5.0 * (1.0 - centres))


def drawn(region_of: object, count: int) -> tuple[np.ndarray, np.ndarray]:
    draw = np.random.default_rng(55)
    tau, w = draw.uniform(0.0, math.tau, count), draw.uniform(-2.5, 0.0, count)
    inside = region_of.hold(tau, w)  # type: ignore[attr-defined]
    return tau[inside], w[inside]


@pytest.mark.parametrize("axial_forcing", [0.5526])
def test_impacts_stay_in_it(axial_forcing: float) -> None:
    section = NextCollisionMap(axial_forcing, 0.5)
    attractors = found_attractors(axial_forcing)
    ((label, region),) = absorbing_regions(section, attractors).items()
    assert attractors.found[label].kind is AttractorKind.CHAOTIC
    tau, w = drawn(region, 200_000)
    assert len(tau) > 500
    counts = np.zeros((len(tau), 2), np.int64)
    platform = np.full(len(tau), axial_forcing), np.full(len(tau), 0.5)
    for impacts in (*[1] * 50, 200, 1000):
        iterate_axial(tau, w, *platform, impacts, counts)
        assert region.hold(tau, w).all()
    assert not counts.any()


def test_it_holds_its_attractor_and_nothing_else_that_is_known_or_not() -> None:
    attractors = found_attractors(0.55)
    ((label, region),) = absorbing_regions(NextCollisionMap(0.55, 0.5), attractors).items()
    for place, one in enumerate(attractors.found):
        held = region.hold(one.forcing_phases, one.velocities)
        assert held.all() if place == label else not held.any()
    states = np.array([[math.nan, -1.0], [1.0, math.nan], [1.0, -1e6]]).T
    assert not region.hold(*states).any()


@pytest.mark.parametrize(
    "axial_forcing",
    [
        0.45,  # no chaos
        0.8,  # the attractor reaches impacts that are hardly any
        0.545,  # period 6 lies within the region
    ],
)
def test_where_there_is_none(axial_forcing: float) -> None:
    attractors = found_attractors(axial_forcing)
    assert absorbing_regions(NextCollisionMap(axial_forcing, 0.5), attractors) == {}

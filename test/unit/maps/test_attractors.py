"""Attractors of the axial map: any order of starts, and what roundings decide."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind, distance, rounding_decides
from bouncing_disk_ros.maps.axial_map import (
    MAP_CONTACT,
    MAP_IMPACT,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
    axial_orbit,
)
from bouncing_disk_ros.maps.bifurcation_diagram import begin, follow, from_starts
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap, spread_starts
from bouncing_disk_ros.maps.parameter_plane import settle_states, start_states

STARTS = [
    (float(tau), float(w)) for w in -np.linspace(0.1, 4.9, 12) for tau in np.linspace(0.1, 6.2, 12)
]


@pytest.mark.parametrize(("axial_forcing", "restitution"), [(0.487, 0.5), (0.45, 0.8)])
def test_order_of_the_starts_does_not_matter(axial_forcing: float, restitution: float) -> None:
    one = find_attractors(NextCollisionMap(axial_forcing, restitution), STARTS)
    other = find_attractors(NextCollisionMap(axial_forcing, restitution), STARTS[::-1])
    assert [a.name for a in one.found] == [a.name for a in other.found]
    for first, second in zip(one.found, other.found, strict=True):
        pair = [np.stack((a.forcing_phases, a.velocities), axis=1) for a in (first, second)]
        assert distance(*pair) < 1e-9


def test_starts_are_states_or_pairs_and_others_are_refused() -> None:
    section, starts = NextCollisionMap(0.45, 0.5), spread_starts(20, -5.0)
    pairs = find_attractors(section, [start[:2] for start in starts])
    states = find_attractors(section, starts)
    assert [one.name for one in states.found] == [one.name for one in pairs.found]
    for wrong, words in (
        ((math.nan, -1.0), "forcing_phase: got nan"),
        ((1.0, 0.5), "axial_impact_velocity: got 0.5"),
        ((1.0,), "state: got"),
        ((1.0, -1.0, 0.0, 0.0), "state: got"),
    ):
        with pytest.raises(InputError, match=words):
            find_attractors(section, [(1.0, -1.0), wrong])  # type: ignore[list-item]


def cycles_to_contact(axial_forcing: float, attractor: Attractor, change: float) -> int:
    """Periods from the first impact after contact, changed a little, to the next contact."""
    rows = np.empty((2000, 4))
    start = attractor.forcing_phases[0] + change, attractor.velocities[0]
    axial_orbit(*start, axial_forcing, 0.5, len(rows), rows)
    end = int(np.flatnonzero(rows[:, 3] == MAP_CONTACT)[0])
    return round(float(np.sum(rows[: end + 1, 2])) / math.tau)


@pytest.mark.parametrize(
    ("axial_forcing", "cycles"),
    [(0.48, 1), (0.54, 10), (0.55, 14), (0.58, 4), (0.52, 0), (0.57, 0), (0.59, 0), (0.60, 0)],
)
def test_cycles_are_told_where_rounding_does_not_decide_them(
    axial_forcing: float, cycles: int
) -> None:
    """A change by a few roundings leaves the number as it is, or it is not told."""
    found = find_attractors(NextCollisionMap(axial_forcing, 0.5), []).found[0]
    assert found.kind is AttractorKind.CHATTERING
    assert found.cycles == cycles
    told = f"({cycles} cycle{'s' if cycles > 1 else ''})" if cycles else "(cycles not known)"
    assert found.name == f"chattering {told}"
    changes = 1e-15 * np.arange(-10, 11)
    counts = {cycles_to_contact(axial_forcing, found, change) for change in changes.tolist()}
    assert (counts == {cycles}) if cycles else (len(counts) > 1)


# --- roundings ------------------------------------------------------------------------------------
MOST = 2000  # impacts from contact to contact that are looked at
Rows = NDArray[np.float64]


def from_contact(axial_forcing: float, restitution: float, part: float = 1.0) -> Rows | None:
    """Impacts from separation to the next contact, the first w_A multiplied; None: no contact."""
    rows = np.empty((MOST, 4))
    axial_orbit(1.5 * math.pi, 0.0, axial_forcing, restitution, 1, rows)
    tau, w = rows[0, ORBIT_TAU], rows[0, ORBIT_W] * part
    rows[0] = tau, w, 0.0, MAP_IMPACT
    count = axial_orbit(tau, w, axial_forcing, restitution, MOST - 1, rows[1:])
    ends = np.flatnonzero(rows[: count + 1, ORBIT_KIND] == MAP_CONTACT)
    return rows[: int(ends[0])].copy() if len(ends) else None


def test_what_roundings_do_not_decide_is_the_same_with_others() -> None:
    """And most of what they do decide is not: an error of 1e-3 can be too late to matter."""
    rng = np.random.default_rng(146)
    known = differ = decided = 0
    for _ in range(400):
        axial_forcing, restitution = 10.0 ** rng.uniform(-0.4, 2.0), rng.uniform(0.05, 0.6)
        one = from_contact(axial_forcing, restitution)
        if one is None:
            continue
        others = [
            from_contact(axial_forcing, restitution, 1.0 + k * 2.0**-52) for k in (-2, -1, 1, 2)
        ]
        same = all(other is not None and len(other) == len(one) for other in others)
        if rounding_decides(one, axial_forcing, restitution):
            decided += 1
            differ += not same
            continue
        known += 1
        assert same, (axial_forcing, restitution)
        for other in others:
            assert other is not None
            apart = np.abs(other - one)[:, : ORBIT_W + 1].max()
            assert apart < 0.05, (axial_forcing, restitution, apart)
    assert known > 100
    assert decided > 40
    assert differ > 0.6 * decided


@pytest.mark.parametrize(
    ("axial_forcing", "restitution"), [(72.84625, 0.1825), (72.8545, 0.182475)]
)
def test_fewer_impacts_can_be_decided_by_them_too(axial_forcing: float, restitution: float) -> None:
    parameters = np.array([[axial_forcing, restitution, 0.0, 50.0]])
    found = settle_states(parameters, start_states(parameters, "contact"), 2000, 2000)
    assert (found.kind[0], found.period[0], found.cycles[0]) == (1, 0, 0)
    assert math.isnan(found.mean_speed[0])


@pytest.mark.parametrize(
    ("axial_forcing", "restitution", "known"), [(72.84625, 0.1825, False), (0.4, 0.5, True)]
)
def test_a_diagram_has_no_speed_of_what_they_decide(
    axial_forcing: float, restitution: float, known: bool
) -> None:
    """Followed, and from starts; the impacts are there."""
    section = NextCollisionMap(axial_forcing, restitution, 0.0, 50.0)
    start = MapState(1.5 * math.pi, 0.0)
    values = np.array([axial_forcing])
    counts = {"settling": 50, "measured": 200, "kept": 50}
    branches = (
        follow(section, "axial_forcing", values, begin(section, start), **counts),
        from_starts(section, "axial_forcing", values, [start], **counts),
    )
    for branch in branches:
        assert np.isfinite(branch.forcing_phase).all()
        assert branch.contacts[0, 0] > 0.0
        assert np.isfinite(branch.mean_speed[0, 0]) == known
        assert np.isfinite(branch.mean_speed_per_impact[0, 0]) == known

"""Attractors of the axial map: any order of starts, and cycles that rounding may decide."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind, distance
from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, axial_orbit
from bouncing_disk_ros.maps.next_collision import NextCollisionMap, spread_starts

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

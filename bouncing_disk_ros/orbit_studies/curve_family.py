"""The curves of all attractors that the map has at one point of the plane of Γ and ε."""

from __future__ import annotations

import math

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind
from bouncing_disk_ros.maps.bifurcations import period_doublings
from bouncing_disk_ros.maps.next_collision import (
    MapState,
    NextCollisionMap,
    spread_starts,
)
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit, periodic_orbit
from bouncing_disk_ros.orbit_studies.contact_curves import contact_curves
from bouncing_disk_ros.orbit_studies.orbit_branch import KINDS, add_curves
from bouncing_disk_ros.orbit_studies.orbit_curves import LARGEST_STEP, Curve, Window

STARTS, LOWEST = 576, -5.0
"""So many starts show the attractors at the point, with w_A (πg/ω) from LOWEST to 0."""
LONGEST = 16
"""Orbits of more impacts are left out: their curves are too short to be seen."""


def curve_family(
    section: NextCollisionMap,
    window: Window | None = None,
    *,
    doublings: int = 2,
    largest_step: float = LARGEST_STEP,
    lost: list[str] | None = None,
) -> list[Curve]:
    """Curves of every attractor that the map has at its Γ and ε, within a window.

    A periodic attractor has fold, doubling and graze. Its orbits after each doubling along Γ have
    them too, `doublings` times. The attractor with contact has the onset of contact. An orbit that
    cannot be followed is in `lost`, and the others are computed all the same. Raises InputError for
    an empty window, or a point outside it.

    >>> curve_family(NextCollisionMap(0.45, 0.5), Window((0.4, 0.6), (0.4, 0.6)), doublings=0)
    """
    window = (window or Window()).checked()
    for name, value, (low, high) in zip(
        Window._fields, section.axial_parameters, window, strict=True
    ):
        if not low <= value <= high:
            raise InputError(name, value, f"a value within the window, {low:g} to {high:g}")
    starts = [(s.forcing_phase, s.axial_impact_velocity) for s in spread_starts(STARTS, LOWEST)]
    found: list[Curve] = []
    contact = False
    for attractor in find_attractors(section, starts).found:
        contact = contact or attractor.chatters
        for orbit in _orbits(attractor, section, window, doublings):
            try:
                add_curves(found, orbit, KINDS, window, largest_step)
            except InputError as error:  # what was found before is kept
                if lost is not None:
                    lost.append(f"{orbit.impacts} impacts in {orbit.cycles} periods: {error.line}")
    if contact:
        found += _contact(section, window, largest_step)
    return found


def _orbits(
    attractor: Attractor, section: NextCollisionMap, window: Window, doublings: int
) -> list[PeriodicOrbit]:
    """A periodic attractor as an orbit, and those it doubles into, up to LONGEST impacts."""
    n = len(attractor.forcing_phases)
    if attractor.kind is not AttractorKind.PERIODIC or n > LONGEST:
        return []
    first = MapState(float(attractor.forcing_phases[0]), float(attractor.velocities[0]))
    orbit = periodic_orbit(section, first, n)
    found = [orbit]
    limit = window.axial_forcing[1]
    count = min(doublings, int(math.log2(LONGEST / n)) + 1)
    if count > 0 and limit > section.axial_forcing:
        points = period_doublings(orbit, "axial_forcing", limit, count + 1)
        found += [point.orbit for point in points if point.orbit.impacts > n]
    return found


def _contact(section: NextCollisionMap, window: Window, largest_step: float) -> list[Curve]:
    try:
        return contact_curves(*section.axial_parameters, window, largest_step=largest_step)
    except InputError:  # contact comes back too late to be followed
        return []

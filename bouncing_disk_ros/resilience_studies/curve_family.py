"""The curves of all attractors in the plane of Γ and ε, and the curves of the onset of contact."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind
from bouncing_disk_ros.maps.axial_flights import contact_return
from bouncing_disk_ros.maps.continuation import period_doublings
from bouncing_disk_ros.maps.next_collision import (
    MapState,
    NextCollisionMap,
    spread_starts,
)
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit, periodic_orbit
from bouncing_disk_ros.resilience_studies.orbit_branch import KINDS, add_curves
from bouncing_disk_ros.resilience_studies.orbit_curves import LARGEST_STEP, Array, Curve, Window
from bouncing_disk_ros.resilience_studies.orbit_equations import CurveKind

# ------------------------------------------------------------------------------------------------
# Where the orbit that leaves contact stops coming back to it: onset of contact in (Γ, ε).
#
# All contact ends at separation, so one orbit decides. It comes to contact k periods later in a
# region of the plane. At the border of that region its time in contact falls to 0 (onset: a chatter
# that is complete just at separation), or a flight of it grazes the platform and it lands
# elsewhere. The chatter is resolved as in the simulation; the border is found by halving, to
# rounding.

MOST_IMPACTS = 3000
MOST_CYCLES = 40
"""Longer orbits are found and lost within rounding of Γ."""
_MARCH, _HALVINGS, _MOST_POINTS = 400, 60, 1000
_SHORT = 1e-3
"""A time in contact (rad) below this at the border: contact ends there. It falls as the square root
of the distance or faster, and the border is known to 1e-12."""
_FAN = 0.7
"""Half the angle (rad) in which the next point of a border is looked for."""


def contact_curves(
    axial_forcing: float,
    restitution: float,
    window: Window | None = None,
    *,
    largest_step: float = LARGEST_STEP,
) -> list[Curve]:
    """The border of the region around (Γ, ε) in which the orbit that leaves contact is the same.

    Curves of kind contact onset and of kind graze, each as far as it is found from the directions
    of Γ and ε. Raises InputError where that orbit holds no contact.

    >>> contact_curves(0.45, 0.5)[0].axial_forcing
    """
    window = (window or Window()).checked()
    cycles = _cycles(axial_forcing, restitution)
    if not 0 < cycles <= MOST_CYCLES:
        allowed = f"a point above Γ = 1/π where contact comes back within {MOST_CYCLES} periods"
        raise InputError("axial_forcing", axial_forcing, allowed)
    border = _Border(cycles, window, largest_step)
    found: list[Curve] = []
    for place in border.starts(np.array([axial_forcing, restitution])):
        if not any(_near(place, curve, largest_step) for curve in found):
            curve = border.traced(place)
            if curve is not None:
                found.append(curve)
    return found


def _cycles(axial_forcing: float, restitution: float) -> int:
    return round(contact_return(axial_forcing, restitution, MOST_IMPACTS)[0])


def _near(place: Array, curve: Curve, step: float) -> bool:
    far = np.hypot(curve.axial_forcing - place[0], curve.restitution - place[1])
    return bool(far.min() < 0.6 * step)


class _Border:
    """The border of a region where the orbit comes back to contact after `cycles` periods."""

    def __init__(self, cycles: int, window: Window, step: float) -> None:
        self.cycles, self.step = cycles, step
        self.sides = window.sides()

    def inside(self, place: Array) -> bool:
        """Whether the orbit is the same at a place."""
        if place[0] < 0.0 or not 0.0 <= place[1] < 1.0:
            return False
        return _cycles(float(place[0]), float(place[1])) == self.cycles

    def shown(self, place: Array) -> bool:
        """Whether a place is in the window."""
        return bool(np.all(place >= self.sides[:, 0]) and np.all(place <= self.sides[:, 1]))

    def halved(self, inner: Array, outer: Array) -> Array:
        """The last place inside on the way between one inside and one outside."""
        for _ in range(_HALVINGS):
            middle = 0.5 * (inner + outer)
            if self.inside(middle):
                inner = middle
            else:
                outer = middle
        return inner

    def starts(self, place: Array) -> Iterator[Array]:
        """Places of the border in the directions of Γ and ε."""
        for k, side in ((0, 1), (0, 0), (1, 1), (1, 0)):
            end = place.copy()
            end[k] = self.sides[k, side]
            last = place
            for part in np.linspace(0.0, 1.0, _MARCH + 1)[1:]:
                point = place + part * (end - place)
                if not self.inside(point):
                    yield self.halved(last, point)
                    break
                last = point

    def kind(self, place: Array) -> CurveKind | None:
        """What the border is at a place just inside; None: Γ = 1/π, where contact becomes rest."""
        contact = contact_return(float(place[0]), float(place[1]), MOST_IMPACTS)[1]
        if place[0] < 1.0 / math.pi + 1e-9:
            return None
        return CurveKind.CONTACT_ONSET if contact < _SHORT else CurveKind.GRAZE

    def traced(self, start: Array) -> Curve | None:
        """The border through a place, as far as it is of one kind."""
        kind = self.kind(start)
        if kind is None or not self.shown(start):
            return None
        direction = self.direction(start)
        if direction is None:
            return None
        ahead = list(self.followed(start, direction, kind))
        back = list(self.followed(start, -direction, kind))
        places = np.array([*reversed(back), start, *ahead])
        forcing, restitution = places.T.copy()
        leave = np.arcsin(1.0 / (math.pi * forcing))
        allowed = np.ones(len(places), bool)
        return Curve(kind, 0, self.cycles, forcing, restitution, leave[:, None], allowed, ())

    def direction(self, place: Array) -> Array | None:
        """A direction along the border: from the places where a small circle crosses it."""
        radius = 0.1 * self.step
        angles = np.linspace(0.0, math.tau, 65)
        circle = place + radius * np.stack((np.cos(angles), np.sin(angles)), axis=1)
        within = np.array([self.inside(point) for point in circle])
        turns = np.flatnonzero(within[1:] != within[:-1])
        if not len(turns):
            return None
        middle = 0.5 * (angles[turns[0]] + angles[turns[0] + 1])
        return np.array([math.cos(middle), math.sin(middle)])

    def followed(self, start: Array, direction: Array, kind: CurveKind) -> Iterator[Array]:
        """The places of the border after `start`, to the window's side or to another kind."""
        place, length, first = start, 0.25 * self.step, start
        for count in range(_MOST_POINTS):
            found = None
            while found is None and length > 0.02 * self.step:
                found = self.ahead(place, direction, length)
                length = length if found is not None else 0.5 * length
            if found is None or not self.shown(found) or self.kind(found) is not kind:
                return
            yield found
            way = found - place
            direction = way / float(np.hypot(*way))
            place, length = found, min(1.3 * length, self.step)
            if count > 8 and float(np.hypot(*(place - first))) < 0.5 * length:
                return

    def ahead(self, place: Array, direction: Array, length: float) -> Array | None:
        """The place of the border at a distance, in a fan about a direction; None: not there."""
        across = np.array([-direction[1], direction[0]])
        ends = [
            place + length * (math.cos(_FAN) * direction + sense * math.sin(_FAN) * across)
            for sense in (1.0, -1.0)
        ]
        within = [self.inside(end) for end in ends]
        if within[0] == within[1]:
            return None
        inner, outer = ends if within[0] else reversed(ends)
        return self.halved(inner, outer)


# ------------------------------------------------------------------------------------------------
# The curves of all attractors at one point of the plane of Γ and ε.


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

    >>> curve_family(NextCollisionMap(0.45, 0.5))
    """
    window = (window or Window()).checked()
    place = section.axial_forcing, section.restitution
    for name, value, (low, high) in zip(Window._fields, place, window, strict=True):
        if not low <= value <= high:
            raise InputError(name, value, f"a value within the window, {low:g} to {high:g}")
    starts = [(s.forcing_phase, s.axial_impact_velocity) for s in spread_starts(STARTS, LOWEST)]
    found: list[Curve] = []
    contact = False
    for attractor in find_attractors(section, starts).found:
        contact = contact or attractor.kind is AttractorKind.CHATTERING
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
        return contact_curves(
            section.axial_forcing, section.restitution, window, largest_step=largest_step
        )
    except InputError:  # contact comes back too late to be followed
        return []

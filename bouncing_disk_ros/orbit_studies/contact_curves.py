"""Onset of contact in (Γ, ε): where the orbit that leaves contact stops coming back to it.

All contact ends at separation, so one orbit decides. It comes to contact k periods later in a
region of the plane. At the border of that region its time in contact falls to 0 (onset: a chatter
that is complete just at separation), or a flight of it grazes the platform and it lands
elsewhere. The chatter is resolved as in the simulation; the border is found by halving, to
rounding.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.orbit_kernels import contact_return
from bouncing_disk_ros.orbit_studies.orbit_curves import LARGEST_STEP, Array, Curve, Window
from bouncing_disk_ros.orbit_studies.orbit_equations import CurveKind
from bouncing_disk_ros.scalar_search import halved

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
        return halved(self.inside, inner, outer, steps=_HALVINGS)[0]

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

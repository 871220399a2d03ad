"""Search for the attractors of the axial next-collision map; none is given beforehand."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import plain
from bouncing_disk_ros.maps.attractors import (
    LOWEST,
    SAME,
    Attractor,
    AttractorKind,
    Attractors,
    Cells,
    Floats,
    distance,
    rounding_decides,
    same,
    separation,
)
from bouncing_disk_ros.maps.axial_map import (
    MAP_IMPACT,
    MAP_REST,
    ORBIT_DELAY,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
    axial_orbit,
)
from bouncing_disk_ros.maps.lanes.axial_lanes import iterated
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit, periodic_orbit
from bouncing_disk_ros.maps.rotation_map import LYAPUNOV, measure_attractor

LONGEST = 64
"""Most impacts in one repetition of an orbit that is looked for."""
SETTLING = 2_000
"""Impacts before an orbit is first looked at; four times as many at each further look ..."""
PATIENCE = 128_000
"""... up to these: then it is chaotic, if its Lyapunov exponent says so."""
NEAR = 1e-2
"""An orbit that repeats this well is handed to Newton's method."""
VISITS = 50_000
"""... in so many impacts."""
CLEARLY = 20.0
"""An orbit is chaotic when a small change grows by more than e^CLEARLY over VISITS impacts."""
SEARCHED = 24
"""Starts along each axis of a window from which its attractors are looked for, at most."""
MOST_OPEN = 64
"""So many of the starts that are left open are followed to find attractors that were missed."""


def find_attractors(
    section: NextCollisionMap, starts: Sequence[tuple[float, float] | MapState]
) -> Attractors:
    """Attractors reached from contact and from a list of starts (τ, w_A < 0), in this order.

    Only Γ and ε of `section` are used, and no w_T of a state. Raises InputError for starts that
    are none.

    An orbit is periodic when Newton's method, started from a piece of it that nearly repeats, finds
    an orbit of that period with all multipliers within the unit circle; chaotic when PATIENCE
    impacts have shown none and the Lyapunov exponent is above 0; anything else is not resolved.

    >>> section = NextCollisionMap(axial_forcing=0.48, restitution=0.5)
    >>> find_attractors(section, [(tau, -1.3) for tau in (0.5, 1.5, 2.5, 3.5)]).found
    """
    search = _Search(section)
    after_contact = search.contact()
    settled = _without_contact(section, starts)
    while len(settled):
        place = search.follow(float(settled[0, ORBIT_TAU]), float(settled[0, ORBIT_W]))
        settled = settled[1:]
        if place >= 0:
            settled = _not_on(search.found[place], settled)
    order = sorted(range(len(search.found)), key=lambda i: _rank(search.found[i]))
    found = tuple(search.found[i] for i in order)
    after = order.index(after_contact) if after_contact >= 0 else -1
    return Attractors(found, after, search.unresolved)


def window_attractors(
    section: NextCollisionMap, forcing_phases: Floats, velocities: Floats
) -> Attractors:
    """Attractors reached from contact and from some starts of a window, given by its axes.

    The starts are SEARCHED of the forcing phases τ (rad) with SEARCHED of the velocities w_A, all
    of an axis that has fewer.
    """
    phases, speeds = (
        axis[np.unique(np.linspace(0, len(axis) - 1, SEARCHED).astype(int))].tolist()
        for axis in (forcing_phases, velocities)
    )
    return find_attractors(section, [(tau % math.tau, w) for w in speeds for tau in phases])


def missed_attractors(
    section: NextCollisionMap, known: Attractors, starts: Floats
) -> list[Attractor]:
    """Attractors that none of `known` is, reached from some of the starts (n, 2) left open.

    A search from a grid of starts misses those whose basins lie between its points.
    """
    chosen = np.unique(np.linspace(0, len(starts) - 1, MOST_OPEN).astype(int))
    some = [(float(tau), float(w)) for tau, w in starts[chosen]]
    found = find_attractors(section, some).found if some else ()
    return [
        one
        for one in found
        if not any(one.kind is other.kind and same(other, one) for other in known.found)
    ]


def _without_contact(
    section: NextCollisionMap, starts: Sequence[tuple[float, float] | MapState]
) -> Floats:
    """States (n, 2) after SETTLING impacts, of the starts that have not come to contact."""
    given = plain(starts)
    if not isinstance(given, Iterable):
        raise InputError("starts", starts, "a list of states, (τ, w_A) each")
    states = [section.checked(start) for start in given]
    tau, w = np.array([state[:2] for state in states]).reshape(-1, 2).T
    tau, w, counts = iterated(tau, w, section.axial_parameters, SETTLING)
    return np.stack((tau, w), axis=1)[~counts.any(axis=1)]


def _not_on(attractor: Attractor, states: Floats) -> Floats:
    """Those of the states that are not at a point of a periodic attractor; else all."""
    if attractor.kind is AttractorKind.PERIODIC:
        for tau, w in zip(attractor.forcing_phases, attractor.velocities, strict=True):
            states = states[separation(states, np.array([[tau, w]])) >= SAME]
    return states


def _rank(attractor: Attractor) -> tuple[int, int, int, float]:
    """Order of the labels: rest, chattering, periodic by period, chaotic."""
    kinds = list(AttractorKind)
    first = float(attractor.forcing_phases[0]) if len(attractor.forcing_phases) else 0.0
    return kinds.index(attractor.kind), len(attractor.forcing_phases), attractor.cycles, first


class _Search:
    """Gathers attractors, one orbit after the other."""

    def __init__(self, section: NextCollisionMap) -> None:
        self._section = NextCollisionMap(*section.axial_parameters)
        self.found: list[Attractor] = []
        self.unresolved = 0
        self._after_contact = -1
        self._cells: dict[int, Cells] = {}

    def contact(self) -> int:
        """Follow the orbit that leaves contact; the place of its attractor in `found`, or −1."""
        rows = self._orbit(LOWEST, 0.0, 1)
        if rows[0, ORBIT_KIND] == MAP_REST:
            place = self._add(Attractor(AttractorKind.REST, np.empty(0), np.empty(0), 0, 0.0))
        else:
            place = self.follow(
                float(rows[0, ORBIT_TAU]), float(rows[0, ORBIT_W]), from_contact=True
            )
        self._after_contact = place
        return place

    def follow(self, tau: float, w: float, *, from_contact: bool = False) -> int:
        """Iterate until it is clear where the orbit ends; its place in `found`, or −1.

        The start is settled: SETTLING impacts old, without contact; or it is the one from contact.
        """
        gathered = [np.array([[tau, w, 0.0, MAP_IMPACT]])]
        # a settled orbit shows its period at once; chaos is known by more impacts
        done, impacts = 0, SETTLING if from_contact else 2 * LONGEST
        while done < PATIENCE:
            last = gathered[-1][-1]
            rows = self._orbit(float(last[ORBIT_TAU]), float(last[ORBIT_W]), impacts)
            gathered = [*gathered, rows] if from_contact else [rows]
            contacts = np.flatnonzero(rows[:, ORBIT_KIND] != MAP_IMPACT)
            if len(contacts) and not from_contact:
                return self._after_contact
            if len(contacts):
                return self._chattering(np.concatenate(gathered), done + 1 + int(contacts[0]))
            place = self._periodic(rows)
            if place < 0 and impacts >= SETTLING:
                place = self._known_chaos(rows)
            if place >= 0:
                return place
            done += impacts
            impacts = min(max(SETTLING, 3 * done), PATIENCE - done)
        return self._chaotic(rows)

    def _orbit(self, tau: float, w: float, impacts: int) -> Floats:
        rows = np.empty((impacts, 4))
        return rows[: axial_orbit(tau, w, *self._section.axial_parameters, impacts, rows)]

    def _add(self, attractor: Attractor) -> int:
        """Its place in `found`, new or not."""
        for place, known in enumerate(self.found):
            if attractor.kind is known.kind and same(attractor, known):
                return place
        self.found.append(attractor)
        return len(self.found) - 1

    def _chattering(self, rows: Floats, end: int) -> int:
        """The orbit from separation to separation; rows[end] is the first impact of the next."""
        one, after = rows[:end], rows[1 : end + 1]
        cycles = round(float(np.sum(after[:, ORBIT_DELAY])) / math.tau)
        if rounding_decides(one, *self._section.axial_parameters):
            cycles = 0
        found = Attractor(
            AttractorKind.CHATTERING, one[:, ORBIT_TAU].copy(), one[:, ORBIT_W].copy(), cycles, 0.0
        )
        return self._add(found)

    def _periodic(self, rows: Floats) -> int:
        """The place of a periodic attractor that the end of an orbit is on, or −1."""
        back = rows[-2 : -LONGEST - 2 : -1]  # 1, 2, … impacts before the last
        far = separation(back, rows[-1:]) > NEAR
        for period in (int(place) + 1 for place in np.flatnonzero(~far)):
            one, next_one = rows[-2 * period : -period], rows[-period:]
            if len(one) < period or distance(one, next_one) > NEAR:
                continue
            start = MapState(float(rows[-1, ORBIT_TAU]), float(rows[-1, ORBIT_W]))
            try:
                found = _attractor_of(periodic_orbit(self._section, start, period))
            except InputError:  # Newton's method came to nothing
                continue
            if found is not None:
                return self._add(found)
        return -1

    def _known_chaos(self, rows: Floats) -> int:
        """The place of a chaotic attractor that all these impacts lie on, or −1."""
        for place, known in enumerate(self.found):
            if known.kind is AttractorKind.CHAOTIC:
                cells = self._cells.get(place) or self._cells.setdefault(place, Cells(known))
                if cells.hold(rows[:, ORBIT_TAU], rows[:, ORBIT_W]).all():
                    return place
        return -1

    def _chaotic(self, rows: Floats) -> int:
        """The place of a chaotic attractor, or −1 if the exponent is not above 0."""
        state = np.array([rows[-1, ORBIT_TAU], rows[-1, ORBIT_W], 0.0, 1.0, 0.0])
        out, results = np.empty((VISITS, 6)), np.empty(5)
        given = (*self._section.axial_parameters, 0.0, math.inf)
        measure_attractor(state, *given, 0, VISITS, out, results)
        exponent = float(results[LYAPUNOV])
        if exponent * VISITS < CLEARLY:
            self.unresolved += 1
            return -1
        phases, speeds = out[:, ORBIT_TAU].copy(), out[:, ORBIT_W].copy()
        return self._add(Attractor(AttractorKind.CHAOTIC, phases, speeds, 0, math.exp(exponent)))


def _attractor_of(orbit: PeriodicOrbit) -> Attractor | None:
    """A stable orbit without contact as an attractor; None for others, or of a shorter period."""
    if orbit.contacts or not orbit.stable:
        return None
    first = int(np.argmin(orbit.axial_impact_velocity))  # it begins with its hardest impact
    phases = np.roll(orbit.forcing_phase, -first)
    speeds = np.roll(orbit.axial_impact_velocity, -first)
    points = np.stack((phases, speeds), axis=1)
    for part in (k for k in range(1, orbit.impacts) if orbit.impacts % k == 0):
        if distance(points, np.roll(points, part, axis=0)) < SAME:
            return None
    size = abs(orbit.multipliers[0])
    return Attractor(AttractorKind.PERIODIC, phases, speeds, orbit.cycles, size)

"""Edge tracking: the state that trajectories on the boundary between two basins go to.

Two starts with unlike ends are brought together by bisection; both are followed until they are
apart, and brought together again, so that the pair stays on the boundary (J. Skufca, J. Yorke,
B. Eckhardt, Phys. Rev. Lett. 96, 174101, 2006). Where a graze tears a pair apart at once, the line
between its images is searched instead. An orbit that repeats is polished by Newton's method.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.angles import wrap_to_pi
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractors import SAME, Attractors, distance
from bouncing_disk_ros.maps.axial_iteration import iterate_forwards
from bouncing_disk_ros.maps.basin_labels import label_starts
from bouncing_disk_ros.maps.basin_measures import UNRESOLVED
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit, periodic_orbit

Array = NDArray[np.float64]

TOGETHER, APART = 1e-10, 1e-5
"""Distances at which a pair is followed, and brought together again."""
_SECTIONS = 32
_STRETCHES = 60
_LONGEST = 16
_REPEATS, _NEAR = 1e-4, 1e-2
"""A trajectory that repeats so well is handed to Newton's method, whose orbit must be this near."""


class EdgeState(NamedTuple):
    """State to which a trajectory on the boundary goes."""

    orbit: PeriodicOrbit | None  # the saddle; None: none was found, a chaotic set perhaps
    trajectory: Array  # (n, 2) τ and w_A of the impacts on the boundary
    labels: tuple[int, int]  # of the two basins, as those of `label_starts`


def edge_state(
    section: NextCollisionMap, known: Attractors, first: MapState, second: MapState
) -> EdgeState:
    """State on the boundary between the basins of two starts, by edge tracking.

    Raises InputError where both starts have one end, or the end of one start is not known.

    >>> section = NextCollisionMap(axial_forcing=0.45, restitution=0.5)
    >>> known = find_attractors(section, [(0.7, -1.3)])
    >>> edge_state(section, known, MapState(0.7, -1.3), MapState(3.0, -1.0))
    """
    pair = np.array([section.checked(first)[:2], section.checked(second)[:2]])
    labels = _labels(section, known, pair)
    if labels[0] == labels[1] or UNRESOLVED in labels:
        allowed = "two starts that go to two attractors"
        raise InputError("first, second", f"labels {labels[0]} and {labels[1]}", allowed)
    track: list[Array] = []
    for _ in range(_STRETCHES):
        pair = _together(section, known, pair, int(labels[0]))
        stretch, pair = _followed(section, pair)
        track += stretch
        orbit = _repeating(section, track)
        if orbit is not None:
            return EdgeState(orbit, np.array(track), (int(labels[0]), int(labels[1])))
        now = _labels(section, known, pair)
        if now[0] == now[1]:  # both were taken to one side by rounding, or at a graze
            break
        labels = now
    return EdgeState(None, np.array(track).reshape(-1, 2), (int(labels[0]), int(labels[1])))


def _labels(section: NextCollisionMap, known: Attractors, states: Array) -> NDArray[np.int32]:
    tau, w = states.T.copy()
    return label_starts(known, section, tau % math.tau, np.minimum(w, -1e-300)).label


def _together(section: NextCollisionMap, known: Attractors, pair: Array, own: int) -> Array:
    """Two states on the line between a pair, TOGETHER apart, the first with the label `own`."""
    a, way = pair[0], pair[1] - pair[0]
    way[0] = float(wrap_to_pi(way[0]))
    low, high = 0.0, 1.0
    size = float(np.hypot(*way))
    parts = np.linspace(0.0, 1.0, _SECTIONS + 1)[1:-1]
    while (high - low) * size > TOGETHER:
        at = low + (high - low) * parts
        unlike = np.flatnonzero(_labels(section, known, a + at[:, None] * way) != own)
        if len(unlike):
            k = int(unlike[0])
            low, high = (at[k - 1] if k else low), at[k]
        else:
            low = at[-1]
    return np.array([a + low * way, a + high * way])


def _followed(section: NextCollisionMap, pair: Array) -> tuple[list[Array], Array]:
    """Impacts of a pair up to where it is apart; the pair there."""
    found: list[Array] = []
    one = np.ones(2, np.int64)
    for _ in range(10_000):
        states = pair.copy()
        states[:, 0] %= math.tau
        iterate_forwards(states, one, *section.axial_parameters)
        if not np.all(np.isfinite(states)):
            break
        pair = states
        way = states[1] - states[0]
        way[0] = float(wrap_to_pi(way[0]))
        if float(np.hypot(*way)) > APART:
            break
        found.append(states[0].copy())
    return found, pair


def _repeating(section: NextCollisionMap, track: list[Array]) -> PeriodicOrbit | None:
    """A saddle that the end of a trajectory is near; None: none."""
    for period in range(1, _LONGEST + 1):
        if len(track) < 2 * period:
            return None
        for end in range(len(track), max(len(track) - 24, 2 * period - 1), -1):
            rows = np.array(track[end - 2 * period : end])
            if distance(rows[:period], rows[period:]) > _REPEATS:
                continue
            try:
                orbit = periodic_orbit(section, MapState(*map(float, rows[-1])), period)
            except InputError:
                continue
            place = np.array([[orbit.forcing_phase[0], orbit.axial_impact_velocity[0]]])
            if distance(place, rows[-1:]) < _NEAR and not orbit.stable:
                return orbit
    return None


def edge_states(
    section: NextCollisionMap,
    known: Attractors,
    pairs: Sequence[tuple[MapState, MapState]],
) -> tuple[list[PeriodicOrbit], int]:
    """The saddles that edge tracking finds from pairs of starts, each once; how many found none."""
    saddles: list[PeriodicOrbit] = []
    lost = 0
    for first, second in pairs:
        try:
            orbit = edge_state(section, known, first, second).orbit
        except InputError:  # an end that is not known
            orbit = None
        if orbit is None:
            lost += 1
        elif not any(_same(orbit, other) for other in saddles):
            saddles.append(orbit)
    return saddles, lost


def _same(first: PeriodicOrbit, second: PeriodicOrbit) -> bool:
    if first.impacts != second.impacts:
        return False
    rows = np.stack((first.forcing_phase, first.axial_impact_velocity), axis=1)
    others = np.stack((second.forcing_phase, second.axial_impact_velocity), axis=1)
    return any(distance(np.roll(rows, k, axis=0), others) < SAME for k in range(first.impacts))


def boundary_pairs(
    labels: NDArray[np.int32], tau: Array, w: Array, most: int
) -> list[tuple[MapState, MapState]]:
    """Pairs of neighbours with unlike labels (rows of w, columns of τ), at most `most` of each two.

    Spread over the map; pairs with an unresolved start are left out.
    """
    found: dict[tuple[int, int], list[tuple[MapState, MapState]]] = {}
    for i, j in np.argwhere(labels[:, 1:] != labels[:, :-1]):
        a, b = sorted((int(labels[i, j]), int(labels[i, j + 1])))
        if a != UNRESOLVED:
            pair = MapState(float(tau[j]), float(w[i])), MapState(float(tau[j + 1]), float(w[i]))
            found.setdefault((a, b), []).append(pair)
    chosen = []
    for several in found.values():
        places = np.unique(np.linspace(0, len(several) - 1, most).astype(int))
        chosen += [several[k] for k in places]
    return chosen


def saddle_of(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """Saddle that an orbit of one impact meets at its fold: cos τ the same, sin τ opposite.

    Raises InputError for other orbits, or where a flight of the saddle is cut short.

    >>> saddle_of(fixed_point(0.45, 0.5)).multipliers
    """
    if orbit.impacts != 1 or orbit.contacts:
        raise InputError("orbit", repr(orbit), "an orbit of one impact, without contact")
    tau, w, _ = orbit.state
    found = periodic_orbit(orbit.map, MapState(-tau, w), 1)
    if found.cycles != orbit.cycles or abs(found.axial_impact_velocity[0] - w) > 1e-6:
        allowed = "a forcing and restitution at which no flight of the saddle is cut short"
        raise InputError("orbit", repr(orbit), allowed)
    return found

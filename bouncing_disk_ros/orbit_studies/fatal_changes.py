"""Fatal changes: the smallest impulse or error in time after which an orbit is not reached again.

The starts that a change of growing size leads to are a line in the plane of starts. An orbit is
reached again where its attractor is, within a number of periods (a chaotic one: unless another is
reached). The sizes that are fatal are intervals: the line is looked at in steps of a part of the
size, and the edge of the first interval found is halved to rounding (of a chaotic attractor to
1e-6 of it). Intervals narrower than a step may be missed.

Units of the next-collision map: time is phase (rad), lengths are in πg/ω², velocities in πg/ω.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractors import AttractorKind, Attractors
from bouncing_disk_ros.maps.axial_iteration import land_from_height
from bouncing_disk_ros.maps.basin_labels import (
    LONGER,
    MOST,
    LabelRule,
    StartLabels,
    chaotic_labels,
    impacts_needed,
    label_followed,
    label_starts,
)
from bouncing_disk_ros.maps.basin_measures import UNRESOLVED
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.orbit_studies.orbit_instants import Array, Instants

Flights = Callable[[NDArray[np.intp], Array], Array]
"""Of indices (k,) and changes (k,): the (phase, gap, relative speed) (k, 3) after them."""

Fates = NDArray[np.int8]
SURVIVED, UNDECIDED, LOST = 1, 0, -1
MOST_FOLLOWED = LONGER * MOST
"""Impacts after which it stays undecided whether a disk that is on no known attractor is lost."""

_HALVINGS, _HALVINGS_OF_CHAOS = 44, 15
"""To rounding; of a chaotic attractor to 1e-6 of the size, for the orbit is but a sample of it."""
_LEVELS = 2
"""Where the first size is fatal, sizes down to a thousandth of it are looked at; then it is 0."""
CHAOTIC_RESOLUTION = 0.05
"""Of a chaotic attractor, whose starts take the most impacts."""
_BLOCK = 200_000


class FatalRule(NamedTuple):
    """Rule that says when an orbit is lost, and how fatal changes are searched for."""

    periods: float = 1000.0  # of the platform, within which the orbit must be reached again
    smallest: float = 1e-2  # first size that is looked at; smaller ones where it is fatal
    largest: float = 5.0  # impulse, m·πg/ω
    resolution: float = 0.01  # intervals of sizes wider than this part of the size are found

    def checked(self) -> FatalRule:
        """The rule, if it is one. Raises InputError."""
        if not self.periods > 0.0:
            raise InputError("periods", self.periods, "a number > 0")
        if not 0.0 < self.smallest < self.largest < math.inf:
            raise InputError("largest", self.largest, f"a number > {self.smallest:g}")
        if not 1e-6 <= self.resolution <= 1.0:
            raise InputError("resolution", self.resolution, "a number from 1e-6 to 1")
        return self


def fatal_impulses(
    section: NextCollisionMap,
    known: Attractors,
    label: int,
    instants: Instants,
    rule: FatalRule | None = None,
) -> Array:
    """Smallest fatal impulses (2, m) at each instant, upwards first, in m·πg/ω; inf: none found.

    `label`: index in `known` of the attractor that the instants are on. An impulse changes the
    velocity of the disk; in contact, or where it acts against the flight at gap 0, an impact
    follows at once. 0: fatal however small, down to 1e-3 of the rule's smallest. nan: MOST_FOLLOWED
    impacts after one of the sizes did not decide, or the rule's periods are too few to find that
    the unchanged orbit is reached. Raises InputError for a rule out of range.

    >>> section = NextCollisionMap(axial_forcing=0.45, restitution=0.5)
    >>> known = find_attractors(section, [(0.7, -1.3)])
    >>> fatal_impulses(section, known, 1, instants_of(known.found[1], section, 8)).min(axis=1)
    """
    rule = (rule or FatalRule()).checked()

    def flights(which: NDArray[np.intp], change: Array) -> Array:
        gap, speed = instants.gap[which], instants.speed[which] + change
        return np.stack((instants.forcing_phase[which], gap, speed), axis=1)

    return _fatal_both_ways(section, known, label, len(instants.gap), flights, rule)


def fatal_timing_errors(
    section: NextCollisionMap,
    known: Attractors,
    label: int,
    rule: FatalRule | None = None,
    most: int = 16,
) -> Array:
    """Smallest fatal timing errors (2, m) at the impacts of an attractor, late first, rad.

    The impact comes at the phase τ + δ or τ − δ, with the velocity that the disk would have had.
    m: impacts in one repetition, `most` at most. inf: none up to π. Raises as `fatal_impulses`.

    >>> section = NextCollisionMap(axial_forcing=0.45, restitution=0.5)
    >>> known = find_attractors(section, [(0.7, -1.3)])
    >>> fatal_timing_errors(section, known, label=1).min(axis=1)
    """
    rule = (rule or FatalRule()).checked()._replace(largest=math.pi)
    attractor = known.found[label]
    tau, w = attractor.forcing_phases[:most], attractor.velocities[:most]

    def flights(which: NDArray[np.intp], change: Array) -> Array:
        phase = tau[which] + change
        speed = w[which] + section.axial_forcing * (np.cos(tau[which]) - np.cos(phase))
        return np.stack((phase % math.tau, np.zeros(len(which)), speed), axis=1)

    return _fatal_both_ways(section, known, label, len(tau), flights, rule)


def fates(
    section: NextCollisionMap, known: Attractors, label: int, flights: Array, periods: float
) -> Fates:
    """Whether disks at (phase, gap, relative speed) (k, 3) reach an attractor within periods.

    SURVIVED, LOST, or UNDECIDED where MOST_FOLLOWED impacts are not enough to say. A chaotic
    attractor is reached at no time that is known: it is lost where another one is reached.
    """
    states = np.empty((len(flights), 3))
    land_from_height(np.ascontiguousarray(flights), section.axial_forcing, states)
    tau, w = states[:, 0].copy(), np.minimum(states[:, 1], -1e-300)
    if known.found[label].kind is AttractorKind.CHAOTIC:
        return _fates_of(label_starts(known, section, tau, w).label, label)
    return _fates_in_time(section, known, label, (tau, w), math.tau * periods - states[:, 2])


def _fates_of(labels: NDArray[np.int32], own: int) -> Fates:
    """The fates of starts whose labels decide."""
    lost = np.where(labels == UNRESOLVED, UNDECIDED, LOST)
    return np.where(labels == own, SURVIVED, lost).astype(np.int8)


def _fates_in_time(
    section: NextCollisionMap, known: Attractors, label: int, starts: tuple[Array, Array],
    time_left: Array,
) -> Fates:  # fmt: skip
    """The fates (k,) of starts that are followed until their time is up, or they have a label."""
    rule = LabelRule()
    periods = float(np.max(time_left, initial=0.0)) / math.tau
    cap = round(min(MOST, max(impacts_needed(known, rule.tolerance), 1.1 * periods)))
    fate = np.full(len(time_left), UNDECIDED, np.int8)
    open_ = np.arange(len(fate))
    chaotic = any(a.kind is AttractorKind.CHAOTIC for a in known.found)
    while len(open_) and cap <= MOST_FOLLOWED:
        n = len(open_)
        found = StartLabels(np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n))
        tau, w = (part[open_] for part in starts)
        label_followed(known, section, tau, w, rule._replace(cap=cap), found)
        late = found.time > time_left[open_]
        own = np.where(late, LOST, _fates_of(found.label, label))
        if chaotic and len(waiting := np.flatnonzero(own == UNDECIDED)):
            longer = rule._replace(cap=cap)
            labels = chaotic_labels(known, section, tau[waiting], w[waiting], longer)
            own[waiting] = _fates_of(labels, label)
        fate[open_] = own
        open_ = open_[own == UNDECIDED]
        cap *= 2
    return fate


def _fatal_both_ways(
    section: NextCollisionMap, known: Attractors, label: int, m: int, flights: Flights,
    rule: FatalRule,
) -> Array:  # fmt: skip
    """The edge of the first interval of fatal sizes (2, m) for each of m changes, upwards first."""
    given = section, known, label, m, flights, rule
    return np.array([_first_fatal(*given, sense) for sense in (1.0, -1.0)])


def _first_fatal(
    section: NextCollisionMap, known: Attractors, label: int, m: int, flights: Flights,
    rule: FatalRule, sense: float,
) -> Array:  # fmt: skip
    """The edge of the first interval of fatal sizes for each of m changes of one sense."""
    chaotic = known.found[label].kind is AttractorKind.CHAOTIC
    resolution = max(rule.resolution, CHAOTIC_RESOLUTION) if chaotic else rule.resolution

    def fate(which: NDArray[np.intp], size: Array) -> Fates:
        return fates(section, known, label, flights(which, sense * size), rule.periods)

    low, high, unknown = np.zeros(m), np.full(m, math.inf), np.zeros(m, bool)
    todo, first, last = np.arange(m), rule.smallest, rule.largest
    for _ in range(_LEVELS):
        low[todo], high[todo], unknown[todo] = _scan(fate, todo, first, last, resolution)
        todo = todo[high[todo] == first]  # the first size of all is fatal: look below it
        first, last = 1e-3 * first, first
    high[todo] = 0.0
    unknown[todo] |= fate(todo, np.zeros(len(todo))) != SURVIVED  # nor is the orbit itself in time
    fatal = np.flatnonzero(np.isfinite(high) & (high > 0.0))
    for _ in range(_HALVINGS_OF_CHAOS if chaotic else _HALVINGS):
        middle = 0.5 * (low[fatal] + high[fatal])
        now = fate(fatal, middle)
        fine = now == SURVIVED
        unknown[fatal] |= now == UNDECIDED
        low[fatal] = np.where(fine, middle, low[fatal])
        high[fatal] = np.where(fine, high[fatal], middle)
    return np.where(unknown, math.nan, np.where(np.isfinite(high), low, math.inf))


def _scan(
    fate: Callable[[NDArray[np.intp], Array], Fates],
    todo: NDArray[np.intp], first: float, last: float, resolution: float,
) -> tuple[Array, Array, NDArray[np.bool_]]:  # fmt: skip
    """Last size survived and first one not, for each of some changes; whether that is undecided.

    inf: all are survived.

    Sizes are in a geometric series in steps of half the resolution, in rising blocks: those that
    have met a fatal one are done.
    """
    steps = math.ceil(math.log(last / first) / math.log1p(0.5 * resolution)) + 1
    sizes = np.geomspace(first, last, steps)
    low, high = np.zeros(len(todo)), np.full(len(todo), math.inf)
    unknown = np.zeros(len(todo), bool)
    open_ = np.arange(len(todo))
    begin = 0
    while begin < steps and len(open_):
        length = max(1, min(_BLOCK // len(open_), max(64, steps // 8)))
        part = sizes[begin : begin + length]
        which = np.repeat(todo[open_], len(part))
        found = fate(which, np.tile(part, len(open_))).reshape(len(open_), len(part))
        fine = found == SURVIVED
        hit = ~fine.all(axis=1)
        place = np.argmin(fine, axis=1)
        high[open_[hit]] = part[place[hit]]
        unknown[open_[hit]] = found[hit, place[hit]] == UNDECIDED
        before = np.where(place > 0, part[np.maximum(place - 1, 0)], low[open_])
        low[open_] = np.where(hit, before, part[-1])
        open_ = open_[~hit]
        begin += length
    return low, high, unknown

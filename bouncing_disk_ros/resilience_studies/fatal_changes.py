"""How safe an attractor of the next-collision map is: its instants, fatal changes, all measures.

Units of the next-collision map: time is phase (rad), lengths are in πg/ω², velocities in πg/ω.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.impact_law import rebounded
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind, Attractors
from bouncing_disk_ros.maps.axial_flights import land_from_height
from bouncing_disk_ros.maps.basin_labels import (
    LONGER,
    MOST,
    UNRESOLVED,
    Basins,
    Labelled,
    LabelRule,
    chaotic_labels,
    impacts_needed,
    label_followed,
    label_starts,
)
from bouncing_disk_ros.maps.next_collision import NextCollisionMap

Array = NDArray[np.float64]

MOST_IMPACTS = 64
"""Flights of a chaotic attractor that instants are taken from."""
LIMITS = 16
"""Impacts whose two limits are looked at, the first ones of a repetition."""


class Instants(NamedTuple):
    """States of an orbit; arrays (m,)."""

    part: Array  # of the repetition that has passed, 0 to 1
    forcing_phase: Array  # rad, in [0, 2π)
    gap: Array  # ≥ 0; 0 at impacts and in contact
    speed: Array  # of the disk relative to the platform; in contact 0

    def joined(self, other: Instants) -> Instants:
        """These and others behind them."""
        return Instants(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


def instants_of(attractor: Attractor, section: NextCollisionMap, count: int) -> Instants:
    """Instants of an attractor, `count` of them, at the middles of equal parts of a repetition.

    A chaotic attractor has MOST_IMPACTS of its flights for a repetition, rest has one period of the
    platform. With contact, the repetition begins at separation, and the last impacts of a chatter,
    which the map does not resolve, count as contact.

    >>> section = NextCollisionMap(axial_forcing=0.45, restitution=0.5)
    >>> known = find_attractors(section, [(0.7, -1.3)])
    >>> instants_of(known.found[1], section, 32).gap
    """
    part = (np.arange(count) + 0.5) / count
    if attractor.kind is AttractorKind.REST:
        zero = np.zeros(count)
        return Instants(part, math.tau * part, zero, zero)
    begin, phase, speed, total = _segments(attractor, section)
    time = total * part
    own = np.searchsorted(begin, time, side="right") - 1
    since = time - begin[own]
    forcing, tau = section.axial_forcing, phase[own]
    height = forcing * (np.sin(tau) - np.sin(tau + since) + since * np.cos(tau))
    gap = height + speed[own] * since - since**2 / math.tau
    rate = speed[own] - since / math.pi - forcing * (np.cos(tau + since) - np.cos(tau))
    contact = np.isnan(speed[own])
    gap, rate = np.where(contact, 0.0, np.maximum(gap, 0.0)), np.where(contact, 0.0, rate)
    return Instants(part, (tau + since) % math.tau, gap, rate)


def impact_limits(attractor: Attractor, section: NextCollisionMap) -> Instants:
    """The states just before and just after each of the first LIMITS impacts of an attractor."""
    phase = attractor.forcing_phases[:LIMITS]
    w = attractor.velocities[:LIMITS]
    none = np.full(2 * len(phase), math.nan)
    speeds = np.concatenate((w, rebounded(w, section.restitution)))
    return Instants(none, np.tile(phase, 2), np.zeros(2 * len(phase)), speeds)


def _segments(attractor: Attractor, section: NextCollisionMap) -> tuple[Array, Array, Array, float]:
    """Begin, phase and relative speed of each flight (nan: contact), and the whole time."""
    phases = attractor.forcing_phases[:MOST_IMPACTS]
    speeds = rebounded(attractor.velocities[:MOST_IMPACTS], section.restitution)
    if attractor.kind is not AttractorKind.CHATTERING:
        delays = _delays(phases, speeds, section)
        begin = np.concatenate(([0.0], np.cumsum(delays)))
        return begin[:-1], phases, speeds, float(begin[-1])
    leave = math.asin(1.0 / (math.pi * section.axial_forcing))
    first = _delays(np.array([leave]), np.array([0.0]), section)
    delays = np.concatenate((first, _delays(phases[:-1], speeds[:-1], section)))
    begin = np.concatenate(([0.0], np.cumsum(delays)))
    # after the last impact that is resolved: the rest of the chatter and contact, to separation
    rest = (leave - float(phases[-1])) % math.tau
    launched = np.concatenate(([0.0], speeds[:-1], [math.nan]))
    starts = np.concatenate(([leave], phases))
    return begin, starts, launched, float(begin[-1]) + rest


def _delays(phases: Array, speeds: Array, section: NextCollisionMap) -> Array:
    """Times of the flights launched at these phases with these relative speeds."""
    flights = np.stack((phases, np.zeros(len(phases)), speeds), axis=1)
    out = np.empty((len(phases), 3))
    at_rest = speeds == 0.0
    if at_rest.any():  # from separation: the gap grows with the third power of time
        flights[at_rest, 0] += _AWAY
        flights[at_rest, 1], flights[at_rest, 2] = _after_separation(section, phases[at_rest])
    land_from_height(np.ascontiguousarray(flights), float(section.axial_forcing), out)
    return np.asarray(out[:, 2] + np.where(at_rest, _AWAY, 0.0))


_AWAY = 1e-3


def _after_separation(section: NextCollisionMap, phases: Array) -> tuple[Array, Array]:
    """Gap and relative speed _AWAY after separation."""
    forcing = section.axial_forcing
    gap = forcing * (np.sin(phases) + _AWAY * np.cos(phases) - np.sin(phases + _AWAY))
    speed = forcing * (np.cos(phases) - np.cos(phases + _AWAY)) - _AWAY / math.pi
    return gap - _AWAY**2 / math.tau, speed


# ------------------------------------------------------------------------------------------------
# The smallest impulse, and the smallest error in time, after which an orbit is not reached again.
#
# The starts that a change of growing size leads to are a line in the plane of starts. An orbit is
# reached again where its attractor is, within a number of periods (a chaotic one: unless another is
# reached). The sizes that are fatal are intervals: the line is looked at in steps of a part of the
# size, and the edge of the first interval found is halved to rounding (of a chaotic attractor to
# 1e-6 of it). Intervals narrower than a step may be missed.


Flights = Callable[[NDArray[np.intp], Array], Array]
"""Of indices (k,) and sizes (k,) of changes: the (phase, gap, relative speed) (k, 3) after them."""

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
    impacts after one of the sizes did not decide. Raises InputError for a rule out of range.

    >>> section = NextCollisionMap(axial_forcing=0.45, restitution=0.5)
    >>> known = find_attractors(section, [(0.7, -1.3)])
    >>> fatal_impulses(section, known, 1, instants_of(known.found[1], section, 8)).min(axis=1)
    """
    rule = (rule or FatalRule()).checked()
    found = []
    for sense in (1.0, -1.0):

        def flights(which: NDArray[np.intp], size: Array, sense: float = sense) -> Array:
            gap, speed = instants.gap[which], instants.speed[which] + sense * size
            return np.stack((instants.forcing_phase[which], gap, speed), axis=1)

        found.append(_first_fatal(section, known, label, len(instants.gap), flights, rule))
    return np.array(found)


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
    found = []
    for sense in (1.0, -1.0):

        def flights(which: NDArray[np.intp], size: Array, sense: float = sense) -> Array:
            phase = tau[which] + sense * size
            speed = w[which] + section.axial_forcing * (np.cos(tau[which]) - np.cos(phase))
            return np.stack((phase % math.tau, np.zeros(len(which)), speed), axis=1)

        found.append(_first_fatal(section, known, label, len(tau), flights, rule))
    return np.array(found)


def fates(
    section: NextCollisionMap, known: Attractors, label: int, flights: Array, periods: float
) -> Fates:
    """Whether disks at (phase, gap, relative speed) (k, 3) reach an attractor within periods.

    SURVIVED, LOST, or UNDECIDED where MOST_FOLLOWED impacts are not enough to say. A chaotic
    attractor is reached at no time that is known: it is lost where another one is reached.
    """
    states = np.empty((len(flights), 3))
    land_from_height(np.ascontiguousarray(flights), float(section.axial_forcing), states)
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
        found = Basins(np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n))
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


def _first_fatal(
    section: NextCollisionMap, known: Attractors, label: int, m: int, flights: Flights,
    rule: FatalRule,
) -> Array:  # fmt: skip
    """The edge of the first interval of fatal sizes for each of m changes."""
    chaotic = known.found[label].kind is AttractorKind.CHAOTIC
    resolution = max(rule.resolution, CHAOTIC_RESOLUTION) if chaotic else rule.resolution

    def fate(which: NDArray[np.intp], size: Array) -> Fates:
        return fates(section, known, label, flights(which, size), rule.periods)

    low, high, unknown = np.zeros(m), np.full(m, math.inf), np.zeros(m, bool)
    todo, first, last = np.arange(m), rule.smallest, rule.largest
    for _ in range(_LEVELS):
        low[todo], high[todo], unknown[todo] = _scan(fate, todo, first, last, resolution)
        todo = todo[high[todo] == first]  # the first size of all is fatal: look below it
        first, last = 1e-3 * first, first
    high[todo] = 0.0
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


# ------------------------------------------------------------------------------------------------
# How safe each attractor of the next-collision map is: all its measures at one Γ and ε.


class Resilience(NamedTuple):
    """Measures of one attractor."""

    share: float  # of the window
    share_error: float  # standard error
    share_without_contact: float  # of starts that reach it and do not come to contact before
    share_in_time: Array  # (k,) of starts that are on it after so many periods; nan: chaotic
    convergence_time: float  # time constant near it, periods; 0 with contact; nan: chaotic
    median_time: float  # of starts of its basin, until it is clear that they are on it, periods
    slow_time: float  # 95 % of them are faster
    impulses: Array  # (2, m) fatal impulse at each instant, upwards and downwards, m·πg/ω
    least_impulses: Array  # (2,) least over all instants and both limits at impacts
    timing_errors: Array  # (2,) least fatal timing error, late and early, rad


def measure(
    section: NextCollisionMap, window: Labelled, label: int, instants: int,
    after: Array, rule: FatalRule,
) -> Resilience:  # fmt: skip
    """All measures of one attractor; `after` (k,): numbers of periods of the shares in time."""
    known = window.known
    attractor = known.found[label]
    own = window.ends() == label
    n = own.size
    grid = own.reshape(window.side, window.side)
    cut = np.zeros(grid.shape, bool)
    cut[1:] = grid[1:] != grid[:-1]
    cut |= grid != np.roll(grid, 1, axis=1)
    time = window.labels.time / math.tau
    direct = window.labels.label == label
    mine = time[own & np.isfinite(time)]
    sizes = fatal_impulses(section, known, label, instants_of(attractor, section, instants), rule)
    least = sizes
    if len(attractor.forcing_phases):
        limits = impact_limits(attractor, section)
        least = np.concatenate((sizes, fatal_impulses(section, known, label, limits, rule)), axis=1)
        errors = fatal_timing_errors(section, known, label, rule).min(axis=1)
    else:
        errors = np.full(2, math.nan)
    return Resilience(
        float(own.mean()), 0.5 * math.sqrt(float(cut.sum())) / n, float(direct.mean()),
        _share_in_time(attractor, mine, after, n),
        convergence_time(attractor),
        float(np.median(mine)) if len(mine) else math.nan,
        float(np.quantile(mine, 0.95)) if len(mine) else math.nan,
        sizes, least.min(axis=1), errors,
    )  # fmt: skip


def _share_in_time(attractor: Attractor, times: Array, after: Array, starts: int) -> Array:
    """Share of so many starts whose time is up after so many periods (k,)."""
    if attractor.kind is AttractorKind.CHAOTIC:
        return np.full(len(after), math.nan)
    return np.array([np.count_nonzero(times <= limit) / starts for limit in after])


def convergence_time(attractor: Attractor) -> float:
    """Periods in which a small distance shrinks to 1/e; 0 with contact, nan of chaos."""
    if attractor.kind is AttractorKind.CHAOTIC:
        return math.nan
    if attractor.kind is not AttractorKind.PERIODIC or attractor.multiplier == 0.0:
        return 0.0
    return -attractor.cycles / math.log(attractor.multiplier)

"""How safe each attractor of the next-collision map is: all its measures at one Γ and ε."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.dynamics.attractor_search import (
    find_attractors,
    missed_attractors,
)
from bouncing_disk_ros.analysis.dynamics.attractors import Attractor, AttractorKind, Attractors
from bouncing_disk_ros.analysis.dynamics.basin_labels import UNRESOLVED, Basins, label_starts
from bouncing_disk_ros.analysis.dynamics.fatal_changes import (
    FatalRule,
    fatal_impulses,
    fatal_timing_errors,
)
from bouncing_disk_ros.analysis.dynamics.next_collision import NextCollisionMap
from bouncing_disk_ros.analysis.dynamics.orbit_instants import impact_limits, instants_of
from bouncing_disk_ros.collision_map.axial_map import ORBIT_DELAY, ORBIT_TAU, ORBIT_W, axial_orbit
from bouncing_disk_ros.collision_map.inverse_map import iterate_forwards

Array = NDArray[np.float64]

IN_CONTACT = -2
"""Label of a start that comes to contact, before it is said where contact leads."""
SEARCHED = 16
"""Attractors are looked for from SEARCHED × SEARCHED starts of the window."""


class WindowStarts(NamedTuple):
    """Starts at the centres of n × n pixels of τ ∈ [0, 2π), w_A ∈ (lowest, 0)."""

    tau: Array
    w: Array
    side: int


class Labelled(NamedTuple):
    """Where starts of a window go."""

    known: Attractors
    labels: Basins  # of each start; IN_CONTACT where it comes to contact
    side: int
    missed: int  # how many attractors the search missed, and open starts led to

    def ends(self) -> NDArray[np.int32]:
        """Label (n,) of the attractor that each start ends on."""
        label = self.labels.label
        return np.where(label == IN_CONTACT, np.int32(self.known.after_contact), label)


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


def window_starts(side: int, lowest: float) -> WindowStarts:
    """The centres of side × side pixels, rows of equal w_A."""
    centres = (np.arange(side) + 0.5) / side
    tau, w = np.meshgrid(math.tau * centres, lowest * (1.0 - centres))
    return WindowStarts(tau.ravel(), w.ravel(), side)


def label_window(section: NextCollisionMap, starts: WindowStarts, lowest: float) -> Labelled:
    """The attractors that a window leads to, and the label of each of its starts."""
    few = window_starts(SEARCHED, lowest)
    known = find_attractors(section, list(zip(few.tau.tolist(), few.w.tolist(), strict=True)))
    labels = _labels(known, section, starts.tau, starts.w)
    open_ = np.flatnonzero(labels.label == UNRESOLVED)
    missed: list[Attractor] = []
    if len(open_):
        left = np.stack((starts.tau[open_], starts.w[open_]), axis=1)
        missed = missed_attractors(section, known, left)
        if missed:
            known = known._replace(found=(*known.found, *missed))
            again = _labels(known, section, *left.T.copy())
            labels.label[open_], labels.impacts[open_], labels.time[open_] = again
    _go_on_after_contact(known, section, starts, labels)
    return Labelled(known, labels, starts.side, len(missed))


def _go_on_after_contact(
    known: Attractors, section: NextCollisionMap, starts: WindowStarts, labels: Basins
) -> None:
    """Where contact leads to a periodic attractor: the times up to there, in place."""
    after = known.after_contact
    held = np.flatnonzero(labels.label == IN_CONTACT)
    if not len(held) or after < 0 or known.found[after].kind is not AttractorKind.PERIODIC:
        return
    platform = float(section.axial_forcing), float(section.restitution)
    states = np.stack((starts.tau[held], starts.w[held]), axis=1)
    iterate_forwards(states, labels.impacts[held].astype(np.int64), *platform)
    next_one = np.empty((1, 4))
    for i, (tau, w) in zip(held, states, strict=True):
        axial_orbit(tau, w, *platform, 1, next_one)
        labels.time[i] += next_one[0, ORBIT_DELAY]
    tau, w = (next_one[:, column].copy() for column in (ORBIT_TAU, ORBIT_W))  # the same for all
    labels.time[held] += label_starts(known, section, tau, w).time[0]


def _labels(known: Attractors, section: NextCollisionMap, tau: Array, w: Array) -> Basins:
    """Labels with IN_CONTACT kept apart."""
    apart = known._replace(after_contact=IN_CONTACT)
    return label_starts(apart, section, np.ascontiguousarray(tau), np.ascontiguousarray(w))


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

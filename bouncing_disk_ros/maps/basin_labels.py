"""Basins of attraction of the axial next-collision map (paper, Fig. 4).

Starts are states (τ_imp, w_A) just before an impact, w_A in units of πg/ω. Labels are indices into
the attractors found beforehand, none of them given by the user; −1 is unresolved, never merged with
anything.
The kernel `maps.lanes.basin_kernel` decides contact and periodic ends; chaotic ones are told apart
here. Then: the attractors and labels of all starts of a window.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractor_search import missed_attractors, window_attractors
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind, Attractors, Cells
from bouncing_disk_ros.maps.axial_flights import iterate_forwards
from bouncing_disk_ros.maps.axial_map import ORBIT_DELAY, ORBIT_TAU, ORBIT_W, axial_orbit
from bouncing_disk_ros.maps.label_maps import LabelMap, row_blocks
from bouncing_disk_ros.maps.lanes.axial_lanes import iterate_axial
from bouncing_disk_ros.maps.lanes.basin_kernel import (
    UNDECIDED,
    LaneLabels,
    LaneRule,
    known_points,
    label_lanes,
)
from bouncing_disk_ros.maps.next_collision import NextCollisionMap

Floats = NDArray[np.float64]
Labels = NDArray[np.int32]
UNRESOLVED = UNDECIDED
TRANSIENT, MOST = 500, 100_000
REACHED = 8
"""A periodic attractor is reached at this impact in a row that is near it."""
LONGER = 20
"""Starts that are still open get so many times the impacts: chaos may be a long transient."""
WATCHED = 200
"""Impacts that must all lie on a chaotic attractor's cells for a start to belong to it."""
IN_CONTACT = -2
"""Label of a start that comes to contact, before it is said where contact leads."""
SEARCHED = 16
"""`label_window` first looks for attractors from SEARCHED × SEARCHED starts."""


class LabelRule(NamedTuple):
    """Rule that decides to which attractor a start belongs."""

    tolerance: float = 1e-4  # of τ (rad) and w_A (πg/ω) to a point of a periodic attractor
    repetitions: int = 4  # so often in a row it must go around, and at least REACHED impacts
    cap: int = (
        0  # impacts after which a start is unresolved; 0: `impacts_needed`, LONGER for the rest
    )


class Basins(NamedTuple):
    """The result of each start; arrays (n,) in the order given."""

    label: Labels  # index into the attractors, or UNRESOLVED
    impacts: NDArray[np.int32]  # until it was reached: a periodic one by the REACHED-th in a row
    time: Floats  # the same as a time, rad of the forcing phase; nan: unresolved, or chaotic


class Share(NamedTuple):
    """Part of the starts that a label has."""

    fraction: float
    uncertainty: float  # standard error


def label_starts(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule | None = None,
) -> Basins:  # fmt: skip
    """Labels of starts (τ in [0, 2π), w_A < 0) at Γ and ε of `section`: flat arrays (n,).

    1. A start that comes to contact belongs to the attractor of the orbit that leaves contact.
    2. A start whose impacts stay within `tolerance` of the points of a periodic attractor, in their
       order, for `repetitions` rounds, and at least REACHED impacts, belongs to it.
    3. After `cap` impacts it belongs to a chaotic attractor if its next WATCHED impacts all lie on
       cells that this attractor visits and no other one does; else it is unresolved.

    Each label depends on its own start alone, so the arrays may be cut anywhere.

    >>> section = NextCollisionMap(axial_forcing=0.45, restitution=0.5)
    >>> tau, w = np.linspace(0.0, 6.0, 50), np.full(50, -1.3)
    >>> label_starts(find_attractors(section, [(1.0, -1.3)]), section, tau, w).label
    """
    rule = rule or LabelRule()
    n = len(tau)
    found = Basins(np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n))
    if rule.cap:
        _label(attractors, section, tau, w, rule, found)
        return found
    first = rule._replace(cap=impacts_needed(attractors, rule.tolerance))
    _label(attractors, section, tau, w, first, found)
    late = np.flatnonzero(found.label == UNRESOLVED)
    if len(late):
        rest = Basins(found.label[late], found.impacts[late], found.time[late])
        longer = first._replace(cap=LONGER * first.cap)
        _label(attractors, section, tau[late], w[late], longer, rest)
        found.label[late], found.impacts[late], found.time[late] = rest
    return found


def _label(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule, found: Basins,
) -> None:  # fmt: skip
    """Label starts by the rule, its cap given, into `found`."""
    label_followed(attractors, section, tau, w, rule, found)
    open_ = np.flatnonzero(found.label == UNRESOLVED)
    if len(open_) and any(a.kind is AttractorKind.CHAOTIC for a in attractors.found):
        found.label[open_] = chaotic_labels(attractors, section, tau[open_], w[open_], rule)
    found.time[open_] = math.nan


def label_followed(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule, found: Basins,
) -> None:  # fmt: skip
    """Label starts that reach contact or a periodic attractor within the rule's cap, into `found`.

    The others are UNRESOLVED, with the time of `cap` impacts.
    """
    known = known_points(*_periodic_points(attractors), rule.repetitions)
    after_contact = attractors.after_contact
    lane_rule = LaneRule(rule.tolerance, float(REACHED), after_contact, after_contact, rule.cap)
    platform = (float(section.axial_forcing), float(section.restitution))
    label_lanes(tau, w, *platform, known, lane_rule, LaneLabels(*found))


def impacts_needed(attractors: Attractors, tolerance: float) -> int:
    """Limit of impacts that is enough to reach the slowest attractor, at most MOST.

    TRANSIENT impacts to come near, and three times those in which the distance to the slowest
    periodic attractor shrinks from 1 to the tolerance, by its multiplier in each round.
    """
    rounds = 0.0
    for attractor in attractors.found:
        if attractor.kind is AttractorKind.PERIODIC and 0.0 < attractor.multiplier < 1.0:
            each = len(attractor.forcing_phases) * math.log(tolerance)
            rounds = max(rounds, each / math.log(attractor.multiplier))
    return min(MOST, TRANSIENT + round(3.0 * rounds))


def _periodic_points(attractors: Attractors) -> tuple[Floats, NDArray[np.int32]]:
    """Points (m, 2) of the periodic attractors, and their labels (m,)."""
    points, of = [np.empty((0, 2))], [np.empty(0, np.int32)]
    for i, attractor in enumerate(attractors.found):
        if attractor.kind is AttractorKind.PERIODIC:
            points.append(np.stack((attractor.forcing_phases, attractor.velocities), axis=1))
            of.append(np.full(len(points[-1]), i, np.int32))
    return np.ascontiguousarray(np.concatenate(points)), np.concatenate(of)


def chaotic_labels(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule,
) -> Labels:  # fmt: skip
    """Labels of starts that the cap left open, by the cells of the chaotic attractors."""
    tau, w = tau.copy(), w.copy()
    forcings = np.full_like(tau, section.axial_forcing)
    restitutions = np.full_like(tau, section.restitution)
    counts = np.zeros((len(tau), 2), np.int64)
    iterate_axial(tau, w, forcings, restitutions, rule.cap, counts)
    chaotic = [i for i, a in enumerate(attractors.found) if a.kind is AttractorKind.CHAOTIC]
    cells = [Cells(attractors.found[i]) for i in chaotic]
    on = np.ones((len(chaotic), len(tau)), bool)
    for _ in range(WATCHED):
        iterate_axial(tau, w, forcings, restitutions, 1, counts)
        for row, visited in enumerate(cells):
            on[row] &= visited.hold(tau, w)
    sure = on.sum(axis=0) == 1
    return np.where(sure, np.array(chaotic, np.int32)[on.argmax(axis=0)], UNRESOLVED)


def shares(labels: LabelMap, count: int, *, periodic: bool = True) -> list[Share]:
    """Share of each of `count` labels in a map (rows, columns) of starts, with its standard error.

    A grid errs only where a pixel is cut by a boundary: each pixel with another label beside it is
    taken as a toss of a coin, of variance 1/4 pixel². `periodic`: the columns are a whole period.
    """
    rows, columns = labels.shape
    mine_of, cut_of = np.zeros(count), np.zeros(count)
    for k, part in enumerate(row_blocks(labels, 0, rows, before=1)):
        own = slice(1 if k else 0, None)  # without the row of the strip before
        for i in range(count):
            mine = part == i
            cut_of[i] += np.count_nonzero(_cut(mine, periodic=periodic)[own])
            mine_of[i] += np.count_nonzero(mine[own])
    pixels = rows * columns
    return [
        Share(float(mine) / pixels, 0.5 * math.sqrt(cut) / pixels)
        for mine, cut in zip(mine_of, cut_of, strict=True)
    ]


def unresolved_fraction(labels: LabelMap) -> float:
    """Share of the starts that have no label."""
    rows, columns = labels.shape
    parts = row_blocks(labels, 0, rows)
    return sum(np.count_nonzero(part == UNRESOLVED) for part in parts) / (rows * columns)


def _cut(mine: NDArray[np.bool_], *, periodic: bool) -> NDArray[np.bool_]:
    """Pixels unlike that before them, in their row or column."""
    edge = np.zeros(mine.shape, bool)
    np.not_equal(mine[1:], mine[:-1], out=edge[1:])
    edge[:, 1:] |= mine[:, 1:] != mine[:, :-1]
    if periodic:
        edge[:, 0] |= mine[:, 0] != mine[:, -1]
    return edge


def before_impact(velocity: Floats, restitution: float, *, after: bool) -> Floats:
    """w_A of starts given by the velocity before the impact, or (`after`) by −u, u = −ε w_A.

    Both are negative, so that both windows read alike. InputError: after an impact at ε = 0 the
    disk has no velocity.
    """
    if not after:
        return velocity
    if restitution == 0.0:
        raise InputError("velocity", "after", "before, at restitution 0", "Nothing bounces there.")
    return velocity / restitution


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


def _axes(side: int, lowest: float) -> tuple[Floats, Floats]:
    centres = (np.arange(side) + 0.5) / side
    return math.tau * centres, lowest * (1.0 - centres)


def window_starts(side: int, lowest: float) -> tuple[Floats, Floats]:
    """τ and w_A (n,) of side × side pixels' centres, τ ∈ [0, 2π), w_A ∈ (lowest, 0), row by row."""
    tau, w = np.meshgrid(*_axes(side, lowest))
    return tau.ravel(), w.ravel()


def label_window(section: NextCollisionMap, side: int, lowest: float) -> Labelled:
    """The attractors that the `window_starts` lead to, and the label of each of them."""
    known = window_attractors(section, *_axes(SEARCHED, lowest))
    tau, w = window_starts(side, lowest)
    labels = _labels(known, section, tau, w)
    open_ = np.flatnonzero(labels.label == UNRESOLVED)
    missed: list[Attractor] = []
    if len(open_):
        left = np.stack((tau[open_], w[open_]), axis=1)
        missed = missed_attractors(section, known, left)
        if missed:
            known = known._replace(found=(*known.found, *missed))
            again = _labels(known, section, *left.T.copy())
            labels.label[open_], labels.impacts[open_], labels.time[open_] = again
    _go_on_after_contact(known, section, tau, w, labels)
    return Labelled(known, labels, side, len(missed))


def _go_on_after_contact(
    known: Attractors, section: NextCollisionMap, tau: Floats, w: Floats, labels: Basins
) -> None:
    """Where contact leads to a periodic attractor: the times up to there, in place."""
    after = known.after_contact
    held = np.flatnonzero(labels.label == IN_CONTACT)
    if not len(held) or after < 0 or known.found[after].kind is not AttractorKind.PERIODIC:
        return
    platform = float(section.axial_forcing), float(section.restitution)
    states = np.stack((tau[held], w[held]), axis=1)
    iterate_forwards(states, labels.impacts[held].astype(np.int64), *platform)
    next_one = np.empty((1, 4))
    for i, state in zip(held, states, strict=True):
        axial_orbit(*state, *platform, 1, next_one)
        labels.time[i] += next_one[0, ORBIT_DELAY]
    tau, w = (next_one[:, column].copy() for column in (ORBIT_TAU, ORBIT_W))  # the same for all
    labels.time[held] += label_starts(known, section, tau, w).time[0]


def _labels(known: Attractors, section: NextCollisionMap, tau: Floats, w: Floats) -> Basins:
    """Labels with IN_CONTACT kept apart."""
    apart = known._replace(after_contact=IN_CONTACT)
    return label_starts(apart, section, np.ascontiguousarray(tau), np.ascontiguousarray(w))

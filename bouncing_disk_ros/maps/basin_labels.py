"""Labels of starts of the axial next-collision map: which attractor each goes to (paper, Fig. 4).

Starts are states (τ_imp, w_A) just before an impact, w_A in units of πg/ω. Labels are indices into
the attractors found beforehand, none of them given by the user; −1 is unresolved, never merged with
anything. `_decision` decides contact and periodic ends, many starts at once in lanes;
`chaotic_labels` tells chaotic ends apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import numbers
from bouncing_disk_ros.maps.attractors import AttractorKind, Attractors, Cells
from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, MAP_REST, next_impact
from bouncing_disk_ros.maps.basin_measures import UNRESOLVED
from bouncing_disk_ros.maps.lanes.axial_lanes import iterate_axial, iterated
from bouncing_disk_ros.maps.lanes.lane_basics import (
    DELAY,
    FIELDS,
    FORCING,
    IMPACTS_LEFT,
    LANDED,
    LANES,
    NEEDS_SCALAR,
    RESTITUTION,
    TAU,
    TRAJECTORY,
    W,
    assign_lane,
    chatter_outcome,
    chosen,
    in_widest_vectors,
    lane,
    lane_entry,
    scratch,
    set_impact,
)
from bouncing_disk_ros.maps.lanes.lane_flight import land_lanes, run_lanes
from bouncing_disk_ros.maps.next_collision import NextCollisionMap

if TYPE_CHECKING:
    from bouncing_disk_ros.maps.absorbing_region import AbsorbingRegion

Floats = NDArray[np.float64]
Labels = NDArray[np.int32]
TRANSIENT, MOST = 500, 100_000
REACHED = 8
"""A periodic attractor is reached at this impact in a row that is near it."""
LONGER = 20
"""Starts that are still open get so many times the impacts: chaos may be a long transient."""
WATCHED = 200
"""Impacts that must all lie on a chaotic attractor's cells for a start to belong to it."""
EARLY = 64, 256
"""Impacts after which starts are looked for in the regions about chaotic attractors."""


class LabelRule(NamedTuple):
    """Rule that decides to which attractor a start belongs."""

    tolerance: float = 1e-4  # of τ (rad) and w_A (πg/ω) to a point of a periodic attractor
    repetitions: int = 4  # so often in a row it must go around, and at least REACHED impacts
    cap: int = (
        0  # impacts after which a start is unresolved; 0: `impacts_needed`, LONGER for the rest
    )


def label_starts(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule | None = None, regions: Mapping[int, AbsorbingRegion] | None = None,
) -> StartLabels:  # fmt: skip
    """Labels of starts (τ in [0, 2π), w_A <= 0) at Γ and ε of `section`: flat arrays (n,).

    1. A start that comes to contact belongs to the attractor of the orbit that leaves contact.
    2. A start whose impacts stay within `tolerance` of the points of a periodic attractor, in their
       order, for `repetitions` rounds, and at least REACHED impacts, belongs to it.
    3. After `cap` impacts it belongs to a chaotic attractor if its next WATCHED impacts all lie on
       cells that this attractor visits and no other one does; else it is unresolved.

    Each label depends on its own start alone, so the arrays may be cut anywhere. `regions` about
    chaotic attractors, by their labels, give the same labels sooner: a start that is in a region
    after EARLY impacts is followed no further. Raises InputError for starts that are none.

    >>> section = NextCollisionMap(axial_forcing=0.45, restitution=0.5)
    >>> tau, w = np.linspace(0.0, 6.0, 50), np.full(50, -1.3)
    >>> label_starts(find_attractors(section, [(1.0, -1.3)]), section, tau, w).label
    """
    rule = rule or LabelRule()
    tau, w = _starts(tau, w)
    n = len(tau)
    found = StartLabels(np.full(n, UNRESOLVED, np.int32), np.zeros(n, np.int32), np.empty(n))
    if regions:
        _label_early(attractors, section, tau, w, rule, regions, found)
    cap = rule.cap or impacts_needed(attractors, rule.tolerance)
    for impacts in (cap,) if rule.cap else (cap, LONGER * cap):
        _label(attractors, section, tau, w, rule._replace(cap=impacts), found)
    return found


def _starts(tau: Floats, w: Floats) -> tuple[Floats, Floats]:
    """Starts as the kernels take them, or InputError."""
    tau, w = numbers("tau", tau), numbers("w", w)
    if tau.ndim != 1 or tau.shape != w.shape:
        given = f"shapes {tau.shape}, {w.shape}"
        raise InputError("tau, w", given, "two flat arrays of one length")
    wrong = ~(np.isfinite(tau) & np.isfinite(w) & (w <= 0.0))
    if wrong.any():
        at = int(np.flatnonzero(wrong)[0])
        allowed = "finite numbers, w < 0, or 0 for a disk on the platform"
        raise InputError("tau, w", f"{tau[at]:g}, {w[at]:g} at place {at + 1}", allowed)
    return tau, w


def _label(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule, found: StartLabels,
) -> None:  # fmt: skip
    """Label the starts that `found` leaves open, by the rule, its cap given."""
    is_open = found.label == UNRESOLVED
    if is_open.all():  # as at first: to copy those that are open would hold the GIL
        _label_all(attractors, section, tau, w, rule, found)
    elif is_open.any():
        left = np.flatnonzero(is_open)
        part = StartLabels(found.label[left], found.impacts[left], found.time[left])
        _label_all(attractors, section, tau[left], w[left], rule, part)
        found.label[left], found.impacts[left], found.time[left] = part


def _label_all(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule, found: StartLabels,
) -> None:  # fmt: skip
    """Label starts of which none has a label, by the rule, its cap given."""
    label_followed(attractors, section, tau, w, rule, found)
    open_ = np.flatnonzero(found.label == UNRESOLVED)
    if len(open_) and any(a.kind is AttractorKind.CHAOTIC for a in attractors.found):
        found.label[open_] = chaotic_labels(attractors, section, tau[open_], w[open_], rule)
    found.time[open_] = math.nan


def _label_early(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule, regions: Mapping[int, AbsorbingRegion], found: StartLabels,
) -> None:  # fmt: skip
    """Label the starts that EARLY impacts decide, with the regions.

    Each start is followed from its beginning: in pieces it would have other roundings, and where it
    comes near to contact it might end elsewhere.
    """
    # chaotic attractors are the last: without them all other labels are the same
    others = tuple(one for one in attractors.found if one.kind is not AttractorKind.CHAOTIC)
    quiet = attractors._replace(found=others)
    for impacts in EARLY:
        _label(quiet, section, tau, w, rule._replace(cap=impacts), found)
        left = np.flatnonzero(found.label == UNRESOLVED)
        after = iterated(tau[left], w[left], section.axial_parameters, impacts)
        for label, region in regions.items():
            found.label[left[region.hold(*after[:2])]] = label


def label_followed(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule, found: StartLabels,
) -> None:  # fmt: skip
    """Label starts that reach contact or a periodic attractor within the rule's cap, into `found`.

    The others are UNRESOLVED, with the time of `cap` impacts.
    """
    known = known_points(*_periodic_points(attractors), rule.repetitions)
    after_contact = attractors.after_contact
    lane_rule = LaneRule(rule.tolerance, float(REACHED), after_contact, after_contact, rule.cap)
    label_lanes(tau, w, *section.axial_parameters, known, lane_rule, found)


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
    forcings, restitutions = (np.full_like(tau, value) for value in section.axial_parameters)
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


# --- contact and periodic ends, many starts at once in lanes --------------------------------------
_OPEN = -(2**31)  # no label: the lane flies on

BASIN_TIME = (FIELDS + 0) * LANES  # since the start, rad
BASIN_POINT = (FIELDS + 1) * LANES  # index of the attractor's point the last impact was near, or −1
BASIN_RUN = (FIELDS + 2) * LANES  # impacts in a row near points in the right order
_FOLLOWS = (FIELDS + 3) * LANES  # 1: this impact is near the point that continues the run
_NEXT = (FIELDS + 4) * LANES  # the point it is near
_REACHED_TIME = (FIELDS + 5) * LANES  # time and impacts left when the run was `confirm` long
_REACHED_LEFT = (FIELDS + 6) * LANES
_FIELDS = FIELDS + 7

_FLOAT = types.float64
_FLOATS = types.float64[::1]
_INTS = types.int32[::1]


class StartLabels(NamedTuple):
    """The result of each start; arrays (n,) in the order given."""

    label: NDArray[np.int32]  # index into the attractors, or UNRESOLVED
    impacts: NDArray[np.int32]  # until it was reached: a periodic one by the `confirm`th in a row
    time: NDArray[np.float64]  # the same as a time, rad of the phase; nan: unresolved, or chaotic


class LaneRule(NamedTuple):
    """When a start has its label, and which: see `label_lanes`."""

    tolerance: float
    confirm: float
    contact_label: int
    rest_label: int
    cap: int


class KnownPoints(NamedTuple):
    """Points of the known periodic attractors, in their order.

    points (m, 2): τ and w; attractors (m,) int32: the label of each; before (m,): the index of the
    point before it on its attractor; needed (m,): impacts in a row that decide for its attractor,
    if they are more than `confirm`.
    """

    points: Any
    attractors: Any
    before: Any
    needed: Any


class _Starts(NamedTuple):
    tau: Any
    w: Any
    forcing: float
    restitution: float
    known: KnownPoints
    rule: LaneRule
    found: StartLabels


def known_points(
    points: NDArray[np.float64], attractors: NDArray[np.int32], repetitions: int = 1
) -> KnownPoints:
    """Points (m, 2) with the labels (m,) of their attractors; those of one are in their order.

    `repetitions`: so often in a row an orbit must go around.
    """
    before, needed = np.empty(len(attractors)), np.empty(len(attractors))
    for label in np.unique(attractors):
        mine = np.flatnonzero(attractors == label)
        before[mine] = np.roll(mine, 1)
        needed[mine] = repetitions * len(mine)
    return KnownPoints(points, attractors, before, needed)


@lane
def _near(tau: float, w: float, point_tau: float, point_w: float, tolerance: float) -> bool:
    apart = abs(tau - point_tau)
    return (min(apart, TWO_PI - apart) <= tolerance) & (abs(w - point_w) <= tolerance)


@lane
def _compare_one(
    z: Any, first: int, last: int, tau: float, w: float, tolerance: float, confirm: float
) -> None:
    """`_compare` where there is one point."""
    for i in range(first, last):
        landed = z[LANDED + i] > 0.0
        run, time, needs, d = z[BASIN_RUN + i], z[BASIN_TIME + i], z[NEEDS_SCALAR + i], z[DELAY + i]
        near = _near(z[TAU + i], z[W + i], tau, w, tolerance)
        run = chosen(landed, chosen(near, run + 1.0, 0.0), run)
        z[BASIN_RUN + i] = run
        z[BASIN_POINT + i] = 0.0
        z[BASIN_TIME + i] = chosen(landed, time + d, time)
        z[NEEDS_SCALAR + i] = chosen(run >= confirm, 1.0, needs)


@lane
def _compare(z: Any, first: int, last: int, known: Any, rule: Any) -> None:
    """Near which point each lane's last impact was; one that continues the run goes first."""
    points, before, tolerance, confirm = known.points, known.before, rule.tolerance, rule.confirm
    if len(points) == 1:
        _compare_one(z, first, last, points[0, 0], points[0, 1], tolerance, confirm)
        return
    for i in range(first, last):
        z[_NEXT + i] = -1.0
        z[_FOLLOWS + i] = 0.0
    for p in range(len(points)):
        tau, w, previous = points[p, 0], points[p, 1], before[p]
        for i in range(first, last):
            follows, following, point = z[_FOLLOWS + i], z[_NEXT + i], z[BASIN_POINT + i]
            near = _near(z[TAU + i], z[W + i], tau, w, tolerance)
            first_follows = near & (point == previous) & (follows == 0.0)
            z[_NEXT + i] = chosen(first_follows | (near & (following < 0.0)), p, following)
            z[_FOLLOWS + i] = chosen(first_follows, 1.0, follows)
    for i in range(first, last):
        landed = z[LANDED + i] > 0.0
        run, point, needs, following = (
            z[BASIN_RUN + i],
            z[BASIN_POINT + i],
            z[NEEDS_SCALAR + i],
            z[_NEXT + i],
        )
        time, d, follows = z[BASIN_TIME + i], z[DELAY + i], z[_FOLLOWS + i]
        longer = chosen(follows > 0.0, run + 1.0, chosen(following >= 0.0, 1.0, 0.0))
        run = chosen(landed, longer, run)
        z[BASIN_RUN + i] = run
        z[BASIN_POINT + i] = chosen(landed, following, point)
        z[BASIN_TIME + i] = chosen(landed, time + d, time)
        z[NEEDS_SCALAR + i] = chosen(run >= confirm, 1.0, needs)


@lane
def _confirmed(z: Any, i: int, known: Any, rule: Any) -> int:
    """Label of the attractor that the impacts have been near for long enough, or _OPEN."""
    run = z[BASIN_RUN + i]
    if run < rule.confirm:
        return _OPEN
    if run == rule.confirm:
        z[_REACHED_TIME + i], z[_REACHED_LEFT + i] = z[BASIN_TIME + i], z[IMPACTS_LEFT + i]
    point = int(z[BASIN_POINT + i])
    if run < known.needed[point]:
        return _OPEN
    z[BASIN_TIME + i], z[IMPACTS_LEFT + i] = z[_REACHED_TIME + i], z[_REACHED_LEFT + i]
    return int(known.attractors[point])


@lane
def _decision(z: Any, i: int, known: Any, rule: Any) -> int:
    """Label of the start in a lane that needs the scalar map; _OPEN: one impact by it was made."""
    label = _confirmed(z, i, known, rule)
    if label != _OPEN:
        return label
    if z[IMPACTS_LEFT + i] <= 0.0:
        return UNRESOLVED
    kind = chatter_outcome(z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i])
    if kind == MAP_CONTACT:
        return int(rule.contact_label)
    if kind == MAP_REST:
        return int(rule.rest_label)
    _, tau, w, delay = next_impact(z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i])
    set_impact(z, i, tau, w)
    z[IMPACTS_LEFT + i] -= 1.0
    z[DELAY + i], z[LANDED + i] = delay, 1.0
    _compare(z, i, i + 1, known, rule)
    z[DELAY + i], z[LANDED + i], z[NEEDS_SCALAR + i] = math.nan, 0.0, 0.0
    label = _confirmed(z, i, known, rule)
    if label != _OPEN:
        return label
    return UNRESOLVED if z[IMPACTS_LEFT + i] <= 0.0 else _OPEN


@lane
def _service(z: Any, i: int, data: Any) -> bool:
    """Decide, or go on; whether the start has its label."""
    label = _decision(z, i, data.known, data.rule)
    if label == _OPEN:
        return False
    job = int(z[TRAJECTORY + i])
    data.found.label[job] = label
    data.found.impacts[job] = data.rule.cap - int(z[IMPACTS_LEFT + i])
    data.found.time[job] = z[BASIN_TIME + i]
    z[BASIN_RUN + i] = 0.0  # a parked lane never needs the scalar map
    return True


@lane
def _assign(z: Any, i: int, job: int, data: Any) -> None:
    state = (data.tau[job], data.w[job], data.forcing, data.restitution)
    assign_lane(z, i, job, float(data.rule.cap), state)
    z[BASIN_TIME + i] = 0.0
    z[BASIN_POINT + i] = -1.0
    z[BASIN_RUN + i] = 0.0


@lane
def _on_landing(z: Any, data: Any) -> None:
    land_lanes(z)
    _compare(z, 0, LANES, data.known, data.rule)


_RULE = types.NamedTuple([_FLOAT, _FLOAT, *[types.int64] * 3], LaneRule)
_KNOWN = types.NamedTuple([types.float64[:, ::1], _INTS, _FLOATS, _FLOATS], KnownPoints)
_FOUND = types.NamedTuple([_INTS, _INTS, _FLOATS], StartLabels)


@lane_entry(types.void(*[_FLOATS] * 3, _FLOAT, _FLOAT, _KNOWN, _RULE, _FOUND))
def _label_lanes(
    z: Any, tau: Any, w: Any, forcing: float, restitution: float, known: Any, rule: Any, found: Any
) -> None:
    in_widest_vectors()
    data = _Starts(tau, w, forcing, restitution, known, rule, found)
    run_lanes(z, len(tau), _service, _assign, _on_landing, data)


def label_lanes(
    tau: NDArray[np.float64],
    w: NDArray[np.float64],
    forcing: float,
    restitution: float,
    known: KnownPoints,
    rule: LaneRule,
    found: StartLabels,
) -> None:
    """Label starts by the attractor that they go to.

    tau, w (n,): states at an impact. `known`: see `known_points`. The rule, impact after impact
    from the start:

    1. `contact_label` where the disk chatters to its end and is in contact: from there on every
       start is the same. `rest_label` where contact lasts for good.
    2. The label of an attractor whose points the impacts have been near, in their order, `confirm`
       times in a row, and as often as it needs; near: both |Δτ| (shortest angular distance) and
       |Δw| at most `tolerance`. Impacts and time are those of the `confirm`th.
    3. UNRESOLVED (−1) after `cap` impacts.

    The start itself is not compared. Where points are nearer to each other than the tolerance, the
    one that continues the run counts, else the first. found (n,) each, label and impacts int32:
    impacts after the start up to the decision, and their time; under rule 1 up to the last impact
    that was found by itself. A label depends on its own start alone, not on order or company. All
    arrays are C-contiguous; nothing is checked.
    """
    _label_lanes(scratch(_FIELDS), tau, w, forcing, restitution, known, rule, found)

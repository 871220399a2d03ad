"""Labels of starts that come to contact or to a periodic attractor, many starts at once in lanes.

`_decision` decides; `basin_labels.label_starts` says what the labels are.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, MAP_REST, next_impact
from bouncing_disk_ros.maps.label_maps import UNRESOLVED
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
    lane,
    lane_entry,
    scratch,
    set_impact,
)
from bouncing_disk_ros.maps.lanes.lane_flight import land_lanes, run_lanes

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

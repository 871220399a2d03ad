"""Which attractor each of many starts goes to: `label_lanes`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.collision_map.axial_map import MAP_CONTACT, MAP_REST, next_impact
from bouncing_disk_ros.collision_map.lanes.lane_arithmetic import chosen
from bouncing_disk_ros.collision_map.lanes.lane_flight import land_lanes
from bouncing_disk_ros.collision_map.lanes.lane_table import (
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
    in_slices,
    lane,
    lane_entry,
    scratch,
    set_impact,
)
from bouncing_disk_ros.collision_map.lanes.scheduler import run_lanes
from bouncing_disk_ros.core.arithmetic import TWO_PI

UNDECIDED = -1
"""Label of a start that has not been decided within the cap."""
_OPEN = -(2**31)  # no label: the lane flies on

BASIN_TIME = (FIELDS + 0) * LANES  # since the start, rad
BASIN_POINT = (FIELDS + 1) * LANES  # index of the attractor's point the last impact was near, or −1
BASIN_RUN = (FIELDS + 2) * LANES  # impacts in a row near points in the right order
_FOLLOWS = (FIELDS + 3) * LANES  # 1: this impact is near the point that continues the run
_NEXT = (FIELDS + 4) * LANES  # the point it is near
_FIELDS = FIELDS + 5

_FLOAT = types.float64
_FLOATS = types.float64[::1]
_INTS = types.int32[::1]


def _predecessors(of: NDArray[np.int32]) -> NDArray[np.float64]:
    """Index of the point before each one on its attractor."""
    before = np.empty(len(of))
    for name in np.unique(of):
        mine = np.flatnonzero(of == name)
        before[mine] = np.roll(mine, 1)
    return before


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
        run, time, ask, d = z[BASIN_RUN + i], z[BASIN_TIME + i], z[NEEDS_SCALAR + i], z[DELAY + i]
        near = _near(z[TAU + i], z[W + i], tau, w, tolerance)
        run = chosen(landed, chosen(near, run + 1.0, 0.0), run)
        z[BASIN_RUN + i] = run
        z[BASIN_POINT + i] = 0.0
        z[BASIN_TIME + i] = chosen(landed, time + d, time)
        z[NEEDS_SCALAR + i] = chosen(run >= confirm, 1.0, ask)


@lane
def _compare(z: Any, first: int, last: int, points: Any, before: Any, rule: Any) -> None:
    """Near which point each lane's last impact was; one that continues the run goes first."""
    tolerance, confirm = rule[0], rule[1]
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
        run, point, ask, following = (
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
        z[NEEDS_SCALAR + i] = chosen(run >= confirm, 1.0, ask)


@lane
def _decision(z: Any, i: int, points: Any, of: Any, before: Any, rule: Any, ends: Any) -> int:
    """Label of the start in a lane that asks; _OPEN: it has been carried on by the scalar map."""
    if z[BASIN_RUN + i] >= rule[1]:
        return int(of[int(z[BASIN_POINT + i])])
    if z[IMPACTS_LEFT + i] <= 0.0:
        return UNDECIDED
    kind = chatter_outcome(z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i])
    if kind == MAP_CONTACT:
        return int(ends[0])
    if kind == MAP_REST:
        return int(ends[1])
    _, tau, w, delay = next_impact(z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i])
    set_impact(z, i, tau, w)
    z[IMPACTS_LEFT + i] -= 1.0
    z[DELAY + i], z[LANDED + i] = delay, 1.0
    _compare(z, i, i + 1, points, before, rule)
    z[DELAY + i], z[LANDED + i] = math.nan, 0.0
    if z[BASIN_RUN + i] >= rule[1]:
        return int(of[int(z[BASIN_POINT + i])])
    return UNDECIDED if z[IMPACTS_LEFT + i] <= 0.0 else _OPEN


@lane
def _service(z: Any, i: int, data: Any) -> bool:
    """Decide, or go on; whether the start has its label."""
    (points, of, before), rule, ends, (labels, impacts, times), _ = data
    found = _decision(z, i, points, of, before, rule, ends)
    if found == _OPEN:
        return False
    job = int(z[TRAJECTORY + i])
    labels[job] = found
    impacts[job] = ends[2] - int(z[IMPACTS_LEFT + i])
    times[job] = z[BASIN_TIME + i]
    z[BASIN_RUN + i] = 0.0  # an idle lane has nothing to ask
    return True


@lane
def _assign(z: Any, i: int, job: int, data: Any) -> None:
    _, _, ends, _, (tau, w, forcing, restitution) = data
    assign_lane(z, i, job, float(ends[2]), (tau[job], w[job], forcing, restitution))
    z[BASIN_TIME + i] = 0.0
    z[BASIN_POINT + i] = -1.0
    z[BASIN_RUN + i] = 0.0


@lane
def _on_landing(z: Any, data: Any) -> None:
    (points, _, before), rule, _, _, _ = data
    land_lanes(z)
    _compare(z, 0, LANES, points, before, rule)


@lane_entry(
    types.void(
        *[_FLOATS] * 3, _FLOAT, _FLOAT, types.float64[:, ::1], _INTS, _FLOATS,
        types.UniTuple(_FLOAT, 2), types.UniTuple(types.int64, 3), _INTS, _INTS, _FLOATS,
    )
)  # fmt: skip
def _label_lanes(
    z: Any,
    tau: Any,
    w: Any,
    forcing: float,
    restitution: float,
    points: Any,
    of: Any,
    before: Any,
    rule: tuple[float, float],
    ends: tuple[int, int, int],
    out_label: Any,
    out_impacts: Any,
    out_time: Any,
) -> None:
    """`label_lanes`; rule = (tolerance, confirm), ends = (label of contact, label of rest, cap)."""
    known, outs = (points, of, before), (out_label, out_impacts, out_time)
    starts = (tau, w, forcing, restitution)
    run_lanes(z, len(tau), _service, _assign, _on_landing, (known, rule, ends, outs, starts))


def label_lanes(
    tau: NDArray[np.float64],
    w: NDArray[np.float64],
    forcing: float,
    restitution: float,
    points: NDArray[np.float64],
    of: NDArray[np.int32],
    tolerance: float,
    confirm: int,
    cap: int,
    contact_label: int,
    rest_label: int,
    out_label: NDArray[np.int32],
    out_impacts: NDArray[np.int32],
    out_time: NDArray[np.float64],
    *,
    workers: int = 1,
) -> None:
    """Label starts by the attractor that they go to.

    tau, w (n,): states at an impact. points (m, 2), of (m,): the points (τ, w) of the known
    periodic attractors in their order, and the label of each. The rule, impact after impact from
    the start:

    1. `contact_label` where the disk chatters to its end and is in contact: from there on every
       start is the same. `rest_label` where contact lasts for good.
    2. The label of an attractor whose points the impacts have been near, in their order, `confirm`
       times in a row; near: both |Δτ| (the short way round) and |Δw| at most `tolerance`.
    3. UNDECIDED (−1) after `cap` impacts.

    The start itself is not compared. Where points are nearer to each other than the tolerance, the
    one that continues the run counts, else the first. out_impacts: impacts after the start up to
    the decision, and out_time their time in rad; under rule 1 up to the last impact that was found
    by itself. A label depends on its own start alone, not on order, company or the number of
    threads (`workers`). All arrays are C-contiguous; nothing is checked.
    """
    before = _predecessors(of)
    rule, ends = (float(tolerance), float(confirm)), (contact_label, rest_label, cap)

    def work(part: slice) -> None:
        outs = (out_label[part], out_impacts[part], out_time[part])
        z = scratch(_FIELDS)
        _label_lanes(
            z, tau[part], w[part], forcing, restitution, points, of, before, rule, ends, *outs
        )

    in_slices(work, len(tau), workers)

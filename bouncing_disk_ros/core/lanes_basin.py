"""Which attractor each of many starts goes to: `label`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, entry, kernel
from bouncing_disk_ros.core.axial_map import MAP_CONTACT, MAP_REST, next_impact
from bouncing_disk_ros.core.lanes import (
    ASK,
    DELAY,
    DONE,
    FIELDS,
    FORCING,
    JOB,
    LANDED,
    LANES,
    LEFT,
    RESTITUTION,
    TAU,
    TODO,
    W,
    enter,
    fate,
    idle,
    lane,
    place,
    scratch,
)
from bouncing_disk_ros.core.lanes_flight import land, launch, look

UNDECIDED = -1
"""Label of a start that has not been decided within the cap."""
_OPEN = -(2**31)  # no label: the lane flies on

TIME = (FIELDS + 0) * LANES  # since the start, rad
POINT = (FIELDS + 1) * LANES  # index of the attractor's point the last impact was near, or −1
RUN = (FIELDS + 2) * LANES  # impacts in a row near points in the right order
_NEAR = (FIELDS + 3) * LANES  # the same for this impact
_NEXT = (FIELDS + 4) * LANES
_FIELDS = FIELDS + 5

_FLOATS = types.float64[::1]
_INTS = types.int32[::1]


@kernel
def _predecessors(of: Any) -> Any:
    """Index of the point before each one on its attractor, as float64."""
    m = len(of)
    before = np.empty(m)
    for p in range(m):
        before[p] = p
        for step in range(1, m):
            q = (p - step) % m
            if of[q] == of[p]:
                before[p] = q
                break
    return before


@lane
def _compare_one(
    z: Any, first: int, last: int, tau: float, w: float, tolerance: float, confirm: float
) -> None:
    """`_compare` where there is one point."""
    for i in range(first, last):
        landed = z[LANDED + i] > 0.0
        run, time, ask = z[RUN + i], z[TIME + i], z[ASK + i]
        apart = abs(z[TAU + i] - tau)
        near = min(apart, TWO_PI - apart) <= tolerance and abs(z[W + i] - w) <= tolerance
        longer = run + 1.0 if near else 0.0
        run = longer if landed else run
        z[RUN + i] = run
        z[POINT + i] = 0.0
        z[TIME + i] = time + z[DELAY + i] if landed else time
        z[ASK + i] = 1.0 if run >= confirm else ask


@lane
def _compare(z: Any, first: int, last: int, points: Any, rule: Any) -> None:
    """Near which point each lane's last impact was; one that continues the run goes first."""
    tolerance, confirm, before = rule[0], rule[1], rule[4]
    if len(points) == 1:
        _compare_one(z, first, last, points[0, 0], points[0, 1], tolerance, confirm)
        return
    for i in range(first, last):
        z[_NEXT + i] = -1.0
        z[_NEAR + i] = 0.0
    for p in range(len(points)):
        tau, w, previous = points[p, 0], points[p, 1], before[p]
        for i in range(first, last):
            apart = abs(z[TAU + i] - tau)
            near = min(apart, TWO_PI - apart) <= tolerance and abs(z[W + i] - w) <= tolerance
            follows = near and z[POINT + i] == previous and z[_NEAR + i] == 0.0
            z[_NEXT + i] = p if follows or (near and z[_NEXT + i] < 0.0) else z[_NEXT + i]
            z[_NEAR + i] = 1.0 if follows else z[_NEAR + i]
    for i in range(first, last):
        landed = z[LANDED + i] > 0.0
        run, point, ask, following = z[RUN + i], z[POINT + i], z[ASK + i], z[_NEXT + i]
        time = z[TIME + i]
        again = 1.0 if following >= 0.0 else 0.0
        longer = run + 1.0 if z[_NEAR + i] > 0.0 else again
        run = longer if landed else run
        z[RUN + i] = run
        z[POINT + i] = following if landed else point
        z[TIME + i] = time + z[DELAY + i] if landed else time
        z[ASK + i] = 1.0 if run >= confirm else ask


@kernel
def _decision(z: Any, i: int, points: Any, of: Any, rule: Any) -> int:
    """Label of the start in a lane that asks; _OPEN: it has been carried on by the scalar map."""
    if z[RUN + i] >= rule[1]:
        return int(of[int(z[POINT + i])])
    if z[LEFT + i] <= 0.0:
        return UNDECIDED
    kind = fate(z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i])
    if kind == MAP_CONTACT:
        return int(rule[2])
    if kind == MAP_REST:
        return int(rule[3])
    _, tau, w, delay = next_impact(z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i])
    place(z, i, tau, w)
    z[LEFT + i] -= 1.0
    z[DELAY + i], z[LANDED + i] = delay, 1.0
    _compare(z, i, i + 1, points, rule)
    z[DELAY + i], z[LANDED + i] = math.nan, 0.0
    if z[RUN + i] >= rule[1]:
        return int(of[int(z[POINT + i])])
    return UNDECIDED if z[LEFT + i] <= 0.0 else _OPEN


@kernel
def _enter(z: Any, i: int, job: int, cap: int, state: Any) -> None:
    tau, w, forcing, restitution = state
    enter(z, i, job, float(cap), (tau[job], w[job], forcing, restitution))
    z[TIME + i] = 0.0
    z[POINT + i] = -1.0


@kernel
def _attend(
    z: Any, i: int, cap: int, state: Any, points: Any, of: Any, rule: Any, out: Any, tally: Any
) -> None:
    """Carry a lane on, or give it the next start."""
    job = int(z[JOB + i])
    if job >= 0:
        found = _decision(z, i, points, of, rule)
        if found == _OPEN:
            return
        out[0][job] = found
        out[1][job] = cap - int(z[LEFT + i])
        out[2][job] = z[TIME + i]
        tally[DONE] += 1
    z[RUN + i] = 0.0
    if tally[TODO] == len(state[0]):
        idle(z, i)
        return
    _enter(z, i, tally[TODO], cap, state)
    tally[TODO] += 1


@entry(
    types.void(
        _FLOATS,
        _FLOATS,
        types.float64,
        types.float64,
        types.float64[:, ::1],
        _INTS,
        types.float64,
        types.int64,
        types.int64,
        types.int64,
        types.int64,
        _INTS,
        _INTS,
        _FLOATS,
    )
)
def label(
    tau: Any,
    w: Any,
    forcing: float,
    restitution: float,
    points: Any,
    of: Any,
    tolerance: float,
    confirm: int,
    cap: int,
    contact_label: int,
    rest_label: int,
    out_label: Any,
    out_impacts: Any,
    out_time: Any,
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
    by itself. A label depends on its own start alone. Nothing is checked.
    """
    state = (tau, w, forcing, restitution)
    rule = (tolerance, float(confirm), contact_label, rest_label, _predecessors(of))
    out = (out_label, out_impacts, out_time)
    z = scratch(_FIELDS)
    tally = np.zeros(2, np.int64)
    for i in range(LANES):
        idle(z, i)
        _attend(z, i, cap, state, points, of, rule, out, tally)
    while tally[DONE] < len(tau):
        if launch(z) > 0:
            for i in range(LANES):
                if z[ASK + i] > 0.0:
                    _attend(z, i, cap, state, points, of, rule, out, tally)
        look(z, False)
        look(z, True)
        land(z)
        _compare(z, 0, LANES, points, rule)

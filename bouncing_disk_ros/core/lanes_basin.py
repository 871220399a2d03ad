"""Which attractor each of many starts goes to: `label`."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, entry, kernel
from bouncing_disk_ros.core.axial_map import MAP_CONTACT, MAP_REST, next_impact
from bouncing_disk_ros.core.lanes import (
    CALM,
    FIELDS,
    FLIGHT,
    FORCING,
    JOB,
    LANDED,
    LANES,
    LEFT,
    RESTITUTION,
    SPEED,
    TAU,
    W,
    busy,
    enter,
    idle,
    land,
    launch,
    look,
    place,
    wants_attention,
)

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


@kernel
def _compare(z: Any, first: int, last: int, points: Any, before: Any, tolerance: float) -> None:
    """Near which point each lane's last impact was; one that continues the run goes first."""
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
        again = 1.0 if z[_NEXT + i] >= 0.0 else 0.0
        run = z[RUN + i] + 1.0 if z[_NEAR + i] > 0.0 else again
        z[RUN + i] = run if landed else z[RUN + i]
        z[POINT + i] = z[_NEXT + i] if landed else z[POINT + i]
        z[TIME + i] += z[FLIGHT + i] if landed else 0.0


@kernel
def _confirmed(z: Any, confirm: float) -> int:
    """How many lanes have stayed near an attractor for long enough."""
    wanted = 0
    for i in range(LANES):
        wanted += 1 if z[RUN + i] >= confirm else 0
    return wanted


@kernel
def _decision(z: Any, i: int, rule: Any, of: Any) -> int:
    """Label of a lane whose start is decided as far as its impacts go; _OPEN if it is not."""
    if z[RUN + i] >= rule[1]:
        return int(of[int(z[POINT + i])])
    return UNDECIDED if z[LEFT + i] <= 0.0 else _OPEN


@kernel
def _one_by_one(z: Any, i: int, points: Any, of: Any, before: Any, rule: Any) -> int:
    """Go on by the scalar map while the lane is calm or slow to land; label, or _OPEN to fly on."""
    while True:
        found = _decision(z, i, rule, of)
        if found != _OPEN or (z[SPEED + i] > z[CALM + i] and z[LANDED + i] > 0.0):
            return found
        kind, tau, w, delay = next_impact(z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i])
        if kind == MAP_CONTACT:
            return int(rule[2])
        if kind == MAP_REST:
            return int(rule[3])
        place(z, i, tau, w)
        z[LEFT + i] -= 1.0
        z[FLIGHT + i] = delay
        _compare(z, i, i + 1, points, before, rule[0])


@kernel
def _enter(z: Any, i: int, job: int, cap: int, state: Any) -> None:
    tau, w, forcing, restitution = state
    enter(z, i, job, float(cap), (tau[job], w[job], forcing, restitution))
    z[TIME + i] = 0.0
    z[POINT + i] = -1.0
    z[RUN + i] = 0.0


@kernel
def _attend(
    z: Any, i: int, todo: int, cap: int, state: Any, points: Any, of: Any, rule: Any, out: Any
) -> int:
    """Give a lane starts until one flies or none is left; the index of the next start."""
    before = rule[4]
    while True:
        job = int(z[JOB + i])
        if job >= 0:
            found = _one_by_one(z, i, points, of, before, rule)
            if found == _OPEN:
                return todo
            out[0][job] = found
            out[1][job] = cap - int(z[LEFT + i])
            out[2][job] = z[TIME + i]
        if todo == len(state[0]):
            idle(z, i)
            z[RUN + i] = 0.0
            return todo
        _enter(z, i, todo, cap, state)
        todo += 1


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
    z = np.zeros(_FIELDS * LANES)
    todo = 0
    for i in range(LANES):
        idle(z, i)
        todo = _attend(z, i, todo, cap, state, points, of, rule, out)
    while busy(z):
        wanted = 0
        while wanted == 0:
            launch(z)
            look(z)
            look(z)
            wanted = land(z)
            _compare(z, 0, LANES, points, rule[4], tolerance)
            wanted += _confirmed(z, float(confirm))
        for i in range(LANES):
            if wants_attention(z, i) or z[RUN + i] >= confirm:
                todo = _attend(z, i, todo, cap, state, points, of, rule, out)

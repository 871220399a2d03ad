"""Iterate the next-collision map for many trajectories at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from bouncing_disk_ros.core.arithmetic import entry, kernel
from bouncing_disk_ros.core.axial_map import MAP_CONTACT, MAP_REST, next_impact
from bouncing_disk_ros.core.lanes import (
    CALM,
    FIELDS,
    FORCING,
    JOB,
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

CONTACTS, RESTS = 0, 1
"""Columns of the counts of events."""

_FLOATS = types.float64[::1]


@kernel
def _one_by_one(z: Any, i: int, counts: Any) -> None:
    """Go on by the scalar map while the lane is calm, slow to land, or until it is done."""
    job = int(z[JOB + i])
    while z[LEFT + i] > 0.0:
        kind, tau, w, _ = next_impact(z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i])
        place(z, i, tau, w)
        z[LEFT + i] -= 1.0
        if kind == MAP_CONTACT:
            counts[job, CONTACTS] += 1
        elif kind == MAP_REST:
            counts[job, RESTS] += 1
            z[LEFT + i] = 0.0
        if z[SPEED + i] > z[CALM + i]:
            return


@kernel
def _refill(z: Any, i: int, todo: int, impacts: int, state: Any, counts: Any) -> int:
    """Give a lane the next trajectory, or none; the index of the one after it."""
    tau, w, forcing, restitution = state
    while todo < len(tau):
        enter(z, i, todo, float(impacts), (tau[todo], w[todo], forcing[todo], restitution[todo]))
        todo += 1
        if z[SPEED + i] <= z[CALM + i]:
            _one_by_one(z, i, counts)
        if z[LEFT + i] > 0.0:
            return todo
        _keep(z, i, state)
    idle(z, i)
    return todo


@kernel
def _keep(z: Any, i: int, state: Any) -> None:
    job = int(z[JOB + i])
    state[0][job], state[1][job] = z[TAU + i], z[W + i]


@entry(types.void(_FLOATS, _FLOATS, _FLOATS, _FLOATS, types.int64, types.int64[:, ::1]))
def iterate(tau: Any, w: Any, forcing: Any, restitution: Any, impacts: int, counts: Any) -> None:
    """Carry trajectories `impacts` impacts on.

    tau, w (n,): states at an impact, replaced by the final ones; nan where contact lasts for good.
    forcing, restitution (n,): Γ ≥ 0 and ε in [0, 1]. counts (n, 2) int64: the numbers of completed
    chatters with contact (CONTACTS) and of rests (RESTS) are added to it. Nothing is checked.
    """
    if impacts <= 0:
        return
    state = (tau, w, forcing, restitution)
    z = np.zeros(FIELDS * LANES)
    todo = 0
    for i in range(LANES):
        todo = _refill(z, i, todo, impacts, state, counts)
    while busy(z):
        wanted = 0
        while wanted == 0:
            launch(z)
            look(z)
            look(z)
            wanted = land(z)
        for i in range(LANES):
            if wants_attention(z, i):
                if z[LEFT + i] > 0.0:
                    _one_by_one(z, i, counts)
                if z[LEFT + i] <= 0.0:
                    _keep(z, i, state)
                    todo = _refill(z, i, todo, impacts, state, counts)

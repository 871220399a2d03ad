"""Iterate the next-collision map for many trajectories at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types

from bouncing_disk_ros.core.arithmetic import entry, kernel
from bouncing_disk_ros.core.axial_map import MAP_CONTACT, MAP_REST, next_impact
from bouncing_disk_ros.core.lanes import (
    ASK,
    DONE,
    FIELDS,
    FORCING,
    JOB,
    LANES,
    LEFT,
    RESTITUTION,
    TAU,
    TODO,
    W,
    enter,
    idle,
    place,
    scratch,
)
from bouncing_disk_ros.core.lanes_flight import land, launch, look

CONTACTS, RESTS = 0, 1
"""Columns of the counts of events."""

_FLOATS = types.float64[::1]


@kernel
def _step(z: Any, i: int, counts: Any) -> None:
    """One impact by the scalar map."""
    job = int(z[JOB + i])
    kind, tau, w, _ = next_impact(z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i])
    place(z, i, tau, w)
    z[LEFT + i] -= 1.0
    if kind == MAP_CONTACT:
        counts[job, CONTACTS] += 1
    elif kind == MAP_REST:
        counts[job, RESTS] += 1
        z[LEFT + i] = 0.0


@kernel
def _attend(z: Any, i: int, impacts: int, state: Any, counts: Any, tally: Any) -> None:
    """Carry a lane on, or give it the next trajectory."""
    tau, w, forcing, restitution = state
    job = int(z[JOB + i])
    if job >= 0 and z[LEFT + i] > 0.0:
        _step(z, i, counts)
        if z[LEFT + i] > 0.0:
            return
    if job >= 0:
        tau[job], w[job] = z[TAU + i], z[W + i]
        tally[DONE] += 1
    job = tally[TODO]
    if job == len(tau):
        idle(z, i)
        return
    enter(z, i, job, float(impacts), (tau[job], w[job], forcing[job], restitution[job]))
    tally[TODO] += 1


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
    z = scratch(FIELDS)
    tally = np.zeros(2, np.int64)
    for i in range(LANES):
        idle(z, i)
        _attend(z, i, impacts, state, counts, tally)
    while tally[DONE] < len(tau):
        if launch(z) > 0:
            for i in range(LANES):
                if z[ASK + i] > 0.0:
                    _attend(z, i, impacts, state, counts, tally)
        look(z, False)
        look(z, True)
        land(z)

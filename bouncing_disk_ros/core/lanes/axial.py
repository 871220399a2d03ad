"""Iterate the next-collision map for many trajectories at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core.axial_map import MAP_CONTACT, MAP_REST, next_impact
from bouncing_disk_ros.core.lanes.flight import land
from bouncing_disk_ros.core.lanes.lane import (
    FIELDS,
    FORCING,
    JOB,
    LEFT,
    RESTITUTION,
    TAU,
    W,
    enter,
    in_slices,
    lane,
    lane_entry,
    place,
    scratch,
)
from bouncing_disk_ros.core.lanes.rounds import rounds

CONTACTS, RESTS = 0, 1
"""Columns of the counts of events."""

_FLOATS = types.float64[::1]


@lane
def _attend(z: Any, i: int, data: Any) -> bool:
    """One impact by the scalar map, if any are left; whether the trajectory is done."""
    tau, w, _, _, _, counts = data
    job = int(z[JOB + i])
    if z[LEFT + i] > 0.0:
        kind, after, speed, _ = next_impact(
            z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i]
        )
        place(z, i, after, speed)
        z[LEFT + i] -= 1.0
        if kind == MAP_CONTACT:
            counts[job, CONTACTS] += 1
        elif kind == MAP_REST:
            counts[job, RESTS] += 1
            z[LEFT + i] = 0.0
    if z[LEFT + i] > 0.0:
        return False
    tau[job], w[job] = z[TAU + i], z[W + i]
    return True


@lane
def _begin(z: Any, i: int, job: int, data: Any) -> None:
    tau, w, forcing, restitution, impacts, _ = data
    enter(z, i, job, float(impacts), (tau[job], w[job], forcing[job], restitution[job]))


@lane
def _land(z: Any, _: Any) -> None:
    land(z)


@lane_entry(types.void(*[_FLOATS] * 5, types.int64, types.int64[:, ::1]))
def _iterate(
    z: Any, tau: Any, w: Any, forcing: Any, restitution: Any, impacts: int, counts: Any
) -> None:
    rounds(z, len(tau), _attend, _begin, _land, (tau, w, forcing, restitution, impacts, counts))


def iterate(
    tau: NDArray[np.float64],
    w: NDArray[np.float64],
    forcing: NDArray[np.float64],
    restitution: NDArray[np.float64],
    impacts: int,
    counts: NDArray[np.int64],
    *,
    workers: int = 1,
) -> None:
    """Carry trajectories `impacts` impacts on, on so many threads; the same for any number of them.

    tau, w (n,): states at an impact, replaced by the final ones; nan where contact lasts for good.
    forcing, restitution (n,): Γ ≥ 0 and ε in [0, 1]. counts (n, 2) int64: the numbers of completed
    chatters with contact (CONTACTS) and of rests (RESTS) are added to it. All arrays are
    C-contiguous; nothing is checked.
    """

    def work(part: slice) -> None:
        states = (tau[part], w[part], forcing[part], restitution[part])
        _iterate(scratch(FIELDS), *states, impacts, counts[part])

    if impacts > 0:
        in_slices(work, len(tau), workers)

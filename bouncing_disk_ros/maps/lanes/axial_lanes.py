"""Iterate the next-collision map for many trajectories at once."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, MAP_REST, next_impact
from bouncing_disk_ros.maps.lanes.lane_basics import (
    FIELDS,
    FORCING,
    IMPACTS_LEFT,
    RESTITUTION,
    TAU,
    TRAJECTORY,
    W,
    assign_lane,
    in_widest_vectors,
    lane,
    lane_entry,
    scratch,
    set_impact,
)
from bouncing_disk_ros.maps.lanes.lane_flight import land_lanes, run_lanes

COUNT_CONTACTS, COUNT_RESTS = 0, 1
"""Columns of the counts of events."""

_FLOATS = types.float64[::1]


class _Trajectories(NamedTuple):
    """What the lanes take their trajectories from, and write their ends to."""

    tau: Any
    w: Any
    forcing: Any
    restitution: Any
    impacts: int
    counts: Any


@lane
def _service(z: Any, i: int, data: Any) -> bool:
    """One impact by the scalar map, if any are left; whether the trajectory is done."""
    job = int(z[TRAJECTORY + i])
    if z[IMPACTS_LEFT + i] > 0.0:
        kind, after, speed, _ = next_impact(
            z[TAU + i], z[W + i], z[FORCING + i], z[RESTITUTION + i]
        )
        set_impact(z, i, after, speed)
        z[IMPACTS_LEFT + i] -= 1.0
        if kind == MAP_CONTACT:
            data.counts[job, COUNT_CONTACTS] += 1
        elif kind == MAP_REST:
            data.counts[job, COUNT_RESTS] += 1
            z[IMPACTS_LEFT + i] = 0.0
    if z[IMPACTS_LEFT + i] > 0.0:
        return False
    data.tau[job], data.w[job] = z[TAU + i], z[W + i]
    return True


@lane
def _assign(z: Any, i: int, job: int, data: Any) -> None:
    state = (data.tau[job], data.w[job], data.forcing[job], data.restitution[job])
    assign_lane(z, i, job, float(data.impacts), state)


@lane
def _on_landing(z: Any, _: Any) -> None:
    land_lanes(z)


@lane_entry(types.void(*[_FLOATS] * 5, types.int64, types.int64[:, ::1]))
def _iterate_axial(
    z: Any, tau: Any, w: Any, forcing: Any, restitution: Any, impacts: int, counts: Any
) -> None:
    in_widest_vectors()
    data = _Trajectories(tau, w, forcing, restitution, impacts, counts)
    run_lanes(z, len(tau), _service, _assign, _on_landing, data)


def iterate_axial(
    tau: NDArray[np.float64],
    w: NDArray[np.float64],
    forcing: NDArray[np.float64],
    restitution: NDArray[np.float64],
    impacts: int,
    counts: NDArray[np.int64],
) -> None:
    """Iterate trajectories `impacts` times.

    tau, w (n,): states at an impact, replaced by the final ones; nan where contact lasts for good.
    forcing, restitution (n,): Γ ≥ 0 and ε in [0, 1]. counts (n, 2) int64: the numbers of completed
    chatters with contact (COUNT_CONTACTS) and of rests (COUNT_RESTS) are added to it. All arrays
    are C-contiguous; nothing is checked.
    """
    if impacts > 0:
        _iterate_axial(scratch(FIELDS), tau, w, forcing, restitution, impacts, counts)


def iterated(
    tau: NDArray[np.float64], w: NDArray[np.float64], platform: tuple[float, float], impacts: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """States and counts after some impacts, as of `iterate_axial`; `platform`: Γ and ε of all."""
    tau, w, counts = tau.copy(), w.copy(), np.zeros((len(tau), 2), np.int64)
    forcing, restitution = (np.full(len(tau), float(value)) for value in platform)
    iterate_axial(tau, w, forcing, restitution, impacts, counts)
    return tau, w, counts

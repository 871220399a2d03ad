"""Settle and measure many trajectories in lanes, as `lyapunov_and_speed` does for one.

The lanes with rotation carry a tangent vector too (`lanes.lane_tangent`). A trajectory first
settles, then it is measured: two stages in one lane, in each of which LEFT counts the impacts to
come.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.maps import axial_map
from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, MAP_IMPACT, MAP_REST
from bouncing_disk_ros.maps.lanes.lane_flight import land_lanes, run_lanes
from bouncing_disk_ros.maps.lanes.lane_table import (
    DELAY,
    IMPACTS_LEFT,
    LANDED,
    LANES,
    TAU,
    TRAJECTORY,
    W,
    assign_lane,
    in_slices,
    lane,
    lane_entry,
    scratch,
    set_impact,
)
from bouncing_disk_ros.maps.lanes.rotation_lanes import (
    DISK_SPEED,
    TANGENT_FIELDS,
    TANGENT_POWER,
    TANGENT_X,
    TANGENT_Y,
    TIME_SUM,
    TURNED_SUM,
    collide_scalar,
    grow_tangent,
    grow_tangents,
    normalise,
    rotate_lanes,
    start_rotation,
)
from bouncing_disk_ros.maps.lyapunov_and_speed import (
    AT_REST,
    CONTACT_COUNT,
    LYAPUNOV,
    MEAN_PER_IMPACT,
    MEAN_PER_TIME,
    MEASURED,
)
from bouncing_disk_ros.maps.rotation_map import ORBIT_SPEED, ORBIT_TURNED

_SPEED_SUM = (TANGENT_FIELDS + 0) * LANES  # over the impacts
_CONTACTS = (TANGENT_FIELDS + 1) * LANES
_KEEP = (TANGENT_FIELDS + 2) * LANES  # impacts with fewer than so many LEFT are kept
_MEASURES = (TANGENT_FIELDS + 3) * LANES  # 1: is measured; 0: settles
_FIELDS = TANGENT_FIELDS + 4

_MATRIX = types.float64[:, ::1]


class _Trajectories(NamedTuple):
    """What the lanes take their trajectories from, and write what they measure to."""

    states: Any
    parameters: Any
    settling: int
    measured: int
    kept: int
    out: Any
    results: Any


@lane
def _sum_up(z: Any) -> int:
    """Add the speed of the lanes whose flight ends; how many of their impacts are to be kept."""
    keeps = 0
    for i in range(LANES):
        landed, speeds = z[LANDED + i] > 0.0, z[_SPEED_SUM + i]
        z[_SPEED_SUM + i] = speeds + z[DISK_SPEED + i] if landed else speeds
        keeps += 1 if landed and z[IMPACTS_LEFT + i] <= z[_KEEP + i] else 0
    return keeps


@lane
def _row(z: Any, i: int, kind: int, delay: float, turned: float, out: Any) -> None:
    """Keep the impact that a lane has just had, if it is one of the last."""
    if not z[IMPACTS_LEFT + i] < z[_KEEP + i]:
        return
    job, place = int(z[TRAJECTORY + i]), int(z[_KEEP + i] - z[IMPACTS_LEFT + i]) - 1
    out[job, place, axial_map.ORBIT_TAU] = z[TAU + i]
    out[job, place, axial_map.ORBIT_W] = z[W + i]
    out[job, place, axial_map.ORBIT_DELAY] = delay
    out[job, place, axial_map.ORBIT_KIND] = kind
    out[job, place, ORBIT_SPEED] = z[DISK_SPEED + i]
    out[job, place, ORBIT_TURNED] = turned


@lane
def _rows(z: Any, out: Any) -> None:
    """`_row` of all lanes that have landed."""
    for i in range(LANES):
        if z[LANDED + i] > 0.0:
            d = z[DELAY + i]
            _row(z, i, MAP_IMPACT, d, z[DISK_SPEED + i] * d, out)


@lane
def _step(z: Any, i: int, out: Any) -> bool:
    """One impact by the scalar map; whether the disk is at rest for good."""
    tau, w = z[TAU + i], z[W + i]
    kind, delay, turned = collide_scalar(z, i)
    if kind == MAP_REST:
        return True
    if kind == MAP_CONTACT:
        z[_CONTACTS + i] += 1.0
    else:
        grow_tangent(z, i, tau, w, delay)
    z[_SPEED_SUM + i] += z[DISK_SPEED + i]
    _row(z, i, kind, delay, turned, out)
    return False


@lane
def _begin_phase(z: Any, i: int, measures: bool, left: int, kept: int) -> None:
    """Begin to settle or to measure so many impacts, of which the last `kept` are kept."""
    set_impact(z, i, z[TAU + i], z[W + i])  # the next launch looks anew whether a chatter may end
    z[IMPACTS_LEFT + i] = left
    z[_KEEP + i] = kept
    z[_MEASURES + i] = 1.0 if measures else 0.0
    for field in (TURNED_SUM, TIME_SUM, _SPEED_SUM, _CONTACTS):
        z[field + i] = 0.0


@lane
def _assign(z: Any, i: int, job: int, data: Any) -> None:
    """Give a lane a trajectory, to settle first if it is to settle."""
    states, parameters = data.states, data.parameters
    disk = (states[job, 0], states[job, 1], parameters[job, 0], parameters[job, 1])
    assign_lane(z, i, job, math.inf, disk)
    start_rotation(z, i, states[job, 2], parameters[job, 2], parameters[job, 3])
    z[TANGENT_X + i], z[TANGENT_Y + i], z[TANGENT_POWER + i] = states[job, 3], states[job, 4], 0.0
    if data.settling > 0:
        _begin_phase(z, i, False, data.settling, 0)
    else:
        _begin_phase(z, i, True, data.measured, data.kept)


@lane
def _finish(z: Any, i: int, measured: int, states: Any, results: Any) -> None:
    """Write what was measured, and the last state."""
    job = int(z[TRAJECTORY + i])
    growth = normalise(z, i)
    for column, field in enumerate((TAU, W, DISK_SPEED, TANGENT_X, TANGENT_Y)):
        states[job, column] = z[field + i]
    contacts = z[_CONTACTS + i]
    results[job, MEAN_PER_TIME] = z[TURNED_SUM + i] / z[TIME_SUM + i]
    results[job, MEAN_PER_IMPACT] = z[_SPEED_SUM + i] / measured
    results[job, LYAPUNOV] = growth / measured if contacts == 0.0 else -math.inf
    results[job, CONTACT_COUNT] = contacts
    results[job, MEASURED] = measured


@lane
def _rest(job: int, states: Any, out: Any, results: Any) -> None:
    """What `attractor` says of a disk at rest for good."""
    for i, number in enumerate(AT_REST):
        states[job, i] = number
        results[job, i] = math.nan
    for i in range(out.shape[1]):
        for column in range(out.shape[2]):
            out[job, i, column] = math.nan


@lane
def _service(z: Any, i: int, data: Any) -> bool:
    """Serve a lane that needs the scalar map; whether its trajectory is done."""
    if z[IMPACTS_LEFT + i] > 0.0 and _step(z, i, data.out):
        _rest(int(z[TRAJECTORY + i]), data.states, data.out, data.results)
        return True
    if z[IMPACTS_LEFT + i] > 0.0:
        return False
    if z[_MEASURES + i] > 0.0:
        _finish(z, i, data.measured, data.states, data.results)
        return True
    normalise(z, i)
    _begin_phase(z, i, True, data.measured, data.kept)
    return False


@lane
def _on_landing(z: Any, data: Any) -> None:
    rotate_lanes(z)
    grow_tangents(z)
    keeps = _sum_up(z)
    land_lanes(z)
    if keeps > 0:
        _rows(z, data.out)


@lane_entry(
    types.void(
        types.float64[::1], _MATRIX, _MATRIX, types.int64, types.int64,
        types.float64[:, :, ::1], _MATRIX,
    )
)  # fmt: skip
def _measure_attractors(
    z: Any, states: Any, parameters: Any, settling: int, measured: int, out: Any, results: Any
) -> None:
    kept = out.shape[1]
    data = _Trajectories(states, parameters, settling, measured, kept, out, results)
    run_lanes(z, len(states), _service, _assign, _on_landing, data)


def measure_attractors(
    states: NDArray[np.float64],
    parameters: NDArray[np.float64],
    settling: int,
    measured: int,
    out: NDArray[np.float64],
    results: NDArray[np.float64],
    *,
    workers: int = 1,
) -> None:
    """`maps.lyapunov_and_speed.attractor` for n trajectories, on so many threads.

    states (n, 5): τ, w, α̇ and a tangent vector, replaced by the last ones. parameters (n, 4): Γ, ε,
    θ and Γ_T > 0. out (n, kept, 6): the last `kept` ≤ measured impacts; nan for a disk at rest for
    good. results (n, 5). settling ≥ 0, measured ≥ 1; all arrays are C-contiguous; nothing is
    checked. A trajectory has the same bits in any order, company and number of threads; those of
    `attractor` differ by roundings, which chaos magnifies.
    """

    def work(part: slice) -> None:
        given = (states[part], parameters[part], settling, measured)
        _measure_attractors(scratch(_FIELDS), *given, out[part], results[part])

    in_slices(work, len(states), workers)

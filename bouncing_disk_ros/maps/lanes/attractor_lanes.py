"""Settle and measure many trajectories with rotation in lanes, as `rotation_map` does for one.

The axial lanes do not know of the rotation: one loop more carries the speed of the disk from impact
to impact, and one a tangent vector. A lane whose chatter may be complete is continued by
`rotation_map.next_collision`, whose units hold. A trajectory first settles, then it is measured:
two stages in one lane, in each of which IMPACTS_LEFT counts the impacts to come.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import sincos
from bouncing_disk_ros.core.restitution import speed_after as scalar_speed_after
from bouncing_disk_ros.maps import axial_map
from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, MAP_IMPACT, MAP_REST, flight_tangent
from bouncing_disk_ros.maps.lanes.lane_basics import (
    COSINE,
    DELAY,
    FIELDS,
    FORCING,
    IMPACTS_LEFT,
    LANDED,
    LANES,
    RESTITUTION,
    SINE,
    SLOPE,
    T0,
    T1,
    T2,
    T3,
    TAU,
    TRAJECTORY,
    W,
    assign_lane,
    in_widest_vectors,
    lane,
    lane_entry,
    lane_turn,
    scratch,
    set_impact,
)
from bouncing_disk_ros.maps.lanes.lane_flight import land_lanes, run_lanes
from bouncing_disk_ros.maps.rotation_map import (
    AT_REST,
    CONTACT_COUNT,
    LYAPUNOV,
    MEAN_PER_IMPACT,
    MEAN_PER_TIME,
    MEASURED,
    ORBIT_SPEED,
    ORBIT_TURNED,
    map_disk,
    map_motion,
    next_collision,
)

DISK_SPEED = (FIELDS + 0) * LANES  # α̇ before the last impact
_LAG_SINE = (FIELDS + 1) * LANES
_LAG_COSINE = (FIELDS + 2) * LANES
_GRIP = (FIELDS + 3) * LANES  # (1 + ε)/Γ_T
TURNED_SUM = (FIELDS + 4) * LANES
TIME_SUM = (FIELDS + 5) * LANES
_LAG = (FIELDS + 6) * LANES
_ANGULAR = (FIELDS + 7) * LANES  # Γ_T
ROTATION_FIELDS = FIELDS + 8

_FLOATS = types.float64[::1]

speed_after = lane(scalar_speed_after)


@lane
def rotate_lanes(z: Any) -> None:
    """The impact that a flight began with, on the lanes whose flight ends; before `land_lanes`."""
    for i in range(LANES):
        landed = z[LANDED + i] > 0.0
        before, d = z[DISK_SPEED + i], z[DELAY + i]
        turned, time = z[TURNED_SUM + i], z[TIME_SUM + i]
        spin = z[COSINE + i] * z[_LAG_COSINE + i] - z[SINE + i] * z[_LAG_SINE + i]
        speed = speed_after(before, spin, z[_GRIP + i] * -z[W + i])
        z[DISK_SPEED + i] = speed if landed else before
        z[TURNED_SUM + i] = turned + speed * d if landed else turned
        z[TIME_SUM + i] = time + d if landed else time


@lane
def collide_scalar(z: Any, i: int) -> tuple[int, float, float]:
    """One impact of a lane by the scalar map: kind, delay, angle turned; LEFT = 0 at rest."""
    motion = map_motion(z[FORCING + i], z[_LAG + i])
    disk = map_disk(z[RESTITUTION + i], z[_ANGULAR + i])
    kind, tau, w, speed, delay, turned = next_collision(
        motion, disk, z[TAU + i], z[W + i], z[DISK_SPEED + i]
    )
    set_impact(z, i, tau, w)
    z[IMPACTS_LEFT + i] -= 1.0
    z[DISK_SPEED + i] = speed
    if kind == MAP_REST:
        z[IMPACTS_LEFT + i] = 0.0
    else:
        z[TURNED_SUM + i] += turned
        z[TIME_SUM + i] += delay
    return kind, delay, turned


@lane
def start_rotation(z: Any, i: int, speed: float, phase_lag: float, angular_forcing: float) -> None:
    """Give the lane of a new trajectory its speed and what turns it; no sums yet."""
    z[DISK_SPEED + i] = speed
    z[_LAG + i] = phase_lag
    z[_LAG_SINE + i], z[_LAG_COSINE + i] = sincos(phase_lag)
    z[_ANGULAR + i] = angular_forcing
    z[_GRIP + i] = (1.0 + z[RESTITUTION + i]) / angular_forcing
    z[TURNED_SUM + i] = 0.0
    z[TIME_SUM + i] = 0.0


# ------------------------------------------------------------------------------------------------
# A tangent vector for each lane: how small changes of (τ, w) grow along the trajectories.
#
# The derivatives are those of maps/axial_map.py, inlined. A vector is scaled by powers of two
# alone, which are counted, when it leaves a wide range: nothing is rounded by that, and the
# logarithm of its growth is taken once for each trajectory.


TANGENT_X = (ROTATION_FIELDS + 0) * LANES  # the tangent vector is 2^POWER (X, Y)
TANGENT_Y = (ROTATION_FIELDS + 1) * LANES
TANGENT_POWER = (ROTATION_FIELDS + 2) * LANES
TANGENT_FIELDS = ROTATION_FIELDS + 3

_FAR = 256.0
_LARGE, _SMALL = 2.0**_FAR, 2.0**-_FAR

turned_tangent = lane(axial_map.turned_tangent)


@lane
def _carried(t: Any, x: float, y: float, power: float) -> tuple[float, float, float]:
    """The vector 2^power (x, y) after a flight with derivatives t; (1, 0) if the vector vanishes.

    Its larger part is brought back towards 1 where it is beyond 2^±256: a single flight changes it
    by far less.
    """
    x, y = t[0] * x + t[1] * y, t[2] * x + t[3] * y
    size = max(abs(x), abs(y))
    down, up, gone = size > _LARGE, size < _SMALL, size == 0.0
    scale = _SMALL if down else (_LARGE if up else 1.0)
    power += _FAR if down else (-_FAR if up else 0.0)
    # ε = 0: a change of w before the impact leaves no trace
    return (1.0 if gone else x * scale), y * scale, (-math.inf if gone else power)


@lane
def grow_tangents(z: Any) -> None:
    """The vectors of the lanes whose flight ends; before `land_lanes`."""
    for i in range(LANES):
        sx, cx, se, ce = lane_turn(z[DELAY + i])
        z[T0 + i], z[T1 + i], z[T2 + i], z[T3 + i] = sx, cx, se, ce
    for i in range(LANES):
        landed = z[LANDED + i] > 0.0
        turn = (z[T0 + i], z[T1 + i], z[T2 + i], z[T3 + i])
        w, d, w1, forcing = z[W + i], z[DELAY + i], z[SLOPE + i], z[FORCING + i]
        t = turned_tangent(z[SINE + i], z[COSINE + i], turn, w, d, w1, forcing, z[RESTITUTION + i])
        x, y, power = z[TANGENT_X + i], z[TANGENT_Y + i], z[TANGENT_POWER + i]
        x1, y1, power1 = _carried(t, x, y, power)
        z[TANGENT_X + i] = x1 if landed else x
        z[TANGENT_Y + i] = y1 if landed else y
        z[TANGENT_POWER + i] = power1 if landed else power


@lane
def grow_tangent(z: Any, i: int, tau: float, w: float, delay: float) -> None:
    """The vector of a lane that the scalar map has taken from (τ, w) over one flight."""
    t = flight_tangent(tau, w, delay, z[W + i], z[FORCING + i], z[RESTITUTION + i])
    x, y, power = _carried(t, z[TANGENT_X + i], z[TANGENT_Y + i], z[TANGENT_POWER + i])
    z[TANGENT_X + i], z[TANGENT_Y + i], z[TANGENT_POWER + i] = x, y, power


@lane
def normalise(z: Any, i: int) -> float:
    """Make the vector one of length 1; returns the logarithm of the length it had."""
    x, y = z[TANGENT_X + i], z[TANGENT_Y + i]
    size = math.sqrt(x * x + y * y)
    growth = math.log(size) + z[TANGENT_POWER + i] * math.log(2.0)
    z[TANGENT_X + i], z[TANGENT_Y + i], z[TANGENT_POWER + i] = x / size, y / size, 0.0
    return growth


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
    """What `measure_attractor` says of a disk at rest for good."""
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
    in_widest_vectors()
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
) -> None:
    """`rotation_map.measure_attractor` for n trajectories.

    states (n, 5): τ, w, α̇ and a tangent vector, replaced by the last ones. parameters (n, 4): Γ, ε,
    θ and Γ_T > 0. out (n, kept, 6): the last `kept` ≤ measured impacts; nan for a disk at rest for
    good. results (n, 5). settling ≥ 0, measured ≥ 1; all arrays are C-contiguous; nothing is
    checked. A trajectory has the same bits in any order and company; those of
    `measure_attractor` differ by roundings, which chaos magnifies.
    """
    _measure_attractors(scratch(_FIELDS), states, parameters, settling, measured, out, results)

"""Iterate the next-collision map with rotation for many trajectories at once.

Units of maps/rotation_map.py. The axial lanes do not know of the rotation: one loop more
carries the speed of the disk from impact to impact. A lane whose chatter may be complete is
continued by `maps.next_collision`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core import impact_law
from bouncing_disk_ros.core.arithmetic import kernel, sincos
from bouncing_disk_ros.maps import map_tangent
from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, MAP_REST
from bouncing_disk_ros.maps.lanes.axial_lanes import COUNT_CONTACTS, COUNT_RESTS
from bouncing_disk_ros.maps.lanes.lane_flight import land_lanes, run_lanes
from bouncing_disk_ros.maps.lanes.lane_table import (
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
    in_slices,
    lane,
    lane_entry,
    lane_turn,
    scratch,
    set_impact,
)
from bouncing_disk_ros.maps.map_tangent import flight_tangent
from bouncing_disk_ros.maps.rotation_map import map_disk, map_motion, next_collision

SUM_TURNED, SUM_TIME = 0, 1
"""Columns of the sums: angle turned in units of Φ, and time in rad; their ratio is the mean α̇."""

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

speed_after = lane(impact_law.speed_after)


class _Trajectories(NamedTuple):
    """What the lanes take their trajectories from, and write their ends and sums to."""

    tau: Any
    w: Any
    speed: Any
    forcing: Any
    restitution: Any
    phase_lag: Any
    angular_forcing: Any
    impacts: int
    counts: Any
    sums: Any


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


@kernel
def _collision(
    tau: float, w: float, speed: float, platform: tuple[float, float], disk: tuple[float, float]
) -> tuple[int, float, float, float, float, float]:
    motion = map_motion(platform[0], platform[1])
    kind, tau, w, speed, delay, turned = next_collision(
        motion, map_disk(disk[0], disk[1]), tau, w, speed
    )
    return kind, tau, w, speed, delay, turned


@lane
def collide_scalar(z: Any, i: int) -> tuple[int, float, float]:
    """One impact of a lane by the scalar map: kind, delay, angle turned; LEFT = 0 at rest."""
    kind, tau, w, speed, delay, turned = _collision(
        z[TAU + i],
        z[W + i],
        z[DISK_SPEED + i],
        (z[FORCING + i], z[_LAG + i]),
        (z[RESTITUTION + i], z[_ANGULAR + i]),
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
def _service(z: Any, i: int, data: Any) -> bool:
    """One impact by the scalar map, if any are left; whether the trajectory is done."""
    job = int(z[TRAJECTORY + i])
    if z[IMPACTS_LEFT + i] > 0.0:
        kind, _, _ = collide_scalar(z, i)
        if kind == MAP_REST:
            data.counts[job, COUNT_RESTS] += 1
        elif kind == MAP_CONTACT:
            data.counts[job, COUNT_CONTACTS] += 1
    if z[IMPACTS_LEFT + i] > 0.0:
        return False
    data.tau[job], data.w[job], data.speed[job] = z[TAU + i], z[W + i], z[DISK_SPEED + i]
    data.sums[job, SUM_TURNED] += z[TURNED_SUM + i]
    data.sums[job, SUM_TIME] += z[TIME_SUM + i]
    return True


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


@lane
def _assign(z: Any, i: int, job: int, data: Any) -> None:
    state = (data.tau[job], data.w[job], data.forcing[job], data.restitution[job])
    assign_lane(z, i, job, float(data.impacts), state)
    start_rotation(z, i, data.speed[job], data.phase_lag[job], data.angular_forcing[job])


@lane
def _on_landing(z: Any, _: Any) -> None:
    rotate_lanes(z)
    land_lanes(z)


@lane_entry(types.void(*[_FLOATS] * 8, types.int64, types.int64[:, ::1], types.float64[:, ::1]))
def _iterate(
    z: Any,
    tau: Any,
    w: Any,
    speed: Any,
    forcing: Any,
    restitution: Any,
    phase_lag: Any,
    angular_forcing: Any,
    impacts: int,
    counts: Any,
    sums: Any,
) -> None:
    states, turning = (tau, w, speed, forcing, restitution), (phase_lag, angular_forcing)
    data = _Trajectories(*states, *turning, impacts, counts, sums)
    run_lanes(z, len(tau), _service, _assign, _on_landing, data)


def iterate_rotation(
    tau: NDArray[np.float64],
    w: NDArray[np.float64],
    speed: NDArray[np.float64],
    forcing: NDArray[np.float64],
    restitution: NDArray[np.float64],
    phase_lag: NDArray[np.float64],
    angular_forcing: NDArray[np.float64],
    impacts: int,
    counts: NDArray[np.int64],
    sums: NDArray[np.float64],
    *,
    workers: int = 1,
) -> None:
    """Iterate trajectories `impacts` times, on so many threads; the same for any number of them.

    tau, w, speed (n,): states (τ, w, α̇/(ωΦ)) just before an impact, replaced by the final ones;
    nan where contact lasts for good. forcing, restitution, phase_lag, angular_forcing (n,): Γ, ε, θ
    and Γ_T > 0. counts (n, 2) as in `iterate`; sums (n, 2): angle turned (TURNED) and time (TIME)
    are added to it. All arrays are C-contiguous; nothing is checked.
    """

    def work(part: slice) -> None:
        states = (tau[part], w[part], speed[part], forcing[part], restitution[part])
        turning = (phase_lag[part], angular_forcing[part])
        _iterate(scratch(ROTATION_FIELDS), *states, *turning, impacts, counts[part], sums[part])

    if impacts > 0:
        in_slices(work, len(tau), workers)


# ------------------------------------------------------------------------------------------------
# A tangent vector for each lane: how small changes of (τ, w) grow along the trajectories.
#
# The derivatives are those of maps/map_tangent.py, inlined. A vector is scaled by powers of two
# alone, which are counted, when it leaves a wide range: nothing is rounded by that, and the
# logarithm of its growth is taken once for each trajectory.


TANGENT_X = (ROTATION_FIELDS + 0) * LANES  # the tangent vector is 2^POWER (X, Y)
TANGENT_Y = (ROTATION_FIELDS + 1) * LANES
TANGENT_POWER = (ROTATION_FIELDS + 2) * LANES
TANGENT_FIELDS = ROTATION_FIELDS + 3

_FAR = 256.0
_LARGE, _SMALL = 2.0**_FAR, 2.0**-_FAR

turned_tangent = lane(map_tangent.turned_tangent)


@lane
def _carried(t: Any, x: float, y: float, power: float) -> tuple[float, float, float]:
    """The vector 2^power (x, y) after a flight with derivatives t; (1, 0) for one that vanishes.

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
    """The vectors of the lanes whose flight ends; before `land`."""
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

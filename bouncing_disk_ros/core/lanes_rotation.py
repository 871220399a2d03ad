"""Iterate the next-collision map with rotation for many trajectories at once.

Units of core/collision_map.py. The axial lanes do not know of the rotation: one loop more carries
the speed of the disk from impact to impact. A lane whose chatter may be complete is carried on by
`collision_map.next_collision`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core import impact
from bouncing_disk_ros.core.arithmetic import kernel, sincos
from bouncing_disk_ros.core.axial_map import MAP_CONTACT, MAP_REST
from bouncing_disk_ros.core.collision_map import map_disk, map_motion, next_collision
from bouncing_disk_ros.core.lanes import (
    ASK,
    COSINE,
    DELAY,
    FIELDS,
    FORCING,
    JOB,
    LANDED,
    LANES,
    LEFT,
    RESTITUTION,
    SINE,
    TAU,
    W,
    enter,
    idle,
    in_slices,
    lane,
    lane_entry,
    place,
    scratch,
)
from bouncing_disk_ros.core.lanes_axial import CONTACTS, RESTS
from bouncing_disk_ros.core.lanes_flight import land, launch, look

TURNED, TIME = 0, 1
"""Columns of the sums: angle turned in units of Φ, and time in rad; their ratio is the mean α̇."""

_SPEED = (FIELDS + 0) * LANES  # α̇ before the last impact
_LAG_SINE = (FIELDS + 1) * LANES
_LAG_COSINE = (FIELDS + 2) * LANES
_GRIP = (FIELDS + 3) * LANES  # (1 + ε)/Γ_T
_TURNED = (FIELDS + 4) * LANES
_TIME = (FIELDS + 5) * LANES
_LAG = (FIELDS + 6) * LANES
_ANGULAR = (FIELDS + 7) * LANES  # Γ_T
_FIELDS = FIELDS + 8

_FLOATS = types.float64[::1]

speed_after = lane(impact.speed_after)


@lane
def _rotate(z: Any) -> None:
    """The impact that a flight began with, on the lanes whose flight ends; before `land`."""
    for i in range(LANES):
        landed = z[LANDED + i] > 0.0
        before, turned, time, d = z[_SPEED + i], z[_TURNED + i], z[_TIME + i], z[DELAY + i]
        spin = z[COSINE + i] * z[_LAG_COSINE + i] - z[SINE + i] * z[_LAG_SINE + i]
        speed = speed_after(before, spin, z[_GRIP + i] * -z[W + i])
        z[_SPEED + i] = speed if landed else before
        z[_TURNED + i] = turned + speed * d if landed else turned
        z[_TIME + i] = time + d if landed else time


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
def _step(z: Any, i: int, counts: Any) -> None:
    """One impact by the scalar map, for a lane that has impacts left."""
    job = int(z[JOB + i])
    if job < 0 or z[LEFT + i] <= 0.0:
        return
    kind, tau, w, speed, delay, turned = _collision(
        z[TAU + i],
        z[W + i],
        z[_SPEED + i],
        (z[FORCING + i], z[_LAG + i]),
        (z[RESTITUTION + i], z[_ANGULAR + i]),
    )
    place(z, i, tau, w)
    z[LEFT + i] -= 1.0
    z[_SPEED + i] = speed
    if kind == MAP_REST:
        counts[job, RESTS] += 1
        z[LEFT + i] = 0.0
        return
    z[_TURNED + i] += turned
    z[_TIME + i] += delay
    if kind == MAP_CONTACT:
        counts[job, CONTACTS] += 1


@lane
def _start(z: Any, i: int, speed: float, phase_lag: float, angular_forcing: float) -> None:
    z[_SPEED + i] = speed
    z[_LAG + i] = phase_lag
    z[_LAG_SINE + i], z[_LAG_COSINE + i] = sincos(phase_lag)
    z[_ANGULAR + i] = angular_forcing
    z[_GRIP + i] = (1.0 + z[RESTITUTION + i]) / angular_forcing
    z[_TURNED + i] = 0.0
    z[_TIME + i] = 0.0


@lane
def _finish(z: Any, i: int, tau: Any, w: Any, speed: Any, sums: Any) -> None:
    job = int(z[JOB + i])
    tau[job], w[job], speed[job] = z[TAU + i], z[W + i], z[_SPEED + i]
    sums[job, TURNED] += z[_TURNED + i]
    sums[job, TIME] += z[_TIME + i]


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
    n = len(tau)
    todo = done = 0
    for i in range(LANES):
        idle(z, i)
        z[ASK + i] = 1.0
    while done < n:
        if todo == 0 or launch(z) > 0:
            for i in range(LANES):
                if z[ASK + i] <= 0.0:
                    continue
                _step(z, i, counts)
                if z[JOB + i] >= 0.0:
                    if z[LEFT + i] > 0.0:
                        continue
                    _finish(z, i, tau, w, speed, sums)
                    done += 1
                if todo == n:
                    idle(z, i)
                    continue
                state = (tau[todo], w[todo], forcing[todo], restitution[todo])
                enter(z, i, todo, float(impacts), state)
                _start(z, i, speed[todo], phase_lag[todo], angular_forcing[todo])
                todo += 1
        look(z, False)
        look(z, True)
        _rotate(z)
        land(z)


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
    """Carry trajectories `impacts` impacts on, on so many threads; the same for any number of them.

    tau, w, speed (n,): states (τ, w, α̇/(ωΦ)) just before an impact, replaced by the final ones;
    nan where contact lasts for good. forcing, restitution, phase_lag, angular_forcing (n,): Γ, ε, θ
    and Γ_T > 0. counts (n, 2) as in `iterate`; sums (n, 2): angle turned (TURNED) and time (TIME)
    are added to it. All arrays are C-contiguous; nothing is checked.
    """

    def work(part: slice) -> None:
        states = (tau[part], w[part], speed[part], forcing[part], restitution[part])
        turning = (phase_lag[part], angular_forcing[part])
        _iterate(scratch(_FIELDS), *states, *turning, impacts, counts[part], sums[part])

    if impacts > 0:
        in_slices(work, len(tau), workers)

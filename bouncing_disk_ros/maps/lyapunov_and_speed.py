"""What an attractor of the next-collision map shows of itself: mean speed, Lyapunov exponent."""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import entry
from bouncing_disk_ros.core.platform import Record
from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, MAP_REST
from bouncing_disk_ros.maps.map_tangent import flight_tangent
from bouncing_disk_ros.maps.rotation_map import map_disk, map_motion, next_collision

MEAN_PER_TIME, MEAN_PER_IMPACT, LYAPUNOV, CONTACT_COUNT, MEASURED = range(5)
"""What `measure_attractor` writes into its results."""

AT_REST = (1.5 * math.pi, 0.0, 0.0, 1.0, 0.0)
"""The state of a disk that contact lasts for: at the lowest point, with any vector."""

_FLOAT = types.float64
_VECTOR = types.Array(_FLOAT, 1, "C")
_MATRIX = types.Array(_FLOAT, 2, "C")


@entry(
    types.int64(_VECTOR, _FLOAT, _FLOAT, _FLOAT, _FLOAT, types.int64, types.int64, _MATRIX, _VECTOR)
)
def measure_attractor(
    state: Record,
    forcing: float,
    restitution: float,
    phase_lag: float,
    angular_forcing: float,
    settling: int,
    measured: int,
    out: Record,
    results: Record,
) -> int:
    """Let the orbit of `state` settle, then measure it; `state` becomes the last one.

    state (5,): τ, w, α̇ as in `next_collision`, and a vector (tangent) that the derivatives of the
    axial map act on. out (kept, 6): the last `kept` ≤ measured impacts, columns of
    `collision_orbit`. results (5,): mean α̇ in time and over the impacts, Lyapunov exponent of the
    axial part per impact (−inf where the orbit holds a contact), number of contacts, impacts
    measured. Returns the number of rows written, 0 where contact lasts for good: then the state is
    that of a disk at rest at the lowest point and the results are nan.
    """
    motion = map_motion(forcing, phase_lag)
    disk = map_disk(restitution, angular_forcing)
    tau, w, omega, x, y = state[0], state[1], state[2], state[3], state[4]
    time = angle = speeds = grown = 0.0
    contacts = 0
    kept = len(out)
    for i in range(settling + measured):
        kind, tau1, w1, omega, delay, turned = next_collision(motion, disk, tau, w, omega)
        if kind == MAP_REST:
            state[:] = AT_REST
            results[:] = math.nan
            return 0
        growth = 1.0
        if kind != MAP_CONTACT:
            t = flight_tangent(tau, w, delay, w1, forcing, restitution)
            x, y = t[0] * x + t[1] * y, t[2] * x + t[3] * y
            growth = math.sqrt(x * x + y * y)
            if growth > 0.0:
                x /= growth
                y /= growth
            else:  # ε = 0: a change of w before the impact leaves no trace
                x, y = 1.0, 0.0
        tau, w = tau1, w1
        if i < settling:
            continue
        contacts += kind == MAP_CONTACT
        grown += math.log(growth)
        time += delay
        angle += turned
        speeds += omega
        if i >= settling + measured - kept:
            out[i - settling - measured + kept] = (tau, w, delay, float(kind), omega, turned)
    state[:] = (tau, w, omega, x, y)
    results[MEAN_PER_TIME] = angle / time
    results[MEAN_PER_IMPACT] = speeds / measured
    results[LYAPUNOV] = grown / measured if contacts == 0 else -math.inf
    results[CONTACT_COUNT] = contacts
    results[MEASURED] = measured
    return kept

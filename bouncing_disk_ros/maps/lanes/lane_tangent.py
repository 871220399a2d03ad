"""A tangent vector for each lane: how small changes of (τ, w) grow along the trajectories.

The derivatives are those of maps/map_tangent.py, inlined. A vector is scaled by powers of
two alone, which are counted, when it leaves a wide range: nothing is rounded by that, and the
logarithm of its growth is taken once for each trajectory.
"""

from __future__ import annotations

import math
from typing import Any

from bouncing_disk_ros.maps import map_tangent
from bouncing_disk_ros.maps.lanes.lane_arithmetic import lane_turn
from bouncing_disk_ros.maps.lanes.lane_table import (
    COSINE,
    DELAY,
    FORCING,
    LANDED,
    LANES,
    RESTITUTION,
    SINE,
    SLOPE,
    T0,
    T1,
    T2,
    T3,
    W,
    lane,
)
from bouncing_disk_ros.maps.lanes.rotation_lanes import ROTATION_FIELDS
from bouncing_disk_ros.maps.map_tangent import flight_tangent

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

"""How near a flight comes to the platform before it lands: least minimum of the gap on the way.

h'' = Γ sin(τ + d) − 1/π, so h' grows only while τ + d is between τ_sep and π − τ_sep (modulo 2π):
in each of these windows the gap has one minimum, or none. Units as in `axial_map`.
"""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, entry, kernel, sincos
from bouncing_disk_ros.core.flight import gap_after, separation_phase
from bouncing_disk_ros.core.platform import Record
from bouncing_disk_ros.core.restitution import rebound
from bouncing_disk_ros.maps.axial_map import (
    GRAVITY,
    MAP_CONTACT,
    MAP_REST,
    axial_motion,
    next_impact,
)


@kernel
def flight_clearance(motion: Record, tau: float, u: float, d: float) -> float:
    """Least minimum of the gap inside a flight of d rad from gap = 0; inf where it has none."""
    leave = separation_phase(motion, GRAVITY)
    least = math.inf
    if leave < 0.0:
        return least
    sine, cosine = sincos(tau)
    begin = leave - tau
    while begin < d:
        end = min(begin + math.pi - 2.0 * leave, d)
        low = max(begin, 0.0)
        if (
            low < end
            and gap_after(motion, 0.0, sine, cosine, GRAVITY, 0.0, u, low)[1] < 0.0
            and gap_after(motion, 0.0, sine, cosine, GRAVITY, 0.0, u, end)[1] > 0.0
        ):
            high = end
            middle = 0.5 * (low + high)
            while low < middle < high:
                if gap_after(motion, 0.0, sine, cosine, GRAVITY, 0.0, u, middle)[1] < 0.0:
                    low = middle
                else:
                    high = middle
                middle = 0.5 * (low + high)
            least = min(least, gap_after(motion, 0.0, sine, cosine, GRAVITY, 0.0, u, middle)[0])
        begin += TWO_PI
    return least


@entry(types.float64(*[types.float64] * 5))
def clearance_of(tau: float, w: float, delay: float, forcing: float, restitution: float) -> float:
    """`flight_clearance` of the flight of `delay` rad after an impact with (τ, w), in πg/ω²."""
    return flight_clearance(axial_motion(forcing), tau, rebound(w, restitution), delay)


@entry(types.int64(types.Array(types.float64, 1, "C"), types.float64, types.float64, types.int64))
def impacts_before_contact(state: Record, forcing: float, restitution: float, impacts: int) -> int:
    """Impacts that follow the one with state (τ, w) up to the first complete chatter; −1: none.

    `state` (2,) becomes that of the last impact before it.
    """
    for i in range(impacts):
        kind, tau, w, _ = next_impact(state[0], state[1], forcing, restitution)
        if kind in (MAP_CONTACT, MAP_REST):
            return i
        state[0] = tau
        state[1] = w
    return -1

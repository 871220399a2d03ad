"""The axial map many times, of many states, and the map backwards.

A flight run backwards is a flight too: with τ' = π − τ the platform moves as before, the speed of
arrival is that of launch. So the impact before one with (τ, w) is the landing of a flight
launched at π − τ with −w, and w there is the speed of that landing over ε. Every state has one,
for a disk that has always flown; where the flight backwards grazes the platform it jumps. Units
as in `axial_map`.
"""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, sincos
from bouncing_disk_ros.core.compilation import entry, kernel
from bouncing_disk_ros.core.flight import Launch
from bouncing_disk_ros.core.platform import Record, axial_jet
from bouncing_disk_ros.maps.axial_map import (
    GRAVITY,
    MAP_REST,
    axial_motion,
    landing,
    next_impact,
)


@kernel
def previous_impact(
    tau: float, w: float, forcing: float, restitution: float
) -> tuple[float, float, float]:
    """(τ, w, delay) of the impact before the one with (τ, w < 0); ε > 0."""
    motion = axial_motion(forcing)
    back = (math.pi - tau) % TWO_PI
    sine, cosine = sincos(back)
    jet = axial_jet(motion, sine, cosine, 0.0)
    d, w1 = landing(motion, Launch(0.0, sine, cosine, GRAVITY, 0.0, -w), jet, 0.0, math.inf)
    return (tau - d) % TWO_PI, w1 / restitution, d


_FLOAT = types.float64
_STATES = types.Array(_FLOAT, 2, "C")
_COUNTS = types.Array(types.int64, 1, "C")


@entry(types.void(_STATES, _COUNTS, _FLOAT, _FLOAT, _FLOAT))
def iterate_backwards(
    states: Record, counts: Record, forcing: float, restitution: float, fastest: float
) -> None:
    """Take each state (τ, w) so many impacts back, in place; (nan, nan) once |w| > fastest."""
    for i in range(len(states)):
        tau, w = states[i, 0], states[i, 1]
        for _ in range(counts[i]):
            if not -w <= fastest:
                tau, w = math.nan, math.nan
                break
            tau, w, _d = previous_impact(tau, w, forcing, restitution)
        states[i, 0], states[i, 1] = tau, w


@entry(types.void(_STATES, _COUNTS, _FLOAT, _FLOAT))
def iterate_forwards(states: Record, counts: Record, forcing: float, restitution: float) -> None:
    """Take each state (τ, w) so many impacts on, in place; (nan, nan) where contact lasts."""
    for i in range(len(states)):
        tau, w = states[i, 0], states[i, 1]
        for _ in range(counts[i]):
            kind, tau, w, _d = next_impact(tau, w, forcing, restitution)
            if kind == MAP_REST:
                break
        states[i, 0], states[i, 1] = tau, w


@entry(types.void(_STATES, _FLOAT, _STATES))
def land_from_height(flights: Record, forcing: float, out: Record) -> None:
    """The next impacts of disks in flight: of (τ, gap ≥ 0, relative speed) the (τ, w) and delay.

    A gap of 0 and a speed below 0 is an impact at once; so is a gap of 0 at speed 0 on a platform
    that rises, whose impact has w = 0.
    """
    motion = axial_motion(forcing)
    for i in range(len(flights)):
        tau, gap, speed = flights[i, 0], flights[i, 1], flights[i, 2]
        if gap <= 0.0 and speed <= 0.0:
            out[i, 0], out[i, 1], out[i, 2] = tau % TWO_PI, speed, 0.0
            continue
        sine, cosine = sincos(tau % TWO_PI)
        jet = axial_jet(motion, sine, cosine, 0.0)
        launch = Launch(0.0, sine, cosine, GRAVITY, gap, speed)
        d, w = landing(motion, launch, jet, 0.0, math.inf)
        out[i, 0], out[i, 1], out[i, 2] = (tau + d) % TWO_PI, w, d

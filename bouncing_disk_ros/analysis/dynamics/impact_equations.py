"""Periodic orbits of the next-collision map as smooth equations of their impact times.

Between two impacts the flight is fixed by their times alone, for the gap is 0 at both; so an orbit
of n impacts in k periods is n times with n equations, the impact law v⁺ = (1 + ε)ṡ − ε v⁻ at each.
Unlike the map these equations have no first root to search for: they stay smooth where a flight is
tangent to the platform and beyond, where the orbit is no motion of a disk any more. Whether it is
one is said by `admissible`. They are analytic: values with an imaginary part of `STEP` give exact
derivatives (complex step), and whole batches are computed at once.

Time is phase, lengths are in πg/ω², velocities in πg/ω (gravity is 1/π).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.collision_map.clearance import clearance_of

Array = NDArray[np.float64]
Values = NDArray[Any]  # float64 or complex128

STEP = 1e-30
"""Imaginary part that gives derivatives: no difference is taken, so none is rounded."""
GRAVITY = 1.0 / math.pi
TOUCHES = 1e-12
"""A gap (πg/ω²) above the negative of it counts as not negative."""


class Flights(NamedTuple):
    """What follows from impact times; all (…, n), flight i begins at impact i."""

    defect: Values  # of the impact law, velocity: 0 on an orbit
    duration: Values  # rad
    launch: Values  # absolute velocity after impact i
    before: Values  # w_A before impact i
    after: Values  # w_A before impact i + 1


def _next(values: Values) -> Values:
    """Of each impact (…, n) the value of the one after it, the first after the last."""
    return np.concatenate((values[..., 1:], values[..., :1]), axis=-1)


def flights(times: Values, cycles: int, axial_forcing: Values, restitution: Values) -> Flights:
    """The flights between impacts at `times` (…, n), rad; Γ and ε (…, 1)."""
    following = np.concatenate((times[..., 1:], times[..., :1] + math.tau * cycles), axis=-1)
    duration = following - times
    height, speed = axial_forcing * np.sin(times), axial_forcing * np.cos(times)
    launch = (_next(height) - height) / duration + 0.5 * GRAVITY * duration
    arrived = launch - GRAVITY * duration
    arrival = np.concatenate((arrived[..., -1:], arrived[..., :-1]), axis=-1)
    defect = launch - (1.0 + restitution) * speed + restitution * arrival
    before = arrival - speed
    return Flights(defect, duration, launch, before, _next(before))


def trace(
    found: Flights, times: Values, axial_forcing: Values, restitution: Values
) -> NDArray[Any]:
    """Trace (…) of the derivatives of (τ, w) over one repetition, by map_tangent's formulas."""
    sine, cosine = np.sin(times), np.cos(times)
    later, cosine1 = _next(sine), _next(cosine)
    w1, d = found.after, found.duration
    bend = axial_forcing * later - GRAVITY
    by_phase = axial_forcing * (cosine1 - cosine + d * sine) / w1
    by_speed = -d / w1
    a, b = 1.0 + by_phase, -restitution * by_speed
    c = axial_forcing * (later - sine) + bend * by_phase
    e = -restitution * (1.0 + bend * by_speed)
    p, q, r, s = a[..., 0], b[..., 0], c[..., 0], e[..., 0]
    for i in range(1, times.shape[-1]):
        p, r = a[..., i] * p + b[..., i] * r, c[..., i] * p + e[..., i] * r
        q, s = a[..., i] * q + b[..., i] * s, c[..., i] * q + e[..., i] * s
    return np.asarray(p + s)


def touching(
    found: Flights, times: Values, axial_forcing: Values, flight: int, touch: Values
) -> tuple[Values, Values]:
    """Gap and its derivative (…) at the time `touch` (…) of one flight: both are 0 at a graze."""
    since = touch - times[..., flight]
    forcing = axial_forcing[..., 0]
    launch, height = found.launch[..., flight], forcing * np.sin(times[..., flight])
    gap = height + launch * since - 0.5 * GRAVITY * since * since - forcing * np.sin(touch)
    return gap, launch - GRAVITY * since - forcing * np.cos(touch)


def clearances(times: Array, cycles: int, axial_forcing: float, restitution: float) -> Array:
    """Least minimum (n,) of the gap inside each flight; inf: it has none, < 0: not a flight."""
    found = flights(times, cycles, np.array([axial_forcing]), np.array([restitution]))
    return np.array([
        clearance_of(float(tau) % math.tau, float(w), float(d), axial_forcing, restitution)
        for tau, w, d in zip(times, found.before, found.duration, strict=True)
    ])  # fmt: skip


def admissible(times: Array, cycles: int, axial_forcing: float, restitution: float) -> bool:
    """Whether a solution is a motion of a disk: it hits from above, and no flight is cut short."""
    found = flights(times, cycles, np.array([axial_forcing]), np.array([restitution]))
    if np.any(found.duration <= 0.0) or np.any(found.before >= 0.0):
        return False
    return bool(np.all(clearances(times, cycles, axial_forcing, restitution) > -TOUCHES))

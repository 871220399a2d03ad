"""Impacts to be measured: an independent simulation, with scatter of the restitution."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
GRAVITY = 9.80665
_STEPS, _PERIODS = 100, 60
"""Of a period of the platform, and most of these, in the search for an impact."""


def at_rest(
    rng: np.random.Generator, count: int, error: float, scatter: float, restitution: float = 0.75,
    first: float = 0.45,
) -> Array:  # fmt: skip
    """Times of impacts on a platform at rest; `first`: the first flight, s."""
    each = restitution + scatter * rng.standard_normal(count - 2)
    flights = first * np.concatenate([[1.0], np.cumprod(each)])
    times = 0.3 + np.concatenate([[0.0], np.cumsum(flights)])
    return times + error * rng.standard_normal(count)


def with_law(
    count: int, takeoff: float, restitution: float, slope: float = 0.0, drag: float = 0.0
) -> Array:
    """Times of impacts at rest, the first at 0: ε - ε₁v, quadratic drag κ (1/m), m/s."""
    times, terminal = [0.0], math.sqrt(GRAVITY / drag) if drag else math.inf
    for _ in range(count - 1):
        a = takeoff / terminal
        flight = 2.0 * takeoff / GRAVITY
        if drag:
            flight = terminal / GRAVITY * (math.atan(a) + math.asinh(a))
        times.append(times[-1] + flight)
        landing = takeoff / math.sqrt(1.0 + a * a)
        takeoff = (restitution - slope * landing) * landing
    return np.array(times)


def vibrating(
    rng: np.random.Generator, runs: int, count: int, forcing: float, restitution: float,
    scatter: float = 0.0, skip: int = 0, frequency: float = 20.0, gravity: float = GRAVITY,
) -> tuple[Array, Array]:  # fmt: skip
    """True times (runs, count) of impacts without chatter, and the phase φ of each run.

    Flights are searched in steps of 1/100 period and bisected; runs with shorter flights are left
    out, so there may be fewer. Times begin anew at 0 after `skip` impacts.
    """
    w = math.tau * frequency
    amplitude = forcing * math.pi * gravity / w**2
    at, step = np.zeros(runs), 1.0 / frequency / _STEPS
    ahead = np.cumsum(np.r_[2.0 * step, np.full(_PERIODS * _STEPS - 1, step)])[:, None]
    phase = rng.uniform(0.0, math.tau, runs)
    speed = amplitude * w * np.cos(phase) + rng.uniform(0.6, 1.4, runs) * math.pi * gravity / w
    times, good = np.zeros((runs, count + skip)), np.ones(runs, bool)
    for i in range(count + skip):
        start = amplitude * np.sin(w * at + phase)

        def gap(d: Array, start: Array = start, at: Array = at, speed: Array = speed) -> Array:
            drop: Array = start + speed * d - 0.5 * gravity * d * d
            return drop - amplitude * np.sin(w * (at + d) + phase)

        good &= gap(ahead[0]) > 0.0
        place, flying = np.zeros(runs, int), good.copy()
        for first in range(0, len(ahead), _STEPS):
            landed = gap(ahead[first : first + _STEPS]) <= 0.0
            here = np.where(landed.any(axis=0), landed.argmax(axis=0), _STEPS - 1)
            place = np.where(flying, first + here, place)
            flying &= ~landed.any(axis=0)
            if not flying.any():
                break
        high = ahead[place, 0]
        low = high - step
        for _ in range(52):
            middle = 0.5 * (low + high)
            above = gap(middle) > 0.0
            low, high = np.where(above, middle, low), np.where(above, high, middle)
        at = at + high
        times[:, i] = at
        platform = amplitude * w * np.cos(w * at + phase)
        landing = speed - gravity * high - platform
        speed = platform - (restitution + scatter * rng.standard_normal(runs)) * landing
    begun = times[:, skip] - 0.01
    return (times[:, skip:] - begun[:, None])[good], np.mod(phase + w * begun, math.tau)[good]

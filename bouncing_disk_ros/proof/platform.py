"""Platform motion in ball arithmetic: one forcing phase, and what oscillates with it.

Time is counted in seconds from the clock of a state. A steady motion starts from the state's
forcing phase; a cross-fade from its place in the fade too: the quintic blend b(σ) = σ³(10 − 15σ +
6σ²) takes A, Φ, f and θ each from v to v + Δv, and τ = ∫ω dt.
"""

from __future__ import annotations

import math
from copy import copy
from typing import Protocol

from flint import arb

from bouncing_disk_ros.proof.records import MotionRecord, State

NS = 1_000_000_000
WIDE = 0.5
"""Over a piece of more than twice so much (rad) the phase tells nothing that is worth it."""


def seconds(state: State, ns: int, sub: float = 0.0) -> arb:
    """Exact time from the clock of a state to the instant ns + sub, s."""
    return (arb(ns - state.ns) + (arb(sub) - arb(state.sub))) / NS


def interval(a: float, b: float) -> arb:
    """The interval [a, b] as a ball."""
    middle = 0.5 * (a + b)
    return arb(middle, math.nextafter(max(b - middle, middle - a), math.inf))


class Oscillation(Protocol):
    """K = k_s·s + k_b·β = Im(Z e^{iτ}), Z = k_s A + k_b Φ e^{iθ}, as a function of time."""

    def jet(self, t: arb) -> list[arb]:
        """K and its first four derivatives at a point, or over a piece."""
        ...

    def envelope(self, t: arb) -> list[arb]:
        """Bounds of the absolute values of K and its first four derivatives over a piece."""
        ...


class Platform(Protocol):
    """The motion of the platform from the clock of a state on."""

    def phase(self, t: arb) -> arb:
        """Forcing phase without whole turns taken off, rad."""
        ...

    def rate(self, t: arb) -> arb:
        """Angular frequency ω, rad/s."""
        ...

    def mix(self, axial: arb, angular: arb) -> Oscillation:
        """The oscillation axial·s + angular·β."""
        ...


class SteadyPlatform:
    """s = A sin(τ₀ + ωt), β = Φ sin(τ₀ + ωt + θ)."""

    def __init__(self, motion: MotionRecord, state: State, rate: arb | None = None) -> None:
        """At the precision in force; `rate` in place of ω = 2πf."""
        self._tau = arb(state.tau)
        self._rate = arb.pi() * 2 * arb(motion.f) if rate is None else rate
        self._motion = motion

    def moved(self, t: arb) -> SteadyPlatform:
        """The same motion, with its time counted from t seconds later."""
        later = copy(self)
        later._tau = self.phase(t)
        return later

    def phase(self, t: arb) -> arb:
        """Forcing phase without whole turns taken off, rad."""
        return self._tau + self._rate * t

    def rate(self, _t: arb) -> arb:
        """Angular frequency ω, rad/s."""
        return self._rate

    def mix(self, axial: arb, angular: arb) -> Oscillation:
        """The oscillation axial·s + angular·β."""
        sine, cosine = arb(self._motion.lag).sin_cos()
        turning = angular * self._motion.p
        return _Sinusoid(self, axial * self._motion.a + turning * cosine, turning * sine)


class _Sinusoid:
    """P sin τ + Q cos τ at a steady rate."""

    def __init__(self, platform: SteadyPlatform, p: arb, q: arb) -> None:
        self._platform, self._p, self._q = platform, p, q
        rate = platform.rate(arb(0))
        self._rate, self._square = rate, rate * rate
        span = (p * p + q * q).sqrt()
        self._envelope = [span * rate**order for order in range(5)]

    def jet(self, t: arb) -> list[arb]:
        """Itself and its first four derivatives at a point, or over a piece."""
        phase = self._platform.phase(t)
        if phase.rad() > WIDE:
            return [arb(0, 1) * bound for bound in self._envelope]
        sine, cosine = phase.sin_cos()
        k0 = self._p * sine + self._q * cosine
        k1 = self._rate * (self._p * cosine - self._q * sine)
        k2, k3 = -self._square * k0, -self._square * k1
        return [k0, k1, k2, k3, -self._square * k2]

    def envelope(self, _t: arb) -> list[arb]:
        """Bounds of the absolute values of itself and its first four derivatives."""
        return self._envelope


def platform_of(motion: MotionRecord, state: State) -> Platform:
    """The motion in force from a state on."""
    if motion.fading:
        from bouncing_disk_ros.proof.fade import FadingPlatform

        return FadingPlatform(motion, state)
    return SteadyPlatform(motion, state)

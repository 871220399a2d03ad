"""Platform motion in ball arithmetic: Taylor coefficients of s and β at an instant or over a piece.

Time is counted in seconds from the clock of a state. A steady motion starts from the state's
forcing phase; a cross-fade from its place in the fade too: the quintic blend b(σ) = σ³(10 − 15σ +
6σ²) takes A, Φ, f and θ each from v to v + Δv, and τ = ∫ω dt.
"""

from __future__ import annotations

from flint import arb

from bouncing_disk_ros.proof.records import MotionRecord, State

Jet = list[arb]
"""A value and its derivatives in time."""


def two_pi() -> arb:
    """2π at the precision in force."""
    return arb.pi() * 2


def seconds(state: State, ns: int, sub: float = 0.0) -> arb:
    """Exact time from the clock of a state to the instant ns + sub."""
    return (arb(ns - state.ns) + arb(sub) - arb(state.sub)) / 1_000_000_000


class SteadyPlatform:
    """s = A sin(τ₀ + ωt), β = Φ sin(τ₀ + ωt + θ)."""

    def __init__(self, motion: MotionRecord, state: State) -> None:
        """At the precision in force."""
        self.tau = arb(state.tau)
        self.rate = two_pi() * arb(motion.f)
        self.amplitude = arb(motion.a)
        self.turning = arb(motion.p)
        self.lag = arb(motion.lag)

    def phase(self, t: arb) -> arb:
        """Forcing phase without whole turns taken off, rad."""
        return self.tau + self.rate * t

    def axial(self, t: arb) -> Jet:
        """Position s and its first four derivatives."""
        return _sinusoid(self.amplitude, self.rate, self.phase(t))

    def angular(self, t: arb) -> Jet:
        """Angle β and its first four derivatives."""
        return _sinusoid(self.turning, self.rate, self.phase(t) + self.lag)

    def highest(self, _t: arb) -> arb:
        """Bound of |s| over a piece."""
        return self.amplitude

    def fastest(self, _t: arb) -> arb:
        """Bound of ω over a piece."""
        return self.rate


def _sinusoid(amplitude: arb, rate: arb, angle: arb) -> Jet:
    sine, cosine = angle.sin_cos()
    z0 = amplitude * sine
    z1 = amplitude * rate * cosine
    square = rate * rate
    z2 = -square * z0
    z3 = -square * z1
    return [z0, z1, z2, z3, -square * z2]

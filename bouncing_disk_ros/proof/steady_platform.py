"""A steady motion of the platform in ball arithmetic."""

from __future__ import annotations

from copy import copy

from flint import arb

from bouncing_disk_ros.proof.exact_records import MotionRecord, State
from bouncing_disk_ros.proof.interval_platform import WIDE, Cancelled, Oscillation, Platform


class SteadyPlatform(Platform):
    """s = A sin(τ₀ + ωt), β = Φ sin(τ₀ + ωt + θ)."""

    def __init__(self, motion: MotionRecord, state: State, rate: arb | None = None) -> None:
        """At the precision in force; `rate` in place of ω = 2πf."""
        super().__init__()
        self._tau = arb(state.tau)
        self._rate = arb.pi() * 2 * arb(motion.f) if rate is None else rate
        self._motion = motion

    def moved(self, t: arb) -> SteadyPlatform:
        """The same motion, with its time counted from t seconds later."""
        later = copy(self)
        later._tau, later._reached = self.phase(t), {}
        return later

    def phase(self, t: arb) -> arb:
        """Forcing phase without whole turns taken off, rad."""
        return self._tau + self._rate * t

    def rate(self, _t: arb) -> arb:
        """Angular frequency ω, rad/s."""
        return self._rate

    def cancelled(self, _t: float) -> Cancelled:
        """What cancels: nothing."""
        return Cancelled()

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

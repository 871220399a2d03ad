"""A cross-fade of the platform's motion in ball arithmetic, by Taylor series of short length.

The quintic blend b(σ) = σ³(10 − 15σ + 6σ²) takes A, Φ, f and θ each from v to v + Δv; τ = ∫ω dt.
Where K = Im(Z e^{iτ}) with Z = k_s A + k_b Φ e^{iθ}, the series of Z(t + δ) e^{i(τ(t + δ) − τ(t))}
in δ has coefficients that vary as slowly as the blend does: their absolute values bound K and its
derivatives over many periods, and turned by e^{iτ(t)} they are K and its derivatives.
"""

from __future__ import annotations

import math

from flint import acb, acb_series, arb

from bouncing_disk_ros.proof.exact_records import MotionRecord, State
from bouncing_disk_ros.proof.interval_platform import WIDE, Cancelled, Oscillation, Platform
from bouncing_disk_ros.units import NS

_ORDERS = 5
Series = list[arb]


class FadingPlatform(Platform):
    """A, Φ, f and θ on their way from one motion to another."""

    roundings = 4.0
    clock = 1e-9

    def __init__(self, motion: MotionRecord, state: State) -> None:
        """At the precision in force."""
        super().__init__()
        self.motion = motion
        self._duration = arb(motion.end_ns - motion.begin_ns) / NS
        self._begun = (arb(state.ns - motion.begin_ns) + arb(state.sub)) / NS
        self._tau = arb(state.tau)
        self._start = self._blend_integral(arb(0))

    def place(self, t: arb) -> arb:
        """The part σ of the fade that is over."""
        return (self._begun + t) / self._duration

    def _blend_integral(self, t: arb) -> arb:
        x = self.place(t)
        square = x * x
        return square * square * (arb(2.5) + x * (x - 3))

    def blend(self, t: arb) -> Series:
        """Taylor coefficients of b in time; b grows always, so its range is that of its ends."""
        x = self.place(t)
        y = 1 - x
        r = 1 / self._duration
        b0 = _blend(x) if t.rad() == 0 else _blend(x.lower()).union(_blend(x.upper()))
        xy = x * y
        return [
            b0,
            30 * xy * xy * r,
            30 * xy * (1 - 2 * x) * r**2,
            10 * (1 - 6 * xy) * r**3,
            15 * (2 * x - 1) * r**4,
        ]

    def phase(self, t: arb) -> arb:
        """Forcing phase without whole turns taken off, rad."""
        if t.rad() == 0:
            grown = self._blend_integral(t) - self._start
            faded = self.motion.df * self._duration * grown
            return self._tau + arb.pi() * 2 * (self.motion.f * t + faded)
        middle = t.mid()
        return self.phase(middle) + self.rate(t) * (t - middle)

    def rate(self, t: arb) -> arb:
        """Angular frequency ω, rad/s."""
        return arb.pi() * 2 * (self.motion.f + self.motion.df * self.blend(t)[0])

    def cancelled(self, t: float) -> Cancelled:
        """What cancels in the sums v + Δv·b over the first t seconds."""
        m, b = self.motion, float(self.blend(arb(t))[0])
        frequency = (m.f + abs(m.df) * b) / float(m.f + m.df * self.blend(arb(t))[0])
        return Cancelled(max(frequency, 1.0), max(-2.0 * m.da * b, 0.0), max(-2.0 * m.dp * b, 0.0))

    def mix(self, axial: arb, angular: arb) -> Oscillation:
        """The oscillation axial·s + angular·β."""
        return _FadingOscillation(self, axial, angular)


def _blend(x: arb) -> arb:
    return x * x * x * (10 + x * (6 * x - 15))


def _faded(begin: float, change: float, blend: Series) -> Series:
    return [begin + change * blend[0], *(change * b for b in blend[1:])]


class _FadingOscillation:
    """K = axial·s + angular·β in a cross-fade."""

    def __init__(self, platform: FadingPlatform, axial: arb, angular: arb) -> None:
        self._platform, self._axial, self._angular = platform, axial, angular

    def jet(self, t: arb) -> list[arb]:
        """K and its first four derivatives at a point, or over a piece."""
        turned = self._turned(t)
        phase = self._platform.phase(t)
        if phase.rad() > WIDE:
            return [arb(0, 1) * abs(c).upper() for c in turned]
        sine, cosine = phase.sin_cos()
        return [c.real * sine + c.imag * cosine for c in turned]

    def envelope(self, t: arb) -> list[arb]:
        """Bounds of the absolute values of K and its first four derivatives over a piece."""
        return [abs(c).upper() for c in self._turned(t)]

    def _turned(self, t: arb) -> list[acb]:
        """Derivatives of Z e^{iτ} over e^{iτ}."""
        m, blend = self._platform.motion, self._platform.blend(t)
        two_pi = arb.pi() * 2
        frequency = _faded(m.f, m.df, blend)
        turn = [acb(0), *(acb(0, two_pi * w / k) for k, w in enumerate(frequency[:4], start=1))]
        amplitude = [acb(self._axial * z) for z in _faded(m.a, m.da, blend)]
        series = acb_series(amplitude, _ORDERS)
        if self._angular != 0:
            turning = [acb(self._angular * z) for z in _faded(m.p, m.dp, blend)]
            lag = [acb(0, z) for z in _faded(m.lag, m.dlag, blend)]
            series += acb_series(turning, _ORDERS) * acb_series(lag, _ORDERS).exp()
        coefficients = (series * acb_series(turn, _ORDERS).exp()).coeffs()
        coefficients += [acb(0)] * (_ORDERS - len(coefficients))
        return [c * math.factorial(k) for k, c in enumerate(coefficients)]

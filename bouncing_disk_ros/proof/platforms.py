"""Platforms in ball arithmetic, steady, in a cross-fade and with an offset: one forcing phase τ.

Time is counted in seconds from the clock of a state, whose forcing phase the motion starts from.
"""

from __future__ import annotations

import math
from copy import copy
from typing import NamedTuple, Self

from flint import acb, acb_series, arb

from bouncing_disk_ros.proof.exact_records import MotionRecord, OffsetPiece, State
from bouncing_disk_ros.units import NS

_ORDERS = 5  # K and its first four derivatives
WIDE = 0.5
"""Over a piece of more than twice this (rad), bounds from the phase are as wide as global ones."""


def seconds(state: State, ns: int, sub: float = 0.0) -> arb:
    """Exact time from the clock of a state to the instant ns + sub, s."""
    return (arb(ns - state.ns) + (arb(sub) - arb(state.sub))) / NS


def interval(a: float, b: float) -> arb:
    """The interval [a, b] as a ball."""
    middle = 0.5 * (a + b)
    return arb(middle, math.nextafter(max(b - middle, middle - a), math.inf))


class Cancelled(NamedTuple):
    """How much larger the terms of v + Δv·b are than their sum, in a fade to a smaller value.

    Their rounding is that of the terms: of the frequency as a part of it, of A and Φ as what is to
    be added to them.
    """

    frequency: float = 1.0
    axial: float = 0.0  # m
    angular: float = 0.0  # rad


class Reach(NamedTuple):
    """The greatest values over the first seconds, as floats, times what a fade adds to roundings.

    Of s, β and their first four derivatives; and by how much the forcing phase grows at most, rad.
    """

    axial: list[float]
    angular: list[float]
    turn: float


class Platform:
    """The motion from the clock of a state on: s = A sin(τ₀ + ωt), β = Φ sin(τ₀ + ωt + θ).

    With the offsets of both on top of it.
    """

    roundings = 1.0
    """How many more roundings s and β have than those of a steady motion."""

    def __init__(
        self,
        motion: MotionRecord,
        state: State,
        rate: arb | None = None,
        tau: arb | None = None,
    ) -> None:
        """At the precision in force; `rate` in place of ω = 2πf, `tau` of the state's phase."""
        self.motion = motion
        self.clock = 0.0 if motion.repeats else 1e-9
        """Resolution of the instant of the state, s; 0: the forcing phase is what is known."""
        pieces = (motion.axial, motion.angular)
        self.offsets = [piece and _Polynomial(piece, state) for piece in pieces]
        self._tau = arb(state.tau) if tau is None else tau
        self._rate = arb.pi() * 2 * arb(motion.f) if rate is None else rate
        self._reached: dict[float, Reach] = {}

    def moved(self, t: arb) -> Self:
        """The same motion, with its time counted from t seconds later."""
        later = copy(self)
        later._tau, later._reached = self.phase(t), {}
        later.offsets = [offset and offset.moved(t) for offset in self.offsets]
        return later

    def phase(self, t: arb) -> arb:
        """Forcing phase without whole turns taken off, rad."""
        return self._tau + self._rate * t

    def rate(self, _t: arb) -> arb:
        """Angular frequency ω, rad/s."""
        return self._rate

    def cancelled(self, _t: float) -> Cancelled:
        """What cancels in the sums v + Δv·b over the first t seconds; steady: nothing."""
        return Cancelled()

    def mix(self, axial: arb, angular: arb) -> Oscillation:
        """The oscillation axial·s + angular·β."""
        return Oscillation(self, axial, angular)

    def reach(self, t: float) -> Reach:
        """The greatest values over the first t seconds."""
        if t not in self._reached:
            self._reached[t] = self._reach(t)
        return self._reached[t]

    def _reach(self, t: float) -> Reach:
        whole, cancelled = interval(0.0, t), self.cancelled(t)
        rate, part = float(self.rate(whole).upper()), self.roundings * cancelled.frequency

        def greatest(oscillation: Oscillation, more: float) -> list[float]:
            bounds = oscillation.envelope(whole)
            return [part * (float(r.upper()) + more * rate**n) for n, r in enumerate(bounds)]

        axial = greatest(self.mix(arb(1), arb(0)), cancelled.axial)
        angular = greatest(self.mix(arb(0), arb(1)), cancelled.angular)
        return Reach(axial, angular, rate * t * cancelled.frequency)


class Oscillation:
    """K = k_s·s + k_b·β as a function of time: P sin τ + Q cos τ at a steady rate, and offsets."""

    def __init__(self, platform: Platform, axial: arb, angular: arb) -> None:
        self._platform, self._axial, self._angular = platform, axial, angular
        both = zip((axial, angular), platform.offsets, strict=True)
        self._parts = [(factor, offset) for factor, offset in both if offset is not None]
        self._begin(platform.motion)

    def jet(self, t: arb) -> list[arb]:
        """K and its first four derivatives at a point, or over a piece."""
        found = self._swing(t)
        for factor, offset in self._parts:
            added = zip(found, offset.jet(t), strict=True)
            found = [value + factor * more for value, more in added]
        return found

    def envelope(self, t: arb) -> list[arb]:
        """Bounds of the absolute values of K and its first four derivatives over a piece."""
        found = self._bounds(t)
        for factor, offset in self._parts:
            added = zip(found, offset.jet(t), strict=True)
            found = [value + abs(factor * more).upper() for value, more in added]
        return found

    def _begin(self, motion: MotionRecord) -> None:
        sine, cosine = arb(motion.lag).sin_cos()
        turning = self._angular * motion.p
        self._p, self._q = self._axial * motion.a + turning * cosine, turning * sine
        self._rate = self._platform.rate(arb(0))
        span = (self._p * self._p + self._q * self._q).sqrt()
        self._greatest = [span * self._rate**order for order in range(_ORDERS)]

    def _bounds(self, _t: arb) -> list[arb]:
        """Bounds of the absolute values, without offsets."""
        return self._greatest

    def _swing(self, t: arb) -> list[arb]:
        """K and its derivatives, without offsets."""
        phase = self._platform.phase(t)
        if phase.rad() > WIDE:
            return [arb(0, 1) * bound for bound in self._bounds(t)]
        sine, cosine = phase.sin_cos()
        square = self._rate * self._rate
        k0 = self._p * sine + self._q * cosine
        k1 = self._rate * (self._p * cosine - self._q * sine)
        k2, k3 = -square * k0, -square * k1
        return [k0, k1, k2, k3, -square * k2]


# ------------------------------------------------------------------------------------------------
# A cross-fade of the platform's motion in ball arithmetic, by Taylor series of short length.
#
# The quintic blend b(σ) = σ³(10 − 15σ + 6σ²) takes A, Φ, f and θ each from v to v + Δv; τ = ∫ω dt.
# Where K = Im(Z e^{iτ}) with Z = k_s A + k_b Φ e^{iθ}, the series of Z(t + δ) e^{i(τ(t + δ) −
# τ(t))} in δ has coefficients that vary as slowly as the blend does: their absolute values bound K
# and its derivatives over many periods, and turned by e^{iτ(t)} they are K and its derivatives.


Series = list[arb]


class FadingPlatform(Platform):
    """A, Φ, f and θ on their way from one motion to another."""

    roundings = 4.0

    def __init__(self, motion: MotionRecord, state: State, tau: arb | None = None) -> None:
        """At the precision in force; `tau` in place of the forcing phase of the state."""
        super().__init__(motion, state, tau=tau)
        self._duration = arb(motion.end_ns - motion.begin_ns) / NS
        self._begun = (arb(state.ns - motion.begin_ns) + arb(state.sub)) / NS
        self._start = self._blend_integral(arb(0))

    def moved(self, t: arb) -> Self:
        """The same motion, with its time counted from t seconds later."""
        later = super().moved(t)
        later._begun = self._begun + t
        later._start = later._blend_integral(arb(0))
        return later

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


class _FadingOscillation(Oscillation):
    """K = axial·s + angular·β in a cross-fade."""

    _platform: FadingPlatform

    def _begin(self, motion: MotionRecord) -> None:
        """Nothing is the same for all times."""

    def _bounds(self, t: arb) -> list[arb]:
        return [abs(c).upper() for c in self._turned(t)]

    def _swing(self, t: arb) -> list[arb]:
        phase = self._platform.phase(t)
        if phase.rad() > WIDE:
            return [arb(0, 1) * bound for bound in self._bounds(t)]
        sine, cosine = phase.sin_cos()
        return [c.real * sine + c.imag * cosine for c in self._turned(t)]

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


# ------------------------------------------------------------------------------------------------
# An offset on top of the platform's motion in ball arithmetic: polynomials of degree up to 5.


class _Polynomial:
    """A piece of an offset over the time from the clock of a state."""

    def __init__(self, piece: OffsetPiece, state: State) -> None:
        """Hermite's polynomial of what is stated at both ends, at the precision in force."""
        self._begun, self._c = arb(0), [arb(piece.start[0])]
        if piece.degree:
            self._begun = (arb(state.ns - piece.begin_ns) + arb(state.sub)) / NS
            self._c = _coefficients(piece, arb(piece.end_ns - piece.begin_ns) / NS)

    def moved(self, t: arb) -> _Polynomial:
        """The same polynomial, with its time counted from t seconds later."""
        later = copy(self)
        later._begun = self._begun + t
        return later

    def jet(self, t: arb) -> list[arb]:
        """Itself and its first four derivatives at a point, or over a piece."""
        x, c, found = self._begun + t, self._c, []
        for _ in range(_ORDERS):
            value = arb(0)
            for coefficient in reversed(c):
                value = value * x + coefficient
            found.append(value)
            c = [k * coefficient for k, coefficient in enumerate(c)][1:]
        return found


def _coefficients(piece: OffsetPiece, lasts: arb) -> list[arb]:
    """Coefficients of a line, cubic or quintic in the time since its begin, of `lasts` s.

    From the stated derivatives at the begin; the upper ones solve those at the end.
    """
    stated = (piece.degree + 1) // 2
    low = [arb(piece.start[k]) / (1, 1, 2)[k] for k in range(stated)]
    rest = [
        (arb(piece.end[n]) - sum((math.perm(k, n) * low[k] * lasts ** (k - n)
                                  for k in range(n, stated)), arb(0))) * lasts**n
        for n in range(stated)
    ]  # fmt: skip
    high = {
        1: lambda r: [r[0]],
        2: lambda r: [3 * r[0] - r[1], r[1] - 2 * r[0]],
        3: lambda r: [
            10 * r[0] - 4 * r[1] + r[2] / 2,
            7 * r[1] - 15 * r[0] - r[2],
            6 * r[0] - 3 * r[1] + r[2] / 2,
        ],
    }[stated](rest)
    return low + [value / lasts ** (stated + i) for i, value in enumerate(high)]


def platform_of(motion: MotionRecord, state: State, tau: arb | None = None) -> Platform:
    """The motion in force from a state on; `tau` in place of the state's forcing phase."""
    if motion.fading:
        return FadingPlatform(motion, state, tau)
    return Platform(motion, state, tau=tau)

"""The platform's motion and certified first roots in 60 digits.

First roots are certified by exclusion: on an interval of half width r about c,
|f(t) − f(c) − f'(c)(t − c)| ≤ M r²/2 with a bound M of |f''|; an interval is passed only if that
proves f > 0, and a root is taken only where f is proved monotone. No step is ever taken in hope.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import mpmath
from mpmath import mp, mpf

from bouncing_disk_ros.core.model import Motion
from reference.cases import NS, Fade

mp.dps = 60
Real = Any  # mpf: mpmath has no types
TINY = mpf(10) ** -45


class GrazeError(Exception):
    """A double root, to the working precision: no sign decides."""


def first_zero(
    f: Callable[[Real], Real], f1: Callable[[Real], Real], bound: Real, start: Real, end: Real
) -> Real | None:
    """First t in (start, end] with f(t) = 0, where f(start) > 0 and |f''| ≤ bound; None if there
    is none."""
    pieces = [(mpf(start), mpf(end))]
    while pieces:
        a, b = pieces.pop()
        c, r = (a + b) / 2, (b - a) / 2
        value, slope = f(c), f1(c)
        if value - abs(slope) * r - bound * r * r / 2 > 0:
            continue
        if abs(slope) > bound * r:
            if f(b) > 0:  # monotone and positive at both ends
                continue
            return _newton(f, f1, a, b)
        if r < TINY * max(abs(c), 1):
            raise GrazeError(f"a double root near {mpmath.nstr(c, 20)}")
        pieces += [(c, b), (a, c)]
    return None


def _newton(f: Callable[[Real], Real], f1: Callable[[Real], Real], a: Real, b: Real) -> Real:
    """The zero of a falling f in [a, b], f(a) > 0 ≥ f(b): Newton steps kept inside a shrinking
    bracket."""
    t = (a + b) / 2
    while True:
        value = f(t)
        a, b = (t, b) if value > 0 else (a, t)
        new = t - value / f1(t)
        if not a < new < b:
            new = (a + b) / 2
        if abs(new - t) <= mpf(10) ** (5 - mp.dps) * abs(t):
            return new
        t = new


class At(NamedTuple):
    """The platform at one instant: s, ṡ, s̈, s⃛ and β, β̇, β̈, β⃛ (third derivatives in steady
    motion alone)."""

    s: Real
    s1: Real
    s2: Real
    s3: Real
    b: Real
    b1: Real
    b2: Real
    b3: Real


class Path:
    """The platform's motion from t = 0, with cross-fades."""

    def __init__(self, motion: Motion, phase: Real, fades: Sequence[Fade] = ()) -> None:
        self._pieces: list[tuple[Real, Real, Real, Motion, Motion]] = []
        now, tau = mpf(0), mpf(phase)
        for fade in fades:
            begin, end = mpf(fade.begin_ns) / NS, mpf(fade.end_ns) / NS
            self._pieces.append((now, mpf(0), tau, motion, motion))
            tau += _omega(motion) * (begin - now)
            self._pieces.append((begin, end - begin, tau, motion, fade.target))
            tau += (_omega(motion) + _omega(fade.target)) / 2 * (end - begin)
            now, motion = end, fade.target
        self._pieces.append((now, mpf(0), tau, motion, motion))
        motions = [piece[3] for piece in self._pieces] + [motion]
        self.omega = max(_omega(m) for m in motions)
        self.reach = max(mpf(m.axial_amplitude) for m in motions)
        self.swing = max(mpf(m.angular_amplitude) for m in motions)

    def axial_forcing(
        self, t: Real
    ) -> tuple[Real, Real, Real, Real, Real, Real, Real, Motion, Motion]:
        """Return τ, ω, ω̇, b, ḃ, b̈ and the rest of the piece in force at t."""
        begin, duration, tau, a, b = next(p for p in reversed(self._pieces) if p[0] <= t)
        elapsed, w, dw = t - begin, _omega(a), _omega(b) - _omega(a)
        if not duration:
            return tau + w * elapsed, w, mpf(0), mpf(0), mpf(0), mpf(0), begin, a, b
        x = elapsed / duration
        blend = x**3 * (10 - 15 * x + 6 * x * x)
        blend1 = 30 * x * x * (1 - x) ** 2 / duration
        blend2 = 60 * x * (1 - x) * (1 - 2 * x) / duration**2
        tau += w * elapsed + dw * duration * x**4 * (mpf(5) / 2 - 3 * x + x * x)
        return tau, w + dw * blend, dw * blend1, blend, blend1, blend2, begin, a, b

    def at(self, t: Real) -> At:
        """The platform at t."""
        tau, w, w1, x, x1, x2, _, a, b = self.axial_forcing(t)
        lag, short = mpf(a.phase_lag), mpf(b.phase_lag) - mpf(a.phase_lag)
        short -= 2 * mp.pi * mpmath.nint(short / (2 * mp.pi))
        axial = _sine(a.axial_amplitude, b.axial_amplitude, x, x1, x2, tau, w, w1)
        turn, rate, rate1 = tau + lag + short * x, w + short * x1, w1 + short * x2
        angular = _sine(a.angular_amplitude, b.angular_amplitude, x, x1, x2, turn, rate, rate1)
        return At(*axial, *angular)


def _omega(motion: Motion) -> Real:
    return 2 * mp.pi * mpf(motion.frequency)


def _sine(
    start: float, end: float, x: Real, x1: Real, x2: Real, tau: Real, w: Real, w1: Real
) -> tuple[Real, Real, Real, Real]:
    """A(t) sin τ(t) and its derivatives."""
    change = mpf(end) - mpf(start)
    a, a1, a2 = mpf(start) + change * x, change * x1, change * x2
    cosine, sine = mpmath.cos_sin(tau)
    return (
        a * sine,
        a1 * sine + a * w * cosine,
        a2 * sine + 2 * a1 * w * cosine + a * (w1 * cosine - w * w * sine),
        -a * w**3 * cosine,
    )

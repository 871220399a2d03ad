"""An offset on top of the platform's motion in ball arithmetic: polynomials of degree up to 5."""

from __future__ import annotations

from flint import arb

from bouncing_disk_ros.proof.exact_records import MotionRecord, OffsetPiece, State
from bouncing_disk_ros.proof.fading_platform import FadingPlatform
from bouncing_disk_ros.proof.interval_platform import Cancelled, Oscillation, Platform
from bouncing_disk_ros.proof.steady_platform import SteadyPlatform
from bouncing_disk_ros.units import NS

_ORDERS = 5


class _Polynomial:
    """A piece of an offset over the time from the clock of a state."""

    def __init__(self, piece: OffsetPiece | None, state: State) -> None:
        """Hermite's polynomial of what is stated at both ends, at the precision in force."""
        self._begun, self._c = arb(0), [arb(0)]
        if piece is None:
            return
        self._c = [arb(piece.start[0])]
        if piece.degree:
            self._begun = (arb(state.ns - piece.begin_ns) + arb(state.sub)) / NS
            self._c = _coefficients(piece, arb(piece.end_ns - piece.begin_ns) / NS)

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
        (arb(piece.end[n]) - sum((_falling(k, n) * low[k] * lasts ** (k - n)
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


def _falling(k: int, n: int) -> int:
    """The factor that n derivatives give to a power k."""
    product = 1
    for factor in range(k - n + 1, k + 1):
        product *= factor
    return product


class OffsetPlatform(Platform):
    """A steady motion or a cross-fade, and the offsets of both joints."""

    def __init__(self, base: Platform, motion: MotionRecord, state: State) -> None:
        """At the precision in force."""
        super().__init__()
        self._base = base
        self._axial, self._angular = (
            _Polynomial(piece, state) for piece in (motion.axial, motion.angular)
        )
        self.roundings = base.roundings
        self.clock = base.clock if motion.repeats else 1e-9

    def phase(self, t: arb) -> arb:
        """Forcing phase without whole turns taken off, rad."""
        return self._base.phase(t)

    def rate(self, t: arb) -> arb:
        """Angular frequency ω, rad/s."""
        return self._base.rate(t)

    def cancelled(self, t: float) -> Cancelled:
        """What cancels in the sums v + Δv·b over the first t seconds."""
        return self._base.cancelled(t)

    def mix(self, axial: arb, angular: arb) -> Oscillation:
        """The oscillation axial·s + angular·β."""
        parts = ((axial, self._axial), (angular, self._angular))
        return _Moved(self._base.mix(axial, angular), parts)


class _Moved:
    """K = axial·s + angular·β with the offsets of s and β."""

    def __init__(
        self, base: Oscillation, parts: tuple[tuple[arb, _Polynomial], tuple[arb, _Polynomial]]
    ) -> None:
        self._base, self._parts = base, parts

    def jet(self, t: arb) -> list[arb]:
        """K and its first four derivatives at a point, or over a piece."""
        found = self._base.jet(t)
        for factor, polynomial in self._parts:
            added = polynomial.jet(t)
            found = [value + factor * more for value, more in zip(found, added, strict=True)]
        return found

    def envelope(self, t: arb) -> list[arb]:
        """Bounds of the absolute values of K and its first four derivatives over a piece."""
        found = self._base.envelope(t)
        for factor, polynomial in self._parts:
            added = [abs(factor * more).upper() for more in polynomial.jet(t)]
            found = [value + more for value, more in zip(found, added, strict=True)]
        return found


def platform_of(motion: MotionRecord, state: State) -> Platform:
    """The motion in force from a state on."""
    base = FadingPlatform(motion, state) if motion.fading else SteadyPlatform(motion, state)
    if motion.axial is None and motion.angular is None:
        return base
    return OffsetPlatform(base, motion, state)

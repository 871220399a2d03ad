"""The gap between disk and platform in ball arithmetic, and what rounding makes of it.

With sₜ the platform's position t seconds on, gap(t) = gap + u t − g t²/2 − (sₜ − s₀ − ṡ₀t). The
numbers of a flight are float64: each may be off by half a unit in the last place, ½ulp ≤ 2⁻⁵³ of
itself (the forcing phase: of 2π), and so may each sum that the core makes of them. The gap at t is
known to ROUNDINGS·2⁻⁵³·S, where S sums what each number contributes: |gap| + |u|t + g t²/2 +
(1 + 2π)·A·min(x²/2, 2 + x) + A·x·min(x, 2), x = ωt (of A and τ; of ω).
"""

from __future__ import annotations

import math

from flint import arb

from bouncing_disk_ros.proof.platform import SteadyPlatform
from bouncing_disk_ros.proof.positivity import End
from bouncing_disk_ros.proof.records import State

ROUNDINGS = 16.0
HALF_ULP = 2.0**-53


class Gap:
    """The gap of a flight as a function of the time since its beginning."""

    def __init__(self, platform: SteadyPlatform, state: State, g: float) -> None:
        """At the precision in force."""
        self.platform = platform
        self.gap, self.u, self.g = arb(state.gap), arb(state.u), arb(g)
        self.s0, self.s1 = platform.axial(arb(0))[:2]
        self.scale = RoundingScale(platform, state, g)

    def derivatives(self, t: arb) -> tuple[arb, arb, arb, arb]:
        """Gap and its first three derivatives."""
        s = self.platform.axial(t)
        fall = self.g * t
        value = self.gap + (self.u - fall / 2) * t - (s[0] - self.s0 - self.s1 * t)
        return value, self.u - fall - (s[1] - self.s1), -self.g - s[2], -s[3]

    def at(self, t: arb) -> End:
        """Gap and its velocity."""
        return self.derivatives(t)[:2]

    def curvature(self, piece: arb) -> arb:
        """Second derivative of the gap over a piece."""
        return -self.g - self.platform.axial(piece)[2]

    def height(self, t: arb) -> arb:
        """Height x of the disk, in the frame of s."""
        return self.s0 + self.gap + (self.s1 + self.u - self.g * t / 2) * t

    def surely_positive(self, a: arb, b: arb) -> bool:
        """Whether the disk is above everything the platform reaches over [a, b]."""
        top = self.platform.highest(a.union(b))
        return bool(self.height(a) > top) and bool(self.height(b) > top)

    def tolerance(self, t: float) -> float:
        """What rounding makes of the gap at t, m."""
        return ROUNDINGS * HALF_ULP * self.scale.position(t)

    def clear_of_platform(self) -> tuple[float, ...]:
        """About when the disk is above everything the platform reaches: between these two."""
        top = float(self.platform.highest(arb(0)))
        x, v, g = float(self.height(arb(0))), float(self.s1 + self.u), float(self.g)
        square = v * v + 2.0 * g * (x - top)
        if not 0.0 < square < math.inf:
            return ()
        root = math.sqrt(square)
        return tuple(
            t + part * root / g
            for t, part in (((v - root) / g, 1e-9), ((v + root) / g, -1e-9))
            if t > 0.0
        )


class RoundingScale:
    """S of the gap and of its velocity: what half a unit in the last place is counted of."""

    def __init__(self, platform: SteadyPlatform, state: State, g: float) -> None:
        self.gap, self.u, self.g = abs(state.gap), abs(state.u), g
        self.a, self.w = float(platform.amplitude), float(platform.rate)

    def position(self, t: float) -> float:
        """Of the gap, m."""
        x = self.w * t
        swing = self.a * ((1.0 + 2.0 * math.pi) * min(x * x / 2.0, 2.0 + x) + x * min(x, 2.0))
        return self.gap + self.u * t + self.g * t * t / 2.0 + swing

    def velocity(self, t: float) -> float:
        """Of its velocity, m/s."""
        x = self.w * t
        swing = self.a * self.w * ((1.0 + 2.0 * math.pi) * min(x, 2.0) + x)
        return self.u + self.g * t + swing

    def acceleration(self) -> float:
        """Of its acceleration, m/s²."""
        return self.g + self.a * self.w * self.w * (2.0 + 2.0 * math.pi)

    def instant(self, t: float) -> float:
        """Of a time that is kept as a forcing phase, s."""
        return t + 2.0 * math.pi / self.w

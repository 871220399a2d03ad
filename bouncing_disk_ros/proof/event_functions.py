"""The functions of time whose first zeros are the events, in ball arithmetic.

Each is a polynomial of at most the second degree plus a derivative of an oscillation of the
platform: the gap, the load a = g + s̈, the margin grip·a − sign·ρ of a disk that sticks, and the
slip sign·w_T of one that slides; ρ = β̈ + lag.

What rounding makes of them: their numbers are float64, each may be off by half a unit in the last
place, 2⁻⁵³ of itself (the forcing phase: of 2π), and so may each sum that the core makes of them. A
value is known to ROUNDINGS·2⁻⁵³·S, where S sums what each number contributes. Of the gap after t
seconds, x = ωt: |gap| + |u|t + g t²/2 + (1 + 2π)·min(2A + Aωt, Aω²t²/2) + min(2Ax, Aω²t²). In a
cross-fade these are the greatest A, Aω, Aω² on the way, times four, for each blend has roundings
too; and there the clock of a state is kept in nanoseconds, whole ones and a float64 below 1, which
moves every function by its slope times 1 ns.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from flint import arb

from bouncing_disk_ros.proof.exact_records import DiskRecord, State
from bouncing_disk_ros.proof.platforms import Oscillation, Platform, interval

ROUNDINGS = 8.0
HALF_ULP = 2.0**-53
_OF_PHASE = 1.0 + 2.0 * math.pi


Rounding = Callable[[int, float], float]
"""S of a derivative (0: the value) at a time."""


def unrounded(_derivative: int, _t: float) -> float:
    """S of a function whose numbers are balls that hold them."""
    return 0.0


class Watched:
    """c₀ + c₁t + c₂t² + factor·K⁽ⁿ⁾(t), c₂ ≤ 0."""

    def __init__(
        self,
        polynomial: tuple[arb, arb, arb],
        oscillation: tuple[Oscillation, int, arb],
        rounding: Rounding,
        known: tuple[arb, ...] = (),
    ) -> None:
        """`oscillation`: K, n and the factor; `known`: first derivatives at t = 0, exactly."""
        self._c0, self._c1, self._c2 = polynomial
        self._oscillation, self._order, self._factor = oscillation
        self._rounding, self._known = rounding, known

    def jet(self, t: arb) -> list[arb]:
        """The value and its first derivatives, two at least, at a point or over a piece."""
        jet = [self._factor * z for z in self._oscillation.jet(t)[self._order :]]
        jet[0] += self._polynomial(t)
        jet[1] += self._c1 + 2 * self._c2 * t
        jet[2] += 2 * self._c2
        return jet

    def over(self, a: float, b: float) -> tuple[arb, arb, arb]:
        """The value from below, and the first two derivatives, over [a, b]."""
        whole = interval(a, b)
        k0, k1, k2 = self._oscillation.jet(whole)[self._order :][:3]
        lowest = self._polynomial(arb(a)).min(self._polynomial(arb(b)))
        value = lowest + self._factor * k0
        slope = self._c1 + 2 * self._c2 * whole + self._factor * k1
        return value, slope, 2 * self._c2 + self._factor * k2

    def start(self) -> list[arb]:
        """The value and its derivatives at t = 0, exact where they are numbers of the state."""
        return [*self._known, *self.jet(arb(0))[len(self._known) :]]

    def _polynomial(self, t: arb) -> arb:
        return self._c0 + (self._c1 + self._c2 * t) * t

    def tolerance(self, t: float, derivative: int = 0) -> float:
        """What the rounding of the inputs makes of the value (or a derivative) at t."""
        return ROUNDINGS * HALF_ULP * self._rounding(derivative, t)

    def floor_zeros(self) -> tuple[float, ...]:
        """About where the bound from below is zero, for the motion at the beginning."""
        bound = float((abs(self._factor) * self._oscillation.envelope(arb(0))[self._order]).upper())
        c0, c1, c2 = float(self._c0) - bound, float(self._c1), float(self._c2)
        if c2 == 0.0:
            zeros: tuple[float, ...] = (-c0 / c1,) if c1 != 0.0 else ()
        else:
            square = c1 * c1 - 4.0 * c2 * c0
            root = math.sqrt(square) if 0.0 <= square < math.inf else math.nan
            zeros = tuple((-c1 + sign * root) / (2.0 * c2) for sign in (1.0, -1.0))
        width = abs(zeros[-1] - zeros[0]) if len(zeros) > 1 else 0.0
        inside = (1e-9 * width, -1e-9 * width)
        return tuple(t + into for t, into in zip(zeros, inside, strict=False) if t + into > 0.0)


def gap_from(
    platform: Platform, gap: arb, u: arb, g: arb, rounding: Rounding = unrounded,
    known: tuple[arb, ...] = (),
) -> Watched:  # fmt: skip
    """The gap, gap + u t − g t²/2 − (s(t) − s(0) − ṡ(0)t)."""
    axial = platform.mix(arb(1), arb(0))
    s0, s1 = axial.jet(arb(0))[:2]
    return Watched((gap + s0, u + s1, -g / 2), (axial, 0, arb(-1)), rounding, known or (gap, u))


def load_from(platform: Platform, g: arb, rounding: Rounding = unrounded) -> Watched:
    """The load over the mass, a = g + s̈."""
    return Watched((g, arb(0), arb(0)), (platform.mix(arb(1), arb(0)), 2, arb(1)), rounding)


def margin_from(
    platform: Platform, grip: arb, g: arb, lag: arb, sign: float, rounding: Rounding = unrounded
) -> Watched:
    """What friction can supply less what sticking needs: grip·a − sign·ρ."""
    still = grip * g - arb(sign) * lag
    return Watched((still, arb(0), arb(0)), (platform.mix(grip, arb(-sign)), 2, arb(1)), rounding)


def slip_from(
    platform: Platform, omega: arb, side: arb, grip: arb, g: arb, lag: arb,
    rounding: Rounding = unrounded, known: tuple[arb, ...] = (),
) -> Watched:  # fmt: skip
    """The slip side·w_T of a disk that slides from α̇ = omega on: α̈ = −side·grip·a − lag."""
    mix = platform.mix(grip, side)
    slip = side * (omega - platform.mix(arb(0), arb(1)).jet(arb(0))[1])
    rates = (slip + mix.jet(arb(0))[1], -(grip * g + side * lag), arb(0))
    return Watched(rates, (mix, 1, arb(-1)), rounding, known or (slip,))


def gap_of(platform: Platform, state: State, disk: DiskRecord) -> Watched:
    """The gap of a state in flight, with its rounding."""
    gap, u, g = abs(state.gap), abs(state.u), disk.g

    def rounding(derivative: int, t: float) -> float:
        (r0, r1, r2, r3, r4), _, x = platform.reach(t)
        if derivative == 0:
            swing = _OF_PHASE * min(2.0 * r0 + r1 * t, r2 * t * t / 2.0)
            swing += min(2.0 * r0 * x, r2 * t * t) + platform.clock * min(
                2.0 * r1, r3 * t * t / 2.0
            )
            return gap + u * t + g * t * t / 2.0 + swing
        if derivative == 1:
            swing = _OF_PHASE * min(2.0 * r1, r2 * t) + min(r1 * x, 2.0 * r2 * t)
            return u + g * t + swing + platform.clock * min(2.0 * r2, r3 * t)
        still, swing, next_one = (g, r2, r3) if derivative == 2 else (0.0, r3, r4)
        return still + (_OF_PHASE + 1.0 + x) * swing + platform.clock * next_one

    return gap_from(platform, arb(state.gap), arb(state.u), arb(disk.g), rounding)


def load_of(platform: Platform, disk: DiskRecord) -> Watched:
    """The load over the mass in contact, with its rounding."""

    def rounding(derivative: int, t: float) -> float:
        reach = platform.reach(t)
        swing, next_one = [*reach.axial, 0.0][2 + derivative : 4 + derivative]
        still = disk.g if derivative == 0 else 0.0
        return still + swing * (_OF_PHASE + 1.0 + reach.turn) + platform.clock * next_one

    return load_from(platform, arb(disk.g), rounding)


def margin_of(platform: Platform, disk: DiskRecord, sign: float) -> Watched:
    """The margin of a disk that sticks, with its rounding."""

    def rounding(derivative: int, t: float) -> float:
        reach = platform.reach(t)
        both = zip([*reach.axial, 0.0], [*reach.angular, 0.0], strict=True)
        swings = [disk.grip * axial + angular for axial, angular in both]
        swing, next_one = swings[2 + derivative : 4 + derivative]
        still = disk.grip * disk.g + abs(disk.lag) if derivative == 0 else 0.0
        return still + swing * (_OF_PHASE + 1.0 + reach.turn) + platform.clock * next_one

    numbers = arb(disk.grip), arb(disk.g), arb(disk.lag)
    return margin_from(platform, *numbers, sign, rounding)


def slip_of(platform: Platform, state: State, disk: DiskRecord, inherited: float = 0.0) -> Watched:
    """The slip of a state that slides, with its rounding.

    `inherited`: the angular velocity α̇ before the slide that led to this state, rad/s.
    """
    scale = abs(state.omega) + inherited

    def rounding(derivative: int, t: float) -> float:
        axial, angular, turn = platform.reach(t)
        part = _OF_PHASE + 1.0 + turn
        pull = disk.grip * disk.g + abs(disk.lag)
        drive = disk.grip * axial[2] + angular[2]
        if derivative == 0:
            swing = disk.grip * min(2.0 * axial[1], axial[2] * t) + angular[1]
            return scale + pull * t + swing * part + platform.clock * (pull + drive)
        change = disk.grip * axial[3] + angular[3]
        if derivative == 1:
            return pull + drive * part + platform.clock * change
        return change * part + platform.clock * (disk.grip * axial[4] + angular[4])

    numbers = arb(disk.grip), arb(disk.g), arb(disk.lag)
    return slip_from(platform, arb(state.omega), arb(state.slip_sign), *numbers, rounding)

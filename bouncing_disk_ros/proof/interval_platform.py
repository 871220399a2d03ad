"""Platform motion in ball arithmetic: one forcing phase, and what oscillates with it.

Time is counted in seconds from the clock of a state, whose forcing phase the motion starts from.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import NamedTuple, Protocol

from flint import arb

from bouncing_disk_ros.proof.exact_records import State
from bouncing_disk_ros.units import NS

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


class Oscillation(Protocol):
    """K = k_s·s + k_b·β = Im(Z e^{iτ}), Z = k_s A + k_b Φ e^{iθ}, as a function of time."""

    def jet(self, t: arb) -> list[arb]:
        """K and its first four derivatives at a point, or over a piece."""
        ...

    def envelope(self, t: arb) -> list[arb]:
        """Bounds of the absolute values of K and its first four derivatives over a piece."""
        ...


class Reach(NamedTuple):
    """The greatest values over the first seconds, as floats, times what a fade adds to roundings.

    Of s, β and their first four derivatives; and by how much the forcing phase grows at most, rad.
    """

    axial: list[float]
    angular: list[float]
    turn: float


class Platform(ABC):
    """The motion of the platform from the clock of a state on."""

    roundings = 1.0
    """How many more roundings s and β have than those of a steady motion."""
    clock = 0.0
    """Resolution of the instant of the state, s; 0: the forcing phase is what is known."""

    def __init__(self) -> None:
        self._reached: dict[float, Reach] = {}

    @abstractmethod
    def phase(self, t: arb) -> arb:
        """Forcing phase without whole turns taken off, rad."""

    @abstractmethod
    def rate(self, t: arb) -> arb:
        """Angular frequency ω, rad/s."""

    @abstractmethod
    def mix(self, axial: arb, angular: arb) -> Oscillation:
        """The oscillation axial·s + angular·β."""

    @abstractmethod
    def cancelled(self, t: float) -> Cancelled:
        """What cancels in the sums v + Δv·b over the first t seconds."""

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

"""Verdicts on a closed loop: captured, lost or never, from the impacts of a run."""

from __future__ import annotations

import math
from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple

from bouncing_disk_ros.juggling.loop_settings import Array


class Outcome(IntEnum):
    """How a run ended."""

    NEVER = 0
    CAPTURED = 1
    LOST = 2  # it was near the orbit for as long as counts, but not at the end


class Verdict(NamedTuple):
    """Outcome; impacts until the orbit was reached for good, or all of them."""

    outcome: Outcome
    impacts: int


class Watch:
    """Follows the impacts of a run: whether it is on the orbit now, and was before.

    Attribute `orbit`: may be set to the orbit as a controller has corrected it. Impacts before are
    not judged again: with the true orbit throughout `verdict` may count an impact more or less.
    """

    def __init__(self, orbit: Array, tolerance: float = 0.05, streak: int = 5) -> None:
        self.orbit, self._tolerance, self._streak = orbit, tolerance, streak
        self._near = self._count = self._reached = 0
        self._had = self._rests = False
        self._off = (math.inf, math.inf)  # of the last impact: phase in rad, velocity in πg/ω

    def note(self, phase: float, velocity: float, *, rests: bool) -> None:
        """An impact: forcing phase, velocity after it in πg/ω, whether the disk rests then."""
        self._count += 1
        apart = [
            (abs(math.remainder(phase - tau, math.tau)), abs(velocity - v)) for tau, v in self.orbit
        ]
        self._off, self._rests = min(apart, key=max), rests
        on = not rests and all(part <= self._tolerance for part in self._off)
        self._near = self._near + 1 if on else 0
        if self._near == 1:
            self._reached = self._count
        self._had = self._had or self._near >= self._streak

    @property
    def verdict(self) -> Verdict:
        """As if the run ended now."""
        if self._near >= self._streak:
            return Verdict(Outcome.CAPTURED, self._reached)
        return Verdict(Outcome.LOST if self._had else Outcome.NEVER, self._count)

    @property
    def text(self) -> str:
        """The same in words, which change only with the outcome."""
        outcome, impacts = self.verdict
        if outcome is Outcome.CAPTURED:
            return f"captured after {impacts} impact{'s' if impacts != 1 else ''}"
        return "lost" if outcome is Outcome.LOST else "not captured"

    @property
    def reason(self) -> str:
        """What is missing from a capture, in words with numbers of the last impact."""
        if self._near >= self._streak:
            return ""
        if not self._count:
            return "no impact was heard yet"
        if self._rests:
            return "the disk rests on the platform"
        if self._near:
            return f"near the orbit for {self._near} of {self._streak} impacts"
        phase, velocity = self._off
        return f"the last impact is {phase:.2f} rad and {velocity:.2f} πg/ω from the orbit"


def verdict_of(
    impacts: Iterable[tuple[float, float, bool]], orbit: Array, *, tolerance: float = 0.05,
    streak: int = 5,
) -> Verdict:  # fmt: skip
    """The verdict on impacts (forcing phase, velocity after in πg/ω, whether the disk rests).

    Captured: near the orbit from some impact on to the end, at least `streak` of them.
    """
    watch = Watch(orbit, tolerance, streak)
    for phase, velocity, rests in impacts:
        watch.note(phase, velocity, rests=rests)
    return watch.verdict

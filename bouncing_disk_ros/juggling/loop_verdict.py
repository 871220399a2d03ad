"""Verdicts on a closed loop: captured, lost or never, from the impacts of a run."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from bouncing_disk_ros.juggling.kernels import verdicts
from bouncing_disk_ros.juggling.loop_settings import Array


class Outcome(IntEnum):
    """How a run ended."""

    NEVER = verdicts.NEVER
    CAPTURED = verdicts.CAPTURED
    LOST = verdicts.LOST  # it was near the orbit for as long as counts, but not at the end


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
        self._tally, self._rests = np.zeros(verdicts.TALLY), False

    def note(self, phase: float, velocity: float, *, rests: bool) -> None:
        """An impact: forcing phase, velocity after it in πg/ω, whether the disk rests then."""
        self._rests = rests
        verdicts.note_impact(
            self._tally, self.orbit, phase, velocity, rests, self._tolerance, self._streak
        )

    @property
    def verdict(self) -> Verdict:
        """As if the run ended now."""
        outcome = Outcome(int(self._tally[verdicts.VERDICT]))
        which = verdicts.REACHED if outcome is Outcome.CAPTURED else verdicts.COUNT
        return Verdict(outcome, int(self._tally[which]))

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
        outcome, count = self.verdict
        if outcome is Outcome.CAPTURED:
            return ""
        if not count:
            return "no impact was heard yet"
        if self._rests:
            return "the disk rests on the platform"
        near = int(self._tally[verdicts.NEAR])
        if near:
            return f"near the orbit for {near} of {self._streak} impacts"
        phase, velocity = self._tally[[verdicts.OFF_PHASE, verdicts.OFF_VELOCITY]]
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

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


def verdict_of(
    impacts: Iterable[tuple[float, float, bool]], orbit: Array, *, tolerance: float = 0.05,
    streak: int = 5,
) -> Verdict:  # fmt: skip
    """The verdict on impacts (forcing phase, velocity after in πg/ω, whether the disk rests).

    Captured: near the orbit from some impact on to the end, at least `streak` of them.
    """
    near = count = reached = 0
    had = False
    for count, (phase, velocity, rests) in enumerate(impacts, start=1):
        on = not rests and any(
            abs(math.remainder(phase - tau, math.tau)) <= tolerance
            and abs(velocity - v) <= tolerance
            for tau, v in orbit
        )
        near = near + 1 if on else 0
        if near == 1:
            reached = count
        had = had or near >= streak
    if near >= streak:
        return Verdict(Outcome.CAPTURED, reached)
    return Verdict(Outcome.LOST if had else Outcome.NEVER, count)

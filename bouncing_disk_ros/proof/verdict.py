"""What a proof has found: proved, refuted or undecided, and why."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from flint import arb


class Outcome(StrEnum):
    """PROVED; REFUTED by a rigorous counterexample; UNDECIDED within the rounding of the inputs.

    NOT_COVERED: the proof has no rules for such an event.
    """

    PROVED = "proved"
    UNDECIDED = "undecided"
    REFUTED = "refuted"
    NOT_COVERED = "not covered"


class Verdict(NamedTuple):
    """The outcome of one event.

    `tolerance` is what the rounding of the event's float64 numbers makes of the watched quantity,
    in its own unit; `pieces` is how many intervals the proof took.
    """

    outcome: Outcome
    reason: str = ""
    tolerance: float = 0.0
    pieces: int = 0


def compared(off: arb, allowed: arb | float, what: str) -> Verdict:
    """Whether a difference |off| is surely within what is allowed, or surely not."""
    slack = float(allowed)
    if abs(off) <= allowed:
        return Verdict(Outcome.PROVED, "", slack)
    reason = f"{what} is {float(off):.6g} off: more than {slack:.3g}"
    refuted = bool(abs(off) > allowed)
    return Verdict(Outcome.REFUTED if refuted else Outcome.UNDECIDED, reason, slack)


def worst(verdicts: list[Verdict]) -> Verdict:
    """One verdict of several parts: the first that is refuted, else undecided, else proved."""
    order = (Outcome.REFUTED, Outcome.UNDECIDED, Outcome.NOT_COVERED, Outcome.PROVED)
    first = min(verdicts, key=lambda verdict: order.index(verdict.outcome))
    return first._replace(pieces=sum(verdict.pieces for verdict in verdicts))

"""What a proof has found: proved, refuted or undecided, and why; counts of it by kind of event."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from enum import StrEnum
from typing import NamedTuple

from flint import arb

from bouncing_disk_ros.proof.exact_records import Event, Kind


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


_SHOWN = 10


class ProofCount:
    """Counts of verdicts; the first events that are refuted or undecided are kept."""

    def __init__(self) -> None:
        self.counts: Counter[tuple[Kind, Outcome]] = Counter()
        self.not_covered: Counter[tuple[str, Kind]] = Counter()  # by reason
        self.left_out = 0
        self.kept: dict[Outcome, list[tuple[Event, Verdict]]] = {
            Outcome.REFUTED: [],
            Outcome.UNDECIDED: [],
        }

    def take(self, event: Event, verdict: Verdict) -> None:
        """Count one verdict."""
        self.counts[event.kind, verdict.outcome] += 1
        if verdict.outcome is Outcome.NOT_COVERED:
            self.not_covered[verdict.reason, event.kind] += 1
        kept = self.kept.get(verdict.outcome)
        if kept is not None and len(kept) < _SHOWN:
            kept.append((event, verdict))

    def leave_out(self) -> None:
        """Count an event that was not looked at."""
        self.left_out += 1

    def total(self, outcome: Outcome) -> int:
        """How many events have this outcome."""
        return sum(n for (_, found), n in self.counts.items() if found is outcome)

    def lines(self) -> Iterator[str]:
        """A table by kind, then the events that were not proved."""
        yield f"{'event':<26}" + "".join(f"{outcome.value:>12}" for outcome in Outcome)
        for kind in Kind:
            row = [self.counts[kind, outcome] for outcome in Outcome]
            if any(row):
                yield f"{kind.value:<26}" + "".join(f"{n:>12}" for n in row)
        yield f"{'all':<26}" + "".join(f"{self.total(outcome):>12}" for outcome in Outcome)
        for outcome, kept in self.kept.items():
            for event, verdict in kept:
                yield f"{outcome.value}: {described(event, verdict)}"
            more = self.total(outcome) - len(kept)
            if more:
                yield f"{outcome.value}: {more} more"
        if self.not_covered:
            shown = (f"{n} × {kind.value} ({why})" for (why, kind), n in self.not_covered.items())
            yield f"{Outcome.NOT_COVERED.value}: {', '.join(shown)}"


def described(event: Event, verdict: Verdict) -> str:
    """One line: when the stretch before the event began, what it is, why it is not proved."""
    when = event.before.ns * 1e-9
    reason = f"{verdict.reason} (tolerance {verdict.tolerance:.3g})"
    return f"{event.kind.value}, from t = {when:.9f} s for {event.delay!r} s: {reason}"

"""Prove one event of a trace."""

from __future__ import annotations

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.proof.flight import prove_flight
from bouncing_disk_ros.proof.records import Event
from bouncing_disk_ros.proof.verdict import Outcome, Verdict


def prove(event: Event) -> Verdict:
    """Prove or refute that nothing comes before this event, and that it is one."""
    if event.before.phase is Phase.FLIGHT and not event.motion.fading:
        return prove_flight(event)
    return Verdict(Outcome.UNDECIDED, "not proved yet")

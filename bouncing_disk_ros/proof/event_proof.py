"""Prove one event of a trace."""

from __future__ import annotations

import math

from flint import ctx

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.proof.chatter_proof import prove_chatter, prove_still
from bouncing_disk_ros.proof.clock_proof import end_of
from bouncing_disk_ros.proof.contact_proof import prove_contact
from bouncing_disk_ros.proof.exact_records import Event, Kind
from bouncing_disk_ros.proof.flight_proof import prove_flight
from bouncing_disk_ros.proof.verdict import Outcome, Verdict
from bouncing_disk_ros.units import NS

_LEAST_PRECISION = 128


def precision_for(event: Event) -> int:
    """Bits that keep the digits of a tiny bounce and of a phase of many turns."""
    m, d = event.motion, end_of(event)
    parts = [2.0 * math.pi * max(m.f, m.f + m.df) * d]
    if m.fading:
        parts.append(d * NS / (m.end_ns - m.begin_ns))
    lost = [abs(math.log2(part)) for part in parts if 0.0 < part < math.inf]
    return _LEAST_PRECISION + 2 * math.ceil(max(lost, default=0.0))


def _is_finite(event: Event) -> bool:
    """Whether the event is made of numbers."""
    states = [*event.before, *(event.after or ())]
    return all(math.isfinite(number) for number in (*states, event.delay, event.value))


def prove(event: Event) -> Verdict:
    """Prove or refute that nothing comes before this event, and that it is one."""
    if not _is_finite(event):
        return Verdict(Outcome.REFUTED, f"{event.kind} with a number that is not finite")
    with ctx.workprec(precision_for(event)):
        if event.before.phase is Phase.FLIGHT and event.kind in (Kind.IMPACT, Kind.PROPAGATED):
            return prove_flight(event)
        if event.disk.brake > 0.0 and event.kind is not Kind.STILL:
            where = "a chatter" if event.kind is Kind.CHATTER else "contact"
            return Verdict(Outcome.NOT_COVERED, f"{where} under a brake")
        if event.before.phase is not Phase.FLIGHT:
            return prove_contact(event)
        if event.kind is Kind.STILL:
            return prove_still(event)
        if event.kind is Kind.CHATTER:
            return prove_chatter(event)
        return Verdict(Outcome.REFUTED, f"{event.kind} cannot end a flight")

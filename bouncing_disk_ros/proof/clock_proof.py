"""Proof that the clock of an event, its instant and its forcing phase, is that of its delay."""

from __future__ import annotations

from flint import arb

from bouncing_disk_ros.proof.event_functions import HALF_ULP, ROUNDINGS
from bouncing_disk_ros.proof.exact_records import Event, Kind
from bouncing_disk_ros.proof.interval_platform import Platform, interval, seconds
from bouncing_disk_ros.proof.verdict import Outcome, Verdict, compared, worst
from bouncing_disk_ros.units import NS


def end_of(event: Event) -> float:
    """Seconds from the clock of the state before to the event, or to where none has come."""
    if event.kind is not Kind.PROPAGATED:
        return event.delay
    if event.after is not None:
        return float(seconds(event.before, event.after.ns, event.after.sub))
    assert event.boundary_ns is not None
    return float(seconds(event.before, event.boundary_ns))


def prove_clock(event: Event, platform: Platform) -> Verdict:
    """The state after the event carries the instant and the phase of its delay, to rounding.

    Phases are float64 below 2π, instants whole nanoseconds and a float64 below 1.
    """
    state, after = event.before, event.after
    if after is None:
        return Verdict(Outcome.PROVED)
    delay = arb(end_of(event))
    rate = platform.rate(interval(0.0, end_of(event))).upper()
    lasted = seconds(state, after.ns, after.sub)
    turn = arb.pi() * 2
    grown = turn * (after.cycles - state.cycles) + (arb(after.tau) - arb(state.tau))
    rounding = ROUNDINGS * HALF_ULP * (turn + rate * (delay + arb(1) / NS))
    instant = compared((lasted - delay) * rate, rounding, "the instant (rad after the delay)")
    off = grown - (platform.phase(delay) - arb(state.tau))
    return worst([instant, compared(off, rounding, "the forcing phase")])

"""Proof of a flight: no impact before the one that is reported, and one there."""

from __future__ import annotations

import math

from flint import arb

from bouncing_disk_ros.proof.clock_proof import end_of, prove_clock
from bouncing_disk_ros.proof.event_functions import HALF_ULP, ROUNDINGS, Watched, gap_of
from bouncing_disk_ros.proof.exact_records import Event, Kind
from bouncing_disk_ros.proof.offset_platform import platform_of
from bouncing_disk_ros.proof.positivity import Finding, Sign, positive_from_start
from bouncing_disk_ros.proof.verdict import Outcome, Verdict, compared, worst


def prove_flight(event: Event) -> Verdict:
    """Prove a flight up to its impact, or up to an instant that it reaches without one."""
    state = event.before
    if event.kind is Kind.IMPACT and not (
        0.0 <= event.delay < math.inf and -math.inf < event.value < 0.0
    ):
        reason = f"an impact after {event.delay!r} s with w_A = {event.value!r} m/s"
        return Verdict(Outcome.REFUTED, reason)
    platform = platform_of(event.motion, state)
    gap = gap_of(platform, state, event.disk)
    clock = prove_clock(event, platform)
    if event.kind is Kind.IMPACT:
        return worst([_prove_impact(gap, event), clock])
    end = end_of(event)
    free = _free_until(gap, event, end * (1.0 - 4.0 * HALF_ULP))
    return worst([verdict_of(free, gap, end, "gap"), _prove_propagated(gap, event, end), clock])


def _free_until(gap: Watched, event: Event, end: float) -> Finding:
    """Whether the gap is positive from the launch until `end`."""
    motion = event.motion
    rate = 2.0 * math.pi * max(motion.f, motion.f + motion.df)
    return positive_from_start(gap, end, rate)


def _prove_impact(gap: Watched, event: Event) -> Verdict:
    d, w = event.delay, event.value
    if d == 0.0:
        at_once = event.before.gap == 0.0 and event.before.u == w
        return Verdict(Outcome.PROVED if at_once else Outcome.REFUTED, "an impact at once")
    margin = time_margin(gap, d, w)
    verdict = verdict_of(_free_until(gap, event, d - margin), gap, d, "gap")
    if verdict.outcome is not Outcome.PROVED:
        return verdict
    crossing = prove_crossing(gap, d + margin, "gap")
    if crossing.outcome is not Outcome.PROVED:
        return crossing._replace(pieces=verdict.pieces)
    _, slope, curvature = gap.jet(arb(d))[:3]
    allowed = gap.tolerance(d, 1) + margin * float(abs(curvature).upper())
    return worst([verdict, compared(slope - arb(w), allowed, f"w_A = {w!r} m/s")])


def time_margin(watched: Watched, d: float, slope: float) -> float:
    """What rounding makes of the time of a zero where the value falls with this slope, s."""
    root = watched.tolerance(d) / abs(slope) if slope < 0.0 else math.inf
    return min(root + ROUNDINGS * HALF_ULP * d, d)


def prove_crossing(watched: Watched, after: float, name: str) -> Verdict:
    """The value is below zero just after its zero."""
    value = watched.jet(arb(after))[0]
    slack = watched.tolerance(after)
    if value < 0:
        return Verdict(Outcome.PROVED, "", slack)
    refuted = bool(value > slack)
    reason = f"the {name} is {float(value):.3g} at {after!r} s, just after its zero"
    return Verdict(Outcome.REFUTED if refuted else Outcome.UNDECIDED, reason, slack)


def _prove_propagated(gap: Watched, event: Event, end: float) -> Verdict:
    """Gap and velocity of the state at the end are those of the flight, to rounding."""
    after = event.after
    if after is None:
        return Verdict(Outcome.PROVED)
    value, slope = gap.jet(arb(end))[:2]
    position = compared(value - arb(after.gap), gap.tolerance(end), "the gap at the end")
    velocity = compared(slope - arb(after.u), gap.tolerance(end, 1), "its velocity at the end")
    return worst([position, velocity])


def verdict_of(finding: Finding, watched: Watched, d: float, name: str) -> Verdict:
    """What a finding on [0, d] says of the event at d."""
    slack, pieces = watched.tolerance(d), finding.pieces
    if finding.sign is Sign.POSITIVE:
        return Verdict(Outcome.PROVED, "", slack, pieces)
    if finding.sign is Sign.NEGATIVE:
        reason = f"the {name} is {finding.value:.6g} at {finding.at!r} s, before {d!r} s"
        return Verdict(Outcome.REFUTED, reason, slack, pieces)
    if finding.sign is Sign.WITHIN_ROUNDING:
        reason = f"a graze at {finding.at!r} s: the {name} touches zero within its rounding"
    else:
        reason = f"the {name} is not decided in {pieces} pieces, at {finding.at!r} s"
    return Verdict(Outcome.UNDECIDED, reason, slack, pieces)

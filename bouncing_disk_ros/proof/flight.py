"""Proof of a flight: no impact before the one that is reported, and one there."""

from __future__ import annotations

import math

from flint import arb, ctx

from bouncing_disk_ros.proof.gap import HALF_ULP, ROUNDINGS, Gap
from bouncing_disk_ros.proof.platform import SteadyPlatform, seconds, two_pi
from bouncing_disk_ros.proof.positivity import Finding, Sign, piece, positive_on
from bouncing_disk_ros.proof.records import Event, Kind
from bouncing_disk_ros.proof.verdict import Outcome, Verdict

_LEAST_PRECISION = 128


def precision_for(event: Event) -> int:
    """Bits that keep the digits of a tiny bounce and of a phase of many turns."""
    turn = 2.0 * math.pi * event.motion.f * event.delay
    cancelled = abs(math.log2(turn)) if 0.0 < turn < math.inf else 0.0
    return _LEAST_PRECISION + 2 * math.ceil(cancelled)


def prove_flight(event: Event) -> Verdict:
    """Prove a flight up to its impact, or up to an instant that it reaches without one."""
    with ctx.workprec(precision_for(event)):
        state = event.before
        gap = Gap(SteadyPlatform(event.motion, state), state, event.disk.g)
        if event.kind is Kind.IMPACT:
            return _prove_impact(gap, event)
        end = float(seconds(state, event.boundary_ns or state.ns))
        return _verdict_of(_free(gap, event, end * (1.0 - 4.0 * HALF_ULP)), gap, end)


def _free(gap: Gap, event: Event, end: float) -> Finding:
    """Whether the gap is positive from the launch until `end`."""
    state = event.before
    cuts = gap.clear_of_platform()
    if state.gap > 0.0:
        return positive_on(gap, 0.0, end, cuts=cuts)
    if state.u > 0.0:
        return positive_on(gap, 0.0, end, starts_at_zero=True, cuts=cuts)
    first = _launched(gap, end)
    if first is None:
        return Finding(Sign.UNKNOWN, 0.0, 0.0, 1)
    return positive_on(gap, first, end, cuts=cuts)


def _launched(gap: Gap, end: float) -> float | None:
    """After a launch with gap = u = 0: a time until which the gap surely opens; None: not found.

    Either it is pulled open from the first, or its acceleration −a is zero to rounding (a
    separation) and grows, h⃛ ≥ j > 0: then it is open from 3|a|/j on, which is within the rounding
    of the forcing phase.
    """
    pull = gap.derivatives(arb(0))[2]
    pulls = bool(abs(pull) <= ROUNDINGS * HALF_ULP * gap.scale.acceleration())
    length = min(end, 0.5 / gap.scale.w)
    for _ in range(200):
        _, _, h2, h3 = gap.derivatives(piece(0.0, length))
        if h2 > 0 or (pulls and h3 > 0 and 3 * abs(pull) < h3 * length):
            return length
        length *= 0.5
    return None


def _prove_impact(gap: Gap, event: Event) -> Verdict:
    d, w = event.delay, event.value
    if not (0.0 <= d < math.inf and -math.inf < w < 0.0):
        return Verdict(Outcome.REFUTED, f"an impact after {d!r} s with w_A = {w!r} m/s")
    if d == 0.0:
        at_once = event.before.gap == 0.0 and event.before.u == w < 0.0
        return Verdict(Outcome.PROVED if at_once else Outcome.REFUTED, "an impact at once")
    margin = time_margin(gap, d, w)
    verdict = _verdict_of(_free(gap, event, d - margin), gap, d)
    if verdict.outcome is not Outcome.PROVED:
        return verdict
    after = d + margin
    value = gap.at(arb(after))[0]
    if not value < 0:
        slack = gap.tolerance(after)
        refuted = value > slack
        reason = f"the gap is {float(value):.3g} m just after the impact at {d!r} s"
        return verdict._replace(
            outcome=Outcome.REFUTED if refuted else Outcome.UNDECIDED, reason=reason
        )
    return _check_speed(gap, event, margin, verdict)


def time_margin(gap: Gap, d: float, w: float) -> float:
    """What rounding makes of the time of a root where the gap closes with the speed |w|, s."""
    root = gap.scale.position(d) / abs(w) if w < 0.0 else math.inf
    return min(ROUNDINGS * HALF_ULP * (root + d), d)


def _check_speed(gap: Gap, event: Event, margin: float, verdict: Verdict) -> Verdict:
    """The reported w_A is the slope of the gap there, within the rounding of both."""
    d = event.delay
    _, slope, curvature, _ = gap.derivatives(arb(d))
    allowed = ROUNDINGS * HALF_ULP * gap.scale.velocity(d) + margin * float(abs(curvature).upper())
    off = abs(slope - arb(event.value))
    if off <= allowed:
        return _check_instant(gap, event, verdict)
    reason = f"w_A is {event.value!r} m/s, the slope {float(slope)!r}: more than {allowed:.3g} off"
    return verdict._replace(outcome=Outcome.REFUTED, reason=reason)


def _check_instant(gap: Gap, event: Event, verdict: Verdict) -> Verdict:
    """The reported forcing phase is that of the delay, within the rounding of both."""
    state, after = event.before, event.after
    assert after is not None
    grown = two_pi() * (after.cycles - state.cycles) + (arb(after.tau) - arb(state.tau))
    off = abs(grown / gap.platform.rate - arb(event.delay))
    allowed = ROUNDINGS * HALF_ULP * gap.scale.instant(event.delay)
    if off <= allowed:
        return verdict
    reason = f"the forcing phase is {float(off)!r} s from the delay: more than {allowed:.3g}"
    return verdict._replace(outcome=Outcome.REFUTED, reason=reason)


def _verdict_of(finding: Finding, gap: Gap, d: float) -> Verdict:
    slack, pieces = gap.tolerance(d), finding.pieces
    if finding.sign is Sign.POSITIVE:
        return Verdict(Outcome.PROVED, "", slack, pieces)
    if finding.sign is Sign.NEGATIVE:
        reason = f"the gap is {finding.value:.6g} m at {finding.at!r} s, before {d!r} s"
        return Verdict(Outcome.REFUTED, reason, slack, pieces)
    if finding.sign is Sign.WITHIN_ROUNDING:
        reason = f"a graze at {finding.at!r} s within the rounding of the gap"
    else:
        reason = f"not decided in {pieces} pieces, at {finding.at!r} s"
    return Verdict(Outcome.UNDECIDED, reason, slack, pieces)

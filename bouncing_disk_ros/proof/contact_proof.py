"""Proof of a stretch of contact: what would end it stays positive until the event, and falls there.

A disk in contact leaves where the load a = g + s̈ falls through zero. One that sticks slips where
grip·a − sign·ρ does, for either sign; one that slides stops where sign·w_T does (model: phases 3
and 4, rules 4 to 6). In a steady motion the load and the margins repeat with the period, so that
one period proves them for good.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flint import arb

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.proof.clock_proof import end_of, prove_clock
from bouncing_disk_ros.proof.event_functions import (
    HALF_ULP,
    ROUNDINGS,
    Watched,
    load_of,
    margin_of,
    slip_of,
)
from bouncing_disk_ros.proof.exact_records import Event, Kind
from bouncing_disk_ros.proof.flight_proof import prove_crossing, time_margin, verdict_of
from bouncing_disk_ros.proof.interval_platform import Platform
from bouncing_disk_ros.proof.offset_platform import platform_of
from bouncing_disk_ros.proof.positivity import positive_from_start
from bouncing_disk_ros.proof.verdict import Outcome, Verdict, compared, worst

_LAST_SLIP = 1.0001e-8
"""Slips that begin less than this before separation (rad) change α̇ by its square (rule 5)."""


class Condition(NamedTuple):
    """What must stay positive in contact, and the event at which it falls through zero."""

    name: str
    watched: Watched
    ends_with: Kind
    value: float = 0.0  # of the event
    repeats: bool = False  # with the period of a steady motion, or grows with each


def prove_contact(event: Event) -> Verdict:
    """Prove a stretch of contact up to the event that ends it."""
    if not 0.0 <= event.delay < math.inf:
        return Verdict(Outcome.REFUTED, f"{event.kind} after {event.delay!r} s")
    platform = platform_of(event.motion, event.before)
    conditions = list(_conditions(event, platform))
    ends = [c for c in conditions if c.ends_with is event.kind and c.value in (0.0, event.value)]
    if not ends and event.kind is not Kind.PROPAGATED:
        return Verdict(Outcome.REFUTED, f"{event.kind} cannot end {event.before.phase.name}")
    verdicts = [_prove(condition, event, condition in ends) for condition in conditions]
    if event.before.phase is Phase.STICKING:
        verdicts.append(_prove_no_slip(event, platform))
    return worst([*verdicts, _prove_speed(event, platform), prove_clock(event, platform)])


def _prove_no_slip(event: Event, platform: Platform) -> Verdict:
    """A disk that sticks turns as the platform does."""
    slip = slip_of(platform, event.before, event.disk, event.inherited)
    off = arb(event.before.omega) - platform.mix(arb(0), arb(1)).jet(arb(0))[1]
    return compared(off, slip.tolerance(0.0), "the speed of a disk that sticks")


def _conditions(event: Event, platform: Platform) -> list[Condition]:
    state, disk, repeats = event.before, event.disk, event.motion.repeats
    found = [Condition("load", load_of(platform, disk), Kind.SEPARATION, 0.0, repeats)]
    if state.phase is Phase.STICKING:
        for sign in (1.0, -1.0):
            margin = margin_of(platform, disk, sign)
            found.append(Condition("stick margin", margin, Kind.SLIP, -sign, repeats))
    elif disk.grip > 0.0:
        slip = slip_of(platform, state, disk, event.inherited)
        grows = disk.grip * disk.g + state.slip_sign * disk.lag <= 0.0
        found.append(Condition("slip", slip, Kind.SLIP_ENDS, 0.0, grows and repeats))
    return found


def _prove(condition: Condition, event: Event, is_end: bool) -> Verdict:
    """One condition, up to the event; `is_end`: it is the one that falls through zero there."""
    watched, d = condition.watched, end_of(event)
    rate = _fastest(event)
    margin = d * 4.0 * HALF_ULP
    if is_end:
        slope = watched.jet(arb(d))[1]
        margin = time_margin(watched, d, float(slope)) + _instant(event)
        if d <= margin:
            return _prove_at_once(watched, d)
    elif event.kind is Kind.SEPARATION and condition.ends_with is Kind.SLIP:
        margin += _LAST_SLIP / rate + _instant(event)
    end = d - margin
    until = min(end, (1.0 + 1e-9) / event.motion.f) if condition.repeats else end
    finding = positive_from_start(watched, until, rate)
    verdict = verdict_of(finding, watched, d, condition.name)
    if verdict.outcome is Outcome.PROVED and is_end:
        crossing = prove_crossing(watched, d + margin, condition.name)
        return crossing._replace(pieces=verdict.pieces)
    return verdict


def _prove_at_once(watched: Watched, d: float) -> Verdict:
    """An event within rounding of the state before: the value is zero there, or below."""
    value, slack = watched.jet(arb(d))[0], watched.tolerance(d)
    if value <= slack:
        return Verdict(Outcome.PROVED, "", slack)
    return Verdict(Outcome.REFUTED, f"an event at once where {float(value):.3g} is left", slack)


def _fastest(event: Event) -> float:
    return 2.0 * math.pi * max(event.motion.f, event.motion.f + event.motion.df)


def _instant(event: Event) -> float:
    """What rounding makes of a time that is kept as a forcing phase, s."""
    return ROUNDINGS * HALF_ULP * 2.0 * math.pi / (2.0 * math.pi * event.motion.f)


def _prove_speed(event: Event, platform: Platform) -> Verdict:
    """The α̇ of the state after: the platform's where the disk sticks or comes to stick."""
    after, state, disk = event.after, event.before, event.disk
    if after is None or (state.phase is Phase.SLIDING and disk.grip == 0.0 and disk.lag == 0.0):
        return Verdict(Outcome.PROVED)
    d = end_of(event)
    turning = platform.mix(arb(0), arb(1)).jet(arb(d))
    slip = slip_of(platform, state, disk)
    allowed = slip.tolerance(d) + slip.tolerance(d, 1) * d
    speed = turning[1]
    if state.phase is Phase.SLIDING:
        speed += arb(state.slip_sign) * slip.jet(arb(d))[0]
    allowed += float(abs(turning[2]).upper()) * _instant(event)
    return compared(speed - arb(after.omega), allowed, "the speed with which the disk turns on")

"""Proof of one event of a trace in interval arithmetic: clock, flight, contact, chatter."""

from __future__ import annotations

import math
from typing import NamedTuple

from flint import arb, ctx

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.proof.event_functions import (
    HALF_ULP,
    ROUNDINGS,
    Watched,
    gap_of,
    load_of,
    margin_of,
    slip_of,
)
from bouncing_disk_ros.proof.exact_records import Event, Kind
from bouncing_disk_ros.proof.platforms import Platform, interval, platform_of, seconds
from bouncing_disk_ros.proof.positivity import Finding, Sign, positive_from_start
from bouncing_disk_ros.proof.verdicts import Outcome, Verdict, compared, worst
from bouncing_disk_ros.units import NS


def end_of(event: Event) -> float:
    """Seconds from the clock of the state before to the event, or to where none has come."""
    if event.kind is not Kind.PROPAGATED:
        return event.delay
    if event.after is not None:
        return float(seconds(event.before, event.after.ns, event.after.sub))
    assert event.boundary_ns is not None
    return float(seconds(event.before, event.boundary_ns))


def _fastest(event: Event) -> float:
    """The largest ω of the motion, rad/s."""
    return 2.0 * math.pi * max(event.motion.f, event.motion.f + event.motion.df)


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


# ------------------------------------------------------------------------------------------------
# Proof of a flight: no impact before the one that is reported, and one there.


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
    free = positive_from_start(gap, end * (1.0 - 4.0 * HALF_ULP), _fastest(event))
    return worst([verdict_of(free, gap, end, "gap"), _prove_propagated(gap, event, end), clock])


def _prove_impact(gap: Watched, event: Event) -> Verdict:
    d, w = event.delay, event.value
    if d == 0.0:
        at_once = event.before.gap == 0.0 and event.before.u == w
        return Verdict(Outcome.PROVED if at_once else Outcome.REFUTED, "an impact at once")
    margin = time_margin(gap, d, w)
    free = positive_from_start(gap, d - margin, _fastest(event))
    verdict = _prove_zero(free, gap, d, margin, "gap")
    if verdict.outcome is not Outcome.PROVED:
        return verdict
    _, slope, curvature = gap.jet(arb(d))[:3]
    allowed = gap.tolerance(d, 1) + margin * float(abs(curvature).upper())
    return worst([verdict, compared(slope - arb(w), allowed, f"w_A = {w!r} m/s")])


def time_margin(watched: Watched, d: float, slope: float) -> float:
    """What rounding makes of the time of a zero where the value falls with this slope, s."""
    root = watched.tolerance(d) / abs(slope) if slope < 0.0 else math.inf
    return min(root + ROUNDINGS * HALF_ULP * d, d)


def _prove_zero(before: Finding, watched: Watched, d: float, margin: float, name: str) -> Verdict:
    """The first zero is at d: not `before` it, and just after it the value is below zero."""
    verdict, after = verdict_of(before, watched, d, name), d + margin
    if verdict.outcome is not Outcome.PROVED:
        return verdict
    value, slack = watched.jet(arb(after))[0], watched.tolerance(after)
    if value < 0:
        return Verdict(Outcome.PROVED, "", slack, before.pieces)
    outcome = Outcome.REFUTED if value > slack else Outcome.UNDECIDED
    reason = f"the {name} is {float(value):.3g} at {after!r} s, just after its zero"
    return Verdict(outcome, reason, slack, before.pieces)


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


# ------------------------------------------------------------------------------------------------
# Proof of a stretch of contact: what would end it stays positive until the event, and falls there.
#
# A disk in contact leaves where the load a = g + s̈ falls through zero. One that sticks slips where
# grip·a − sign·ρ does, for either sign; one that slides stops where sign·w_T does (model: phases 3
# and 4, rules 4 to 6). In a steady motion the load and the margins repeat with the period, so that
# one period proves them for good.


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
    if is_end:
        return _prove_zero(finding, watched, d, margin, condition.name)
    return verdict_of(finding, watched, d, condition.name)


def _prove_at_once(watched: Watched, d: float) -> Verdict:
    """An event within rounding of the state before: the value is zero there, or below."""
    value, slack = watched.jet(arb(d))[0], watched.tolerance(d)
    if value <= slack:
        return Verdict(Outcome.PROVED, "", slack)
    return Verdict(Outcome.REFUTED, f"an event at once where {float(value):.3g} is left", slack)


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


# ------------------------------------------------------------------------------------------------
# Proof of a completed chatter: that it ends, when, and what friction does on the way.
#
# Over the rest of a chatter that lasts T from an impact with relative speed u after it, let the
# relative acceleration be a(t) = a₀ + jt + r(t), |r| ≤ M t²/2, and X = |j|T/a₀, Y = M T²/a₀, Q = X
# + Y/2. A flight of length d has u = āᵤ d/2 and lands with w = u(1 + η), η = 2(ā − āᵤ)/āᵤ, where ā
# is the mean of a and āᵤ the mean with the weight 2(1 − s): |η| ≤ sup|a′| d/(3 inf a), so that in
# all u falls by εⁿ and a factor within exp(±H), H = sup|a′| T/(3 inf a), and
#
#     T ≤ 2u e^H/(inf a (1 − ε)).
#
# With η = jd/(3a₀) + …, āᵤ = a₀ + j(tₙ + d/3) + … the sum of all flights is T₀ − jT₀²/(3a₀), T₀ =
# 2u/(a₀(1 − ε)), but for T₀ times a remainder that `remainder` bounds term by term.


_NO_BOUNCE = 1.0001 * 2.0 * math.pi * 16.0 * 2.0**-53
"""A bounce that turns the forcing phase by less than this (rad) is contact."""


class Tail(NamedTuple):
    """The rest of a chatter: bounds of it, and of a = g + s̈ over it."""

    longest: float  # s
    closed_form: arb  # T, s
    remainder: float  # of it, 1
    growth: float  # H
    load: arb  # a, over all of it
    torque: arb  # ρ


def prove_still(event: Event) -> Verdict:
    """A bounce too short to move the forcing phase is taken as contact."""
    platform = platform_of(event.motion, event.before)
    load = load_of(platform, event.disk).jet(arb(0))[0]
    turned = 2 * arb(event.before.u) * platform.rate(arb(0))
    if load > 0 and turned <= _NO_BOUNCE * load:
        return prove_clock(event, platform)
    return Verdict(Outcome.REFUTED, "the bounce moves the forcing phase, and is left out")


def prove_chatter(event: Event) -> Verdict:
    """Prove that a chatter completes within the delay, and as friction is said to act."""
    platform, state = platform_of(event.motion, event.before), event.before
    law = arb(event.disk.restitution), arb(event.disk.g), arb(event.disk.lag)
    tail = chatter_tail(platform, *law, arb(state.u), event.delay)
    if tail is None:
        return Verdict(Outcome.REFUTED, "the chatter does not surely end: load or ε do not allow")
    end = min(float(tail.closed_form) * (1.0 + tail.remainder), tail.longest)
    if event.boundary_ns is not None and arb(end) > seconds(state, event.boundary_ns):
        return Verdict(Outcome.REFUTED, "the chatter ends after the next input")
    verdicts = [_prove_end(event, tail, platform), _prove_friction(event, tail, platform)]
    verdicts += [_prove_state(event, platform), prove_clock(event, platform)]
    return worst(verdicts)


def chatter_tail(
    platform: Platform, restitution: arb, g: arb, lag: arb, u: arb, delay: float
) -> Tail | None:
    """Bounds of the rest of a chatter that lasts about `delay`; None: they are not to be had."""
    if not (restitution < 1 and u > 0 and 0.0 < delay < math.inf):
        return None
    longest = 1.01 * delay
    axial, whole = platform.mix(arb(1), arb(0)), interval(0.0, longest)
    start, over = axial.jet(arb(0)), axial.jet(whole)
    a0, load = g + start[2], g + over[2]
    if not (a0 > 0 and load > 0):
        return None
    steepest, bent = abs(over[3]).upper(), abs(over[4]).upper()
    growth = float((steepest * longest / (3 * load.lower())).upper())
    if not 2 * u * arb(growth).exp() <= load.lower() * (1 - restitution) * longest:
        return None
    t0 = 2 * u / (a0 * (1 - restitution))
    x = float((abs(start[3]) * longest / a0).upper())
    y = float((bent * longest * longest / a0).upper())
    torque = lag + platform.mix(arb(0), arb(1)).jet(whole)[2]
    closed_form = t0 - start[3] * t0 * t0 / (3 * a0)  # ≥ (1 − X/3) T₀
    return Tail(longest, closed_form, (1.0 + x) * remainder(x, y), growth, load, torque)


def remainder(x: float, y: float) -> float:
    """Bound of what T₀ − jT₀²/(3a₀) leaves out, over T₀; X and Y as above, small."""
    q = x + y / 2.0
    if q > 0.01:
        return math.inf
    room = 1.0 + 2.0 * q
    inverse = room * (y / 2.0 + q * q)  # of 1/āᵤ
    steps = room * (x * q + y) / 3.0  # of Σ η
    sum_of_steps = x / 3.0 + steps
    product = steps + room * sum_of_steps**2 / 2.0  # of Π(1 + η)
    speed, pull = x / 3.0 + product, 4.0 / 3.0 * x + inverse
    flight = inverse + product + speed * pull  # of each dₙ, over εⁿd₀
    relative = 5.0 / 3.0 * x + flight  # by how much tₙ and dₙ are off in the linear terms
    return room * (flight + x * relative)


def _prove_end(event: Event, tail: Tail, platform: Platform) -> Verdict:
    """The reported delay is the closed form, and that is exact to the rounding of the phase."""
    load = load_of(platform, event.disk)
    part = load.tolerance(event.delay) / float(tail.load.lower()) + ROUNDINGS * HALF_ULP
    allowed = event.delay * part
    ends = compared(arb(event.delay) - tail.closed_form, allowed, "the end of the chatter")
    if ends.outcome is not Outcome.PROVED:
        return ends
    turned = tail.remainder * event.delay * float(platform.rate(arb(0)))
    if turned <= ROUNDINGS * HALF_ULP:
        return Verdict(Outcome.PROVED, "", allowed)
    reason = f"the closed form of the chatter is exact to {turned:.3g} rad only"
    return Verdict(Outcome.UNDECIDED, reason, allowed)


def _prove_friction(event: Event, tail: Tail, platform: Platform) -> Verdict:
    """All impacts slip with the same sign (the event's value), or all stick (0)."""
    disk, state, sign = event.disk, event.before, event.value
    if disk.grip == 0.0:
        return Verdict(Outcome.PROVED)
    growth, ends = arb(tail.growth).exp(), 1 + arb(disk.restitution)
    slip = arb(state.omega) - platform.mix(arb(0), arb(1)).jet(arb(0))[1]
    slack = slip_of(platform, state, disk).tolerance(0.0)
    torque = abs(tail.torque)
    if sign == 0.0:
        supplied = arb(disk.grip) * ends * tail.load.lower() / growth
        holds = abs(slip) <= slack and torque.upper() * 2 <= supplied
    elif abs(slip) <= slack:
        supplied = arb(disk.grip) * ends * tail.load.upper() * growth
        holds = -sign * tail.torque * 2 > supplied
    else:
        total = ends / (1 - arb(disk.restitution)) * state.u * growth
        holds = sign * slip > disk.grip * total + torque.upper() * tail.longest
    if holds:
        return Verdict(Outcome.PROVED)
    acts = "sticks" if sign == 0.0 else "slips one way"
    return Verdict(Outcome.UNDECIDED, f"not shown that each impact {acts}", slack)


def _prove_state(event: Event, platform: Platform) -> Verdict:
    """The α̇ at the end: the platform's, or less by what the sum of the impulses can give."""
    state, after, disk = event.before, event.after, event.disk
    assert after is not None
    d = arb(event.delay)
    slip = slip_of(platform, state, disk)
    if event.value == 0.0:
        speed = platform.mix(arb(0), arb(1)).jet(d)[1]
    else:
        gap = gap_of(platform, state, disk)
        impulse = -gap.jet(d)[1]  # over m, by momentum
        speed = arb(state.omega) - arb(event.value) * disk.grip * impulse - disk.lag * d
    allowed = slip.tolerance(event.delay) + disk.grip * ROUNDINGS * HALF_ULP * state.u
    if after.gap != 0.0 or after.u != 0.0:
        return Verdict(Outcome.REFUTED, f"the chatter ends with a gap: {after!r}")
    return compared(speed - arb(after.omega), allowed, "the speed with which the disk turns on")


# ------------------------------------------------------------------------------------------------
# Prove one event of a trace.


_LEAST_PRECISION = 128


def precision_for(event: Event) -> int:
    """Bits that keep the digits of a tiny bounce and of a phase of many turns."""
    m, d = event.motion, end_of(event)
    parts = [_fastest(event) * d]
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

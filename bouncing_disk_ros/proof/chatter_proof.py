"""Proof of a completed chatter: that it ends, when, and what friction does on the way.

Over the rest of a chatter that lasts T from an impact with relative speed u after it, let the
relative acceleration be a(t) = a₀ + jt + r(t), |r| ≤ M t²/2, and X = |j|T/a₀, Y = M T²/a₀, Q = X +
Y/2. A flight of length d has u = āᵤ d/2 and lands with w = u(1 + η), η = 2(ā − āᵤ)/āᵤ, where ā is
the mean of a and āᵤ the mean with the weight 2(1 − s): |η| ≤ sup|a′| d/(3 inf a), so that in all u
falls by εⁿ and a factor within exp(±H), H = sup|a′| T/(3 inf a), and

    T ≤ 2u e^H/(inf a (1 − ε)).

With η = jd/(3a₀) + …, āᵤ = a₀ + j(tₙ + d/3) + … the sum of all flights is T₀ − jT₀²/(3a₀), T₀ =
2u/(a₀(1 − ε)), but for T₀ times a remainder that `remainder` bounds term by term.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flint import arb

from bouncing_disk_ros.proof.clock_proof import prove_clock
from bouncing_disk_ros.proof.event_functions import (
    HALF_ULP,
    ROUNDINGS,
    gap_of,
    load_of,
    slip_of,
)
from bouncing_disk_ros.proof.exact_records import DiskRecord, Event, State
from bouncing_disk_ros.proof.interval_platform import Platform, interval, seconds
from bouncing_disk_ros.proof.offset_platform import platform_of
from bouncing_disk_ros.proof.verdict import Outcome, Verdict, compared, worst

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
    tail = chatter_tail(platform, event.disk, state, event.delay)
    if tail is None:
        return Verdict(Outcome.REFUTED, "the chatter does not surely end: load or ε do not allow")
    end = min(float(tail.closed_form) * (1.0 + tail.remainder), tail.longest)
    if event.boundary_ns is not None and arb(end) > seconds(state, event.boundary_ns):
        return Verdict(Outcome.REFUTED, "the chatter ends after the next input")
    verdicts = [_prove_end(event, tail, platform), _prove_friction(event, tail, platform)]
    verdicts += [_prove_state(event, platform), prove_clock(event, platform)]
    return worst(verdicts)


def chatter_tail(platform: Platform, disk: DiskRecord, state: State, delay: float) -> Tail | None:
    """Bounds of the rest of a chatter that lasts about `delay`; None: they are not to be had."""
    u = state.u
    if not (disk.restitution < 1.0 and u > 0.0 and 0.0 < delay < math.inf):
        return None
    longest = 1.01 * delay
    axial, whole = platform.mix(arb(1), arb(0)), interval(0.0, longest)
    start, over = axial.jet(arb(0)), axial.jet(whole)
    a0, load = disk.g + start[2], disk.g + over[2]
    if not (a0 > 0 and load > 0):
        return None
    steepest, bent = abs(over[3]).upper(), abs(over[4]).upper()
    growth = float((steepest * longest / (3 * load.lower())).upper())
    if not 2 * arb(u) * arb(growth).exp() <= load.lower() * (1 - arb(disk.restitution)) * longest:
        return None
    t0 = 2 * arb(u) / (a0 * (1 - arb(disk.restitution)))
    x = float((abs(start[3]) * longest / a0).upper())
    y = float((bent * longest * longest / a0).upper())
    torque = disk.lag + platform.mix(arb(0), arb(1)).jet(whole)[2]
    return Tail(longest, t0 - start[3] * t0 * t0 / (3 * a0), remainder(x, y), growth, load, torque)


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

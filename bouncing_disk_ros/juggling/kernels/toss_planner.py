"""Plans of offsets that bring the disk onto an orbit in two impacts, for kernels.

The disk flies. Its next impact is placed at an instant T₁ where the platform, moved by c, meets it;
there the platform's velocity is chosen so that the disk next comes down on the orbit's own point:
at the forcing phase φ of one of its impacts, at the height Γ sin φ. At that second impact, T₂, the
platform's velocity is chosen so that the disk leaves with the orbit's velocity. From then on the
offset is 0. See docs/juggling.md. Units as in `flights`.
"""

from __future__ import annotations

import math

import numpy as np

from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.core.compilation import rare_kernel
from bouncing_disk_ros.core.flight import Launch
from bouncing_disk_ros.core.platform import axial_jet
from bouncing_disk_ros.juggling.kernels.flights import (
    FLIES,
    IMPACT,
    KIND,
    NOTHING,
    POSITION,
    SINCE,
    VELOCITY,
    next_event,
    sine_cosine,
)
from bouncing_disk_ros.juggling.kernels.offset_plan import (
    BEGIN,
    DURATION,
    Array,
    Triple,
    is_still,
    keep_past,
    offset_state,
    use_of_limits,
    write_piece,
)
from bouncing_disk_ros.maps.axial_map import GRAVITY, axial_motion, landing

FORCING, RESTITUTION, POSITION_LIMIT, ACCELERATION_LIMIT, STRATEGY, LEARNS, LEVELS, OWN_ORBIT = (
    range(8)
)
"""Settings of a controller: Γ, ε as believed, limits of the offset, strategy, whether ε is learned,
levels c on each side of 0 that T₁ is looked for at, whether the target is the period-1 orbit."""
SETTINGS = 8
T_2, V_2 = 0, 1
"""Aim of a plan: when the disk is on the orbit, and the velocity it then leaves with."""

ZERO = (0.0, 0.0, 0.0)

_FULL = 0.999  # of the limits
_RETURNS = (1.0, 1.5, 2.5, 4.0)  # rad that a return to no offset may take
_SHORTEST = 0.15  # rad from the earliest instant of control to T₁
_NEXT = 0.4  # rad, at least, from T₁ to T₂
_FARTHEST = 2.7 * TWO_PI  # at most
_EVENTS = 60  # impacts looked ahead
_FLIGHTS = 4  # of which so many are tried
_GRAZE = 0.02  # slowest impact that is planned
_ROOM = 0.5  # rad of rest left, at least, for a throw
_THROW, _THROWS = 1.1, 16
"""Largest velocity of a throw, of √(limit of position × limit of acceleration), and how many."""
_LOW = 1e-6  # πg/ω²: a disk no higher above the sinusoid is as good as below it
_SAME = 1e-6  # rad: an impact is where it was planned
_HASTE = 0.1  # of the limits: what a period of delay counts in the choice of a plan


@rare_kernel
def return_to_nothing(row: Array, settings: Array, begin: float, state: Triple) -> bool:
    """Enter a piece from a state of the offset to none; False where limits forbid it."""
    for span in _RETURNS:
        write_piece(row, begin, begin + span, state, ZERO)
        if use_of_limits(row, settings[POSITION_LIMIT], settings[ACCELERATION_LIMIT]) <= _FULL:
            return True
    return False


@rare_kernel
def pulse_time(settings: Array, level: float, speed: float) -> float:
    """How long a piece from no offset to a level and a speed takes, so that limits allow it."""
    limit = settings[ACCELERATION_LIMIT]
    return max(1.0, 4.1 * abs(speed) / limit + math.sqrt(5.8 * abs(level) / limit))


@rare_kernel
def write_impact(
    out: Array, n: int, settings: Array, begin: float, state: Triple, at: float, level: float,
    speed: float,
) -> int:  # fmt: skip
    """Lead the offset from a state at `begin` to a level and a speed at `at`; rows then used."""
    span = pulse_time(settings, level, speed)
    aim = (level, speed, 0.0)
    if is_still(state):
        write_piece(out[n], max(begin, at - span), at, ZERO, aim)
        return n + 1
    if begin + _RETURNS[0] + span < at and return_to_nothing(out[n], settings, begin, state):
        free = out[n, BEGIN] + out[n, DURATION]
        if free + 0.8 * span < at:
            write_piece(out[n + 1], max(free, at - span), at, ZERO, aim)
            return n + 2
    write_piece(out[n], begin, at, state, aim)
    return n + 1


@rare_kernel
def part_used(out: Array, first: int, n: int, settings: Array) -> float:
    """Largest part of the limits that rows use."""
    part = 0.0
    for i in range(first, n):
        one = use_of_limits(out[i], settings[POSITION_LIMIT], settings[ACCELERATION_LIMIT])
        part = max(part, one)
        if part > 1.0:
            break
    return part


@rare_kernel
def meets(
    settings: Array, restitution: float, out: Array, flight: Array, first: float, second: float
) -> bool:
    """Whether the next two impacts of a flight under a plan are at these instants."""
    state = flight.copy()
    for at in (first, second):
        found, t, _ = next_event(settings[FORCING], restitution, out, state, at + _SAME)
        if found != IMPACT or abs(t - at) > _SAME:
            return False
    return True


@rare_kernel
def try_toss(
    settings: Array, restitution: float, target: Array, flight: Array, kept: Array, n: int,
    begin: float, level: float, at: float, arrives: float, trial: Array,
) -> float:  # fmt: skip
    """A plan with impacts at `at` (T₁) and `arrives` (T₂) in `trial`: part of the limits it uses.

    inf: no such plan.
    """
    forcing, e = settings[FORCING], restitution
    d = at - flight[SINCE]
    before = flight[VELOCITY] - GRAVITY * d
    height = flight[POSITION] + d * (flight[VELOCITY] - 0.5 * GRAVITY * d)
    d = arrives - at
    orbit_sine, orbit_cosine = sine_cosine(target[0])
    orbit_height = forcing * orbit_sine
    leaves = (orbit_height - height) / d + 0.5 * GRAVITY * d
    speed = (leaves + e * before) / (1.0 + e) - forcing * sine_cosine(at)[1]
    again = leaves - GRAVITY * d
    second = (target[1] + e * again) / (1.0 + e) - forcing * orbit_cosine
    fastest = 2.0 * math.sqrt(settings[POSITION_LIMIT] * settings[ACCELERATION_LIMIT])
    if max(abs(speed), abs(second)) > fastest:
        return math.inf
    if leaves - before < (1.0 + e) * _GRAZE or target[1] - again < (1.0 + e) * _GRAZE:
        return math.inf
    trial[:] = kept
    state = offset_state(trial, begin)
    used = write_impact(trial, n, settings, begin, state, at, level, speed)
    after = pulse_time(settings, level, speed)
    if at + after + pulse_time(settings, 0.0, second) <= arrives:
        write_piece(trial[used], at, at + after, (level, speed, 0.0), ZERO)
        used = write_impact(trial, used + 1, settings, at + after, ZERO, arrives, 0.0, second)
    else:
        write_piece(trial[used], at, arrives, (level, speed, 0.0), (0.0, second, 0.0))
        used += 1
    span = pulse_time(settings, 0.0, second)
    write_piece(trial[used], arrives, arrives + span, (0.0, second, 0.0), ZERO)
    part = part_used(trial, n, used + 1, settings)
    if part > _FULL or not meets(settings, e, trial, flight, at, arrives):
        return math.inf
    return part


@rare_kernel
def meeting(settings: Array, flight: Array, begin: float, level: float, middle: float) -> float:
    """When the disk comes down on the platform moved by a level, not before `begin`; inf: not."""
    forcing = settings[FORCING]
    d = begin - flight[SINCE]
    gap = flight[POSITION] + d * (flight[VELOCITY] - 0.5 * GRAVITY * d)
    gap -= forcing * sine_cosine(begin)[0]
    start = begin
    if gap - level <= 1e-9:
        start = middle
        d = start - flight[SINCE]
        gap = flight[POSITION] + d * (flight[VELOCITY] - 0.5 * GRAVITY * d)
        gap -= forcing * sine_cosine(start)[0]
        if gap <= level:
            return math.inf
    motion = axial_motion(forcing)
    sine, cosine = sine_cosine(start)
    jet = axial_jet(motion, sine, cosine, 0.0)
    u = flight[VELOCITY] - GRAVITY * d - jet[1]
    launch = Launch(0.0, sine, cosine, GRAVITY, gap - level, u)
    until = begin + 6.0 * TWO_PI - start
    return start + landing(motion, launch, jet, 0.0, until)[0]


@rare_kernel
def best_toss(
    settings: Array, restitution: float, targets: Array, flight: Array, kept: Array, n: int,
    begin: float, lands: float, best: Array, aim: Array,
) -> float:  # fmt: skip
    """The plan for one flight that uses least of the limits and time, in `best`; its score."""
    trial = np.empty_like(best)
    lowest = math.inf
    levels = int(settings[LEVELS])
    for i in range(-levels, levels + 1):
        level = 0.8 * settings[POSITION_LIMIT] * i / max(levels, 1)
        at = meeting(settings, flight, begin, level, 0.5 * (begin + lands)) if i else lands
        if not begin + _SHORTEST < at < math.inf:
            continue
        for target in targets:
            ahead = at + _NEXT - target[0]
            arrives = target[0] + TWO_PI * math.ceil(ahead / TWO_PI)
            while arrives < at + _FARTHEST:
                part = try_toss(
                    settings, restitution, target, flight, kept, n, begin, level, at, arrives, trial
                )
                score = part + _HASTE * (arrives - begin) / TWO_PI
                if score < lowest:
                    lowest = score
                    best[:] = trial
                    aim[T_2], aim[V_2] = arrives, target[1]
                arrives += TWO_PI
    return lowest


@rare_kernel
def plan_toss(
    settings: Array, restitution: float, targets: Array, belief: Array, plan: Array, now: float,
    aim: Array,
) -> bool:  # fmt: skip
    """Replace a plan from `now` on by one that brings the disk onto the orbit; False: none found.

    `belief`: the state of the disk, at or before `now`. The flights that follow are tried one
    after another: the first that can be controlled is.
    """
    forcing = settings[FORCING]
    best, kept, base = np.empty_like(plan), np.empty_like(plan), np.empty_like(plan)
    n = keep_past(plan, now, kept)
    base[:] = kept
    state = offset_state(plan, now)
    free, rows = now, n
    if not is_still(state):
        if not return_to_nothing(base[n], settings, now, state):
            return False
        free, rows = base[n, BEGIN] + base[n, DURATION], n + 1
    flight, tried = belief.copy(), 0
    for _ in range(_EVENTS):
        here = flight.copy()
        found, ends, _ = next_event(forcing, restitution, base, flight, now + 8.0 * TWO_PI)
        begin = max(now, here[SINCE], free)
        rests = here[KIND] != FLIES and (found == NOTHING or ends > begin + _ROOM)
        if rests and plan_throw(settings, restitution, targets, here, base, rows, begin, plan, aim):
            return True
        if found == NOTHING:
            break
        first = here[SINCE] <= now
        if here[KIND] != FLIES or ends <= now or tried == _FLIGHTS:
            continue
        if first:
            begin = now
            ends = natural_landing(settings, here, now) if free > now else ends
        if ends < begin + _SHORTEST:
            continue
        tried += 1
        score = best_toss(
            settings, restitution, targets, here, kept if first else base, n if first else rows,
            begin, ends, best, aim,
        )  # fmt: skip
        if score < math.inf:
            plan[:] = best
            return True
    begin = max(now, free)  # last of all: a pulse into whatever the disk does
    return plan_throw(settings, restitution, targets, belief, base, rows, begin, plan, aim)


@rare_kernel
def thrown_flight(
    settings: Array, restitution: float, throw: Array, state: Array, ends: float
) -> float:
    """Go on to the flight that a throw, over at `ends`, leads to; when it lands, inf: none."""
    for _ in range(_EVENTS):
        flown = state.copy()
        found, lands, _ = next_event(
            settings[FORCING], restitution, throw, flown, ends + 8.0 * TWO_PI
        )
        if found == NOTHING:
            break
        if state[KIND] == FLIES and lands >= ends + _SHORTEST:
            return lands
        state[:] = flown
    return math.inf


@rare_kernel
def plan_throw(
    settings: Array, restitution: float, targets: Array, rest: Array, base: Array, n: int,
    begin: float, plan: Array, aim: Array,
) -> bool:  # fmt: skip
    """Throw a disk, at rest or bouncing low, so that a flight follows that can be controlled."""
    throw, best = np.empty_like(plan), np.empty_like(plan)
    fastest = _THROW * math.sqrt(settings[POSITION_LIMIT] * settings[ACCELERATION_LIMIT])
    for i in range(_THROWS):
        speed = fastest if i % 2 == 0 else 0.6 * fastest
        span = pulse_time(settings, 0.0, speed)
        at = begin + span + TWO_PI * i / _THROWS
        throw[:] = base
        write_piece(throw[n], at - span, at, ZERO, (0.0, speed, 0.0))
        write_piece(throw[n + 1], at, at + span, (0.0, speed, 0.0), ZERO)
        if part_used(throw, n, n + 2, settings) > 1.0:
            continue
        flight = rest.copy()
        lands = thrown_flight(settings, restitution, throw, flight, at + span)
        if lands == math.inf:
            continue
        free = max(at + span, flight[SINCE])
        score = best_toss(
            settings, restitution, targets, flight, throw, n + 2, free, lands, best, aim
        )
        if score < math.inf:
            plan[:] = best
            return True
    return False


@rare_kernel
def natural_landing(settings: Array, flight: Array, now: float) -> float:
    """When the flight in progress would land on the sinusoid alone; -inf: it is below it now."""
    forcing = settings[FORCING]
    d = now - flight[SINCE]
    gap = flight[POSITION] + d * (flight[VELOCITY] - 0.5 * GRAVITY * d)
    gap -= forcing * sine_cosine(now)[0]
    if gap <= _LOW:
        return -math.inf
    at: float = meeting(settings, flight, now, 0.0, now)
    return at

"""What a controller does when it hears of an impact: the strategies, for kernels.

Pure: what a controller knows is in `memory` and `plan`, arrays that `hear` changes in place.
Units as in `flights`; the derivations are in docs/juggling.md.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, arccosine, shortest_angle
from bouncing_disk_ros.core.compilation import entry, kernel, rare_kernel
from bouncing_disk_ros.juggling.kernels.flights import (
    FLIES,
    IMPACT,
    KIND,
    NOTHING,
    POSITION,
    RESTS,
    SINCE,
    UNKNOWN,
    VELOCITY,
    next_event,
    platform_state,
    sine_cosine,
)
from bouncing_disk_ros.juggling.kernels.offset_plan import (
    Array,
    is_still,
    keep_past,
    offset_state,
    plan_type,
    write_piece,
)
from bouncing_disk_ros.juggling.kernels.toss_planner import (
    FORCING,
    LEARNS,
    OWN_ORBIT,
    RESTITUTION,
    STRATEGY,
    T_2,
    V_2,
    ZERO,
    natural_landing,
    part_used,
    plan_toss,
    pulse_time,
    return_to_nothing,
    write_impact,
)
from bouncing_disk_ros.maps.axial_map import GRAVITY
from bouncing_disk_ros.maps.period_one import existence_limit

NONE, IMPACT_TIME, DEADBEAT, SMALL = range(4)
"""Strategies: their numbers in the settings."""
NAMES = ("none", "impact_time", "deadbeat", "small")

BELIEF, AIM, EPSILON, HEARD, ARRIVED, SOLID = 0, 4, 6, 7, 8, 9
"""In the memory: state of the disk as believed, aim of the plan, ε as learned, impacts heard,
velocity before the last one, whether that velocity is measured."""
MEMORY = 10

_BEFORE = 0.3  # of the time since the last impact: a predicted one so much earlier is another one
_WEAK = 0.1  # impacts slower than this teach nothing
_GAIN = 0.5  # of what one impact teaches about ε
_FARTHEST_GUESS = 0.3  # of ε from the one given
_SAME = 1e-9  # rad and πg/ω: where no new plan is needed
_SLOW, _ROUGHLY = 0.1, 0.01
"""After a rest or a bounce slower than this, a plan is kept that leads so near to its aim: the end
of a chatter is not predicted to the last digit, and a throw cannot begin twice."""
_LOW = 0.03  # a bounce slower than this is over before an answer
_MOST = 200  # impacts until a plan arrives
_MOST_MISSED = 100_000  # between two impacts that were heard: after more nothing is known
_NEAR_PHASE, _NEAR_SPEED = 0.8, 0.4
"""How near to the orbit small-parameter feedback acts: rad and πg/ω."""


least_forcing = kernel(existence_limit)


def empty_memory(restitution: float) -> Array:
    """Memory of a controller that has heard nothing, and believes in a restitution."""
    memory = np.zeros(MEMORY)
    memory[BELIEF + KIND], memory[EPSILON] = UNKNOWN, restitution
    memory[AIM + T_2] = -math.inf
    return memory


new_memory = rare_kernel(empty_memory)


@entry(types.float64(types.float64, types.float64))
def orbit_phase(forcing: float, restitution: float) -> float:
    """τ_imp of the period-1 orbit; 0 where there is none."""
    least = least_forcing(restitution)
    return arccosine(least / forcing) if least < forcing else 0.0


@entry(types.float64(types.float64))
def arc_cosine(c: float) -> float:
    """`arccosine` for Python: angle in [0, π/2] whose cosine is c in [0, 1]."""
    found: float = arccosine(c)
    return found


# --- estimates ------------------------------------------------------------------------------------
@rare_kernel
def estimate(
    settings: Array, memory: Array, plan: Array, t: float, velocity: float, rests: bool
) -> None:
    """The state of the disk after an impact, and ε, from what was heard and believed before."""
    forcing = settings[FORCING]
    x, speed, _, _, _ = platform_state(forcing, plan, t)
    belief = memory[BELIEF : BELIEF + 4]
    known, solid, before = arrival(settings, memory, plan, t, x)
    if rests:
        belief[KIND], belief[SINCE], belief[POSITION], belief[VELOCITY] = RESTS, t, x, speed
        memory[SOLID] = 0.0
        return
    if known and not math.isnan(velocity):
        learn(settings, memory, solid, before - speed, velocity - speed)
    if math.isnan(velocity) and known:
        velocity = speed + memory[EPSILON] * max(speed - before, 0.0)
    belief[KIND] = UNKNOWN if math.isnan(velocity) else FLIES
    belief[SINCE], belief[POSITION] = t, x
    belief[VELOCITY] = velocity if belief[KIND] == FLIES else speed
    memory[ARRIVED], memory[SOLID] = before, 1.0 if known and solid else 0.0


@rare_kernel
def arrival(
    settings: Array, memory: Array, plan: Array, t: float, x: float
) -> tuple[bool, bool, float]:
    """(whether it is known, whether no impact was missed, velocity) with which the disk came."""
    belief = memory[BELIEF : BELIEF + 4]
    if memory[HEARD] == 0.0 or t <= belief[SINCE]:
        return False, False, 0.0
    state, solid = belief.copy(), belief[KIND] != RESTS
    if state[KIND] != UNKNOWN:
        until = t - _BEFORE * (t - belief[SINCE])
        for missed in range(_MOST_MISSED):
            found, _, _ = next_event(settings[FORCING], memory[EPSILON], plan, state, until)
            if found == NOTHING:
                solid = solid and missed == 0
                break
        else:
            return False, False, 0.0
    if state[KIND] == RESTS:
        return False, False, 0.0
    d = t - state[SINCE]
    leaves = (x - state[POSITION]) / d + 0.5 * GRAVITY * d  # what leads from there to here
    if solid and memory[SOLID] != 0.0 and belief[KIND] == FLIES:
        _, speed, _, _, _ = platform_state(settings[FORCING], plan, belief[SINCE])
        learn(settings, memory, True, memory[ARRIVED] - speed, leaves - speed)
    return True, solid, leaves - GRAVITY * d


@rare_kernel
def learn(settings: Array, memory: Array, solid: bool, before: float, after: float) -> None:
    """Take in the relative velocities before and after one impact."""
    if settings[LEARNS] == 0.0 or not solid or before > -_WEAK:
        return
    found = -after / before
    if abs(found - settings[RESTITUTION]) < _FARTHEST_GUESS and 0.0 < found < 1.0:
        memory[EPSILON] += _GAIN * (found - memory[EPSILON])


@rare_kernel
def bounces_on(settings: Array, memory: Array, plan: Array, now: float) -> bool:
    """Whether the disk bounces so low, with no plan in force, that nothing can be done yet."""
    belief = memory[BELIEF : BELIEF + 4]
    _, speed, _, _, _ = platform_state(settings[FORCING], plan, belief[SINCE])
    low = belief[KIND] == FLIES and belief[VELOCITY] - speed < _LOW
    return low and is_still(offset_state(plan, now)) and not memory[AIM + T_2] > now


@rare_kernel
def on_course(settings: Array, targets: Array, memory: Array, plan: Array, now: float) -> bool:
    """Whether the plan in force does all that is needed: the disk comes, or is, onto the orbit."""
    state = memory[BELIEF : BELIEF + 4].copy()
    _, speed, _, _, _ = platform_state(settings[FORCING], plan, state[SINCE])
    slow = state[KIND] != FLIES or state[VELOCITY] - speed < _SLOW
    tolerance = _ROUGHLY if slow else _SAME
    if is_still(offset_state(plan, now)) and is_still(offset_state(plan, now + 1.5 * TWO_PI)):
        for target in targets:
            off = shortest_angle(state[SINCE], target[0])
            if abs(off) < _SAME and abs(state[VELOCITY] - target[1]) < _SAME:
                return memory[AIM + T_2] <= state[SINCE] + _SAME
    arrives = memory[AIM + T_2]
    if not arrives > state[SINCE]:
        return False
    for _ in range(_MOST):
        found, t, _ = next_event(
            settings[FORCING], memory[EPSILON], plan, state, arrives + tolerance
        )
        if found == NOTHING:
            return False
        if found == IMPACT and abs(t - arrives) < tolerance:
            return abs(state[VELOCITY] - memory[AIM + V_2]) < tolerance
    return False


# --- small-parameter feedback ---------------------------------------------------------------------
@rare_kernel
def small_speed(
    settings: Array, restitution: float, target: Array, off: float, fast: float
) -> float:
    """Velocity of the platform at the next impact, from the deviations of phase and velocity.

    Linear: both multipliers of the period-1 orbit are then 0.
    """
    e = restitution
    reach = math.pi * (1.0 + e)
    phase = off + reach * fast
    wanted = -phase / reach  # deviation of the velocity that makes the phase after next right
    own = -(1.0 + e) * settings[FORCING] * sine_cosine(target[0])[0] * phase + e * e * fast
    return (wanted - own) / (1.0 + e)


@rare_kernel
def plan_small(settings: Array, targets: Array, memory: Array, plan: Array, now: float) -> bool:
    """One small pulse at the next impact, cut to the limits; nothing far from the orbit."""
    belief, e = memory[BELIEF : BELIEF + 4], memory[EPSILON]
    target, trial = targets[0], np.empty_like(plan)
    n = keep_past(plan, now, trial)
    off = shortest_angle(belief[SINCE], target[0])
    fast = belief[VELOCITY] - target[1]
    if belief[KIND] != FLIES or max(abs(off) / _NEAR_PHASE, abs(fast) / _NEAR_SPEED) > 1.0:
        return go_back(settings, trial, n, plan, now)
    if max(abs(off), abs(fast)) < _SAME:
        return False
    at = natural_landing(settings, belief, now)
    if at == -math.inf and is_still(offset_state(plan, now)):
        _, at, _ = next_event(settings[FORCING], e, trial, belief.copy(), math.inf)
    if not now + 0.3 < at < math.inf:
        return False
    speed = small_speed(settings, e, target, off, fast)
    state = offset_state(plan, now)
    for _ in range(12):
        used = write_impact(trial, n, settings, now, state, at, 0.0, speed)
        span = pulse_time(settings, 0.0, speed)
        write_piece(trial[used], at, at + span, (0.0, speed, 0.0), ZERO)
        part = part_used(trial, n, used + 1, settings)
        if part <= 0.999:
            plan[:] = trial
            return True
        for i in range(n, used + 1):
            trial[i, 0] = math.inf
        speed *= max(0.5, 0.99 / part) if part < 4.0 else 0.5
    return False


@rare_kernel
def go_back(settings: Array, trial: Array, n: int, plan: Array, now: float) -> bool:
    """Lead the offset back to nothing, where it is not there."""
    state = offset_state(plan, now)
    if is_still(state) or not return_to_nothing(trial[n], settings, now, state):
        return False
    plan[:] = trial
    return True


@entry(
    types.boolean(
        types.float64[::1], types.float64[:, ::1], types.float64[::1], plan_type,
        types.float64, types.float64, types.boolean, types.float64,
    )
)  # fmt: skip
def hear(
    settings: Array, targets: Array, memory: Array, plan: Array, t: float, velocity: float,
    rests: bool, now: float,
) -> bool:  # fmt: skip
    """Take in an impact at t, known at `now`; True where the plan has changed from `now` on.

    `velocity`: of the disk just after it, nan: not known. `rests`: the disk has come to rest at t.
    """
    now = max(now, t)
    if settings[STRATEGY] == NONE:
        return False
    estimate(settings, memory, plan, t, velocity, rests)
    memory[HEARD] += 1.0
    if settings[OWN_ORBIT] != 0.0:
        targets[0, 0] = orbit_phase(settings[FORCING], memory[EPSILON])
    if memory[BELIEF + KIND] == UNKNOWN or bounces_on(settings, memory, plan, now):
        return False
    if settings[STRATEGY] == SMALL:
        return plan_small(settings, targets, memory, plan, now)
    if on_course(settings, targets, memory, plan, now):
        return False
    memory[AIM + T_2] = -math.inf
    belief, aim = memory[BELIEF : BELIEF + 4], memory[AIM : AIM + 2]
    return plan_toss(settings, memory[EPSILON], targets, belief, plan, now, aim)

"""Many closed loops at once, in the units of the next-collision map: plant, sensor, controller.

The plant is that of `flights`: a test compares it with the simulation. The controller is `hear`,
the very function that the node calls. Each start has draws of its own, decided by the seed and its
number alone.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.core.compilation import entry, rare_kernel
from bouncing_disk_ros.core.restitution import axial_push, rebound, speed_after
from bouncing_disk_ros.juggling.kernels.flights import (
    FLIES,
    IMPACT,
    KIND,
    LAUNCHED,
    NOTHING,
    POSITION,
    RESTED,
    RESTS,
    SINCE,
    VELOCITY,
    next_event,
    platform_state,
    sine_cosine,
)
from bouncing_disk_ros.juggling.kernels.offset_plan import (
    BEGIN,
    ROWS,
    Array,
    largest_acceleration,
    largest_position,
    new_plan,
)
from bouncing_disk_ros.juggling.kernels.strategies import hear, new_memory
from bouncing_disk_ros.juggling.kernels.toss_planner import FORCING, RESTITUTION
from bouncing_disk_ros.juggling.kernels.verdicts import (
    CAPTURED,
    COUNT,
    NEAR,
    REACHED,
    TALLY,
    VERDICT,
    note_impact,
)

P_RESTITUTION, DELAY, JITTER, MISSED, HEARS_VELOCITY, IMPULSE, IMPULSE_AT, DEADLINE = range(8)
"""Of the plant and the sensor: ε, delay and jitter (rad), part of impacts unheard, whether the
velocity is heard, change of velocity by an impulse, the begin of the period in which it acts, end
(rad)."""
PHASE_LAG, ANGULAR_FORCING = 8, 9
"""Of its rotation: θ (rad), Γ_T."""
PLANT = 10
R_VERDICT, R_IMPACTS, R_TIME, R_POSITION, R_ACCELERATION, R_COMMANDS, R_EVENTS = range(7)
"""Results: verdict, impacts and time until captured, largest offset, commands, impacts in all."""
R_ROTOR = 7
"""Mean angular velocity of the disk in the last periods of a run that was captured, ωΦ."""
RESULTS = 8
MEASURED = 10.0 * TWO_PI
"""Time up to the deadline over which that mean is taken, rad."""
SPEED, TURNED_AT, TURNED = range(3)
"""Of the rotor: angular velocity (ωΦ), since when, angle turned in the time that is measured."""

_WAITING = 64  # impacts on their way to the controller; the oldest is lost beyond
_IMPULSE_DRAW = 1 << 40  # number of the draw that an impulse's instant comes from
_BUDGET = 100_000  # impacts of one run


@entry(types.float64(types.int64, types.int64, types.int64))
def draw(seed: int, start: int, count: int) -> float:
    """A number in [0, 1) that these three decide: splitmix64."""
    z = np.uint64(seed) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(start) * np.uint64(
        0xD1342543DE82EF95
    )
    z += np.uint64(count + 1) * np.uint64(0x2545F4914F6CDD1D)
    for _ in range(2):
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) * 2.0**-53


@entry(types.float64(types.float64, types.float64, types.int64, types.int64, types.int64))
def sensor_error(missed: float, jitter: float, seed: int, start: int, number: int) -> float:
    """By how much the instant of an impact is heard late, in the unit of `jitter`; nan: missed.

    `missed`: part of the impacts that is never heard. `number`: of the impact in its run; with the
    seed and the number of the run it decides the draws.
    """
    if missed > 0.0 and draw(seed, start, 2 * number) < missed:
        return math.nan
    return float(jitter * (2.0 * draw(seed, start, 2 * number + 1) - 1.0))


@rare_kernel
def _run_start(
    settings: Array, orbit: Array, plant: Array, start: Array, tolerance: float, streak: int,
    seed: int, number: int, result: Array, trace: Array,
) -> None:  # fmt: skip
    """One start: see `run_loops`."""
    forcing, e = settings[FORCING], plant[P_RESTITUTION]
    plan, memory, waiting = new_plan(), new_memory(settings[RESTITUTION]), np.empty((_WAITING, 4))
    targets, state = orbit.copy(), start.copy()
    tally = np.zeros(TALLY)
    queued = drawn = 0
    impulse_at = math.inf
    if plant[IMPULSE] != 0.0:
        impulse_at = plant[IMPULSE_AT] + TWO_PI * draw(seed, number, _IMPULSE_DRAW)
    result[:] = 0.0
    rotor = np.zeros(3)
    rotor[TURNED_AT] = start[SINCE]
    if state[KIND] == FLIES:
        queued = report(plant, waiting, 0, state, False, seed, number, 0)
        drawn = 1
    while state[SINCE] < plant[DEADLINE] and tally[COUNT] < _BUDGET:
        heard_at = waiting[0, 0] if queued else math.inf
        until = min(heard_at, impulse_at, plant[DEADLINE])
        found, t, w = next_event(forcing, e, plan, state, until)
        if found == NOTHING and until == impulse_at:
            found, t, w = give_impulse(settings, plant, plan, state, until)
            impulse_at = math.inf
        elif found == NOTHING and until == heard_at:
            queued = deliver(settings, targets, memory, plan, waiting, queued, result)
        elif found == NOTHING:
            break
        if found in (IMPACT, RESTED):
            turn_rotor(plant, rotor, t, w)
            if tally[COUNT] < len(trace):
                trace[int(tally[COUNT])] = t, state[VELOCITY]
            rests = found == RESTED
            note_impact(tally, orbit, t, state[VELOCITY], rests, tolerance, streak)
            if tally[NEAR] == 1:
                result[R_TIME] = t - start[SINCE]
            queued = report(plant, waiting, queued, state, rests, seed, number, drawn)
            drawn += 1
    enter_verdict(plant, rotor, tally, start[SINCE], result)


@rare_kernel
def enter_verdict(plant: Array, rotor: Array, tally: Array, start: float, result: Array) -> None:
    """Write how a run ended that began at an instant."""
    result[R_VERDICT], result[R_EVENTS] = tally[VERDICT], tally[COUNT]
    if tally[VERDICT] == CAPTURED:
        result[R_IMPACTS], result[R_ROTOR] = tally[REACHED], mean_speed(plant, rotor, start)
    else:
        result[R_IMPACTS], result[R_TIME], result[R_ROTOR] = tally[COUNT], math.nan, math.nan


@rare_kernel
def turn_rotor(plant: Array, rotor: Array, t: float, w: float) -> None:
    """Change the angular velocity in an impact of relative velocity w: slip goes, up to friction.

    Contact does not turn the disk here: that matters for a few impacts after it only.
    """
    begin = max(rotor[TURNED_AT], plant[DEADLINE] - MEASURED)
    rotor[TURNED] += rotor[SPEED] * max(t - begin, 0.0)
    rotor[TURNED_AT] = t
    most = axial_push(-abs(w), plant[P_RESTITUTION]) / plant[ANGULAR_FORCING]
    rotor[SPEED] = speed_after(rotor[SPEED], sine_cosine(t + plant[PHASE_LAG])[1], most)


@rare_kernel
def mean_speed(plant: Array, rotor: Array, start: float) -> float:
    """Mean angular velocity over the time that is measured, which ends with the deadline."""
    end = plant[DEADLINE]
    begin = max(start, end - MEASURED)
    turned = rotor[TURNED] + rotor[SPEED] * max(end - max(rotor[TURNED_AT], begin), 0.0)
    return float(turned / (end - begin))


@rare_kernel
def give_impulse(
    settings: Array, plant: Array, plan: Array, state: Array, t: float
) -> tuple[int, float, float]:
    """Change the velocity of the disk: (what, when, w before it), as `next_event`.

    A disk at rest is launched, or pushed onto the platform: an impact.
    """
    change = plant[IMPULSE]
    if state[KIND] != RESTS:
        d = t - state[SINCE]
        state[POSITION] += d * (state[VELOCITY] - d / (2.0 * math.pi))
        state[VELOCITY] += change - d / math.pi
        state[SINCE] = t
        return LAUNCHED, t, 0.0
    t = max(t, state[SINCE])  # the last bounces of a chatter are over then
    x, speed, _, _, _ = platform_state(settings[FORCING], plan, t)
    u = change if change > 0.0 else rebound(change, plant[P_RESTITUTION])
    state[:] = (FLIES if u > 0.0 else RESTS, t, x, speed + u)
    if change > 0.0:
        return LAUNCHED, t, 0.0
    return (IMPACT if u > 0.0 else RESTED), t, change


@rare_kernel
def report(
    plant: Array, waiting: Array, queued: int, state: Array, rests: bool, seed: int, number: int,
    drawn: int,
) -> int:  # fmt: skip
    """Put an impact on its way to the controller, unless it is missed; how many are under way."""
    off = sensor_error(plant[MISSED], plant[JITTER], seed, number, drawn)
    if math.isnan(off) or queued == _WAITING:
        return queued
    waiting[queued, 0] = state[SINCE] + plant[DELAY] + plant[JITTER]
    waiting[queued, 1] = state[SINCE] + off
    waiting[queued, 2] = state[VELOCITY] if plant[HEARS_VELOCITY] != 0.0 else math.nan
    waiting[queued, 3] = 1.0 if rests else 0.0
    return queued + 1


@rare_kernel
def deliver(
    settings: Array, targets: Array, memory: Array, plan: Array, waiting: Array, queued: int,
    result: Array,
) -> int:  # fmt: skip
    """Let the controller hear of the oldest impact under way; how many are left."""
    now, at, velocity, rests = waiting[0]
    for k in range(1, queued):
        waiting[k - 1] = waiting[k]
    if hear(settings, targets, memory, plan, at, velocity, rests == 1.0, now):
        result[R_COMMANDS] += 1.0
        note_use(plan, result, now)
    return queued - 1


@rare_kernel
def note_use(plan: Array, result: Array, now: float) -> None:
    """Keep the largest position and acceleration that a plan asks for from now on."""
    for i in range(ROWS):
        if now <= plan[i, BEGIN] < math.inf:
            acceleration = largest_acceleration(plan[i])
            position = largest_position(plan[i], acceleration)
            result[R_ACCELERATION] = max(result[R_ACCELERATION], acceleration)
            result[R_POSITION] = max(result[R_POSITION], position)


@entry(
    types.void(
        types.float64[::1], types.float64[:, ::1], types.float64[::1], types.float64[:, ::1],
        types.float64, types.int64, types.int64, types.int64, types.float64[:, ::1],
        types.float64[:, ::1],
    )
)  # fmt: skip
def run_loops(
    settings: Array, orbit: Array, plant: Array, starts: Array, tolerance: float, streak: int,
    seed: int, first: int, results: Array, trace: Array,
) -> None:  # fmt: skip
    """Run each start (kind, instant, position, velocity after an impact there) to the deadline.

    Captured: near the orbit from some impact on until the end, at least `streak` of them; lost: so
    long, but not at the end. `trace`: rows (instant, velocity after) of the first start's impacts.
    """
    for i in range(len(starts)):
        _run_start(
            settings, orbit, plant, starts[i], tolerance, streak, seed, first + i, results[i],
            trace if i == 0 else trace[:0],
        )  # fmt: skip

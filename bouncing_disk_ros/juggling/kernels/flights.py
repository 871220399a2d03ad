"""Flights, impacts and rests of the disk on the platform Γ sin t + p(t), for kernels.

Units of the next-collision map (see `offset_plan`): gravity is 1/π. A state is an array of four:
whether the disk flies or rests, and the instant, position and velocity (absolute) that this flight
or rest began with. The offset moves up and down smoothly; its acceleration is bounded by the
`bound` given.
"""

from __future__ import annotations

import math

from bouncing_disk_ros.core.arithmetic import TWO_PI, rare_kernel, sincos
from bouncing_disk_ros.core.impact_law import rebound
from bouncing_disk_ros.juggling.kernels.offset_plan import Array, offset_state

KIND, SINCE, POSITION, VELOCITY = 0, 1, 2, 3
FLIES, RESTS, UNKNOWN = 0.0, 1.0, 2.0
"""Kinds of state; unknown: nothing was heard, or only the instant of one impact."""
NOTHING, IMPACT, RESTED, LAUNCHED = 0, 1, 2, 3
"""What `next_event` found."""
GRAVITY = 1.0 / math.pi
REST_SPEED = 1e-6
"""Slower than this after an impact, the rest of the chatter is summed."""
_STEPS = 400  # of one search; it takes ten or so
_CLOSE = 1e-14  # gap of an impact
_LOOK = 0.02  # rad, between looks for the end of a rest
_PAST_LAUNCH = 0.02  # rad after a launch at rest, before which the disk cannot land

Triple = tuple[float, float, float]


@rare_kernel
def apart(t: float, phase: float) -> float:
    """Shortest angular distance of an instant from a forcing phase, in [−π, π]."""
    off = t - phase
    return off - TWO_PI * math.floor(off / TWO_PI + 0.5)


@rare_kernel
def sine_cosine(t: float) -> tuple[float, float]:
    """Sine and cosine of t, with the same bits on every machine."""
    found: tuple[float, float] = sincos(t)
    return found


@rare_kernel
def platform_state(forcing: float, plan: Array, t: float) -> Triple:
    """Position, velocity and acceleration of the platform."""
    p, v, a = offset_state(plan, t)
    sine, cosine = sine_cosine(t)
    return forcing * sine + p, forcing * cosine + v, a - forcing * sine


@rare_kernel
def landing(
    forcing: float, bound: float, plan: Array, begin: float, x: float, v: float, start: float,
    until: float,
) -> float:  # fmt: skip
    """When a disk that left at `begin` with (x, v) meets the platform after `start`; inf: later.

    Steps within which the gap cannot close, for the relative acceleration is bounded.
    """
    most = GRAVITY + forcing + bound
    t = start
    for _ in range(_STEPS):
        d = t - begin
        s, w, _ = platform_state(forcing, plan, t)
        gap = x + d * (v - 0.5 * GRAVITY * d) - s
        speed = v - GRAVITY * d - w
        if gap <= _CLOSE and speed < 0.0:
            return t + gap / -speed
        gap = max(gap, 0.0)
        t += (speed + math.sqrt(speed * speed + 2.0 * most * gap)) / most
        if t > until:
            return math.inf
    return t


@rare_kernel
def launch(forcing: float, plan: Array, begin: float, until: float) -> float:
    """When the platform lets go of a disk at rest on it, from `begin` on; inf: later."""
    t = before = begin
    while True:
        if GRAVITY + platform_state(forcing, plan, t)[2] < 0.0:
            break
        if t >= until:
            return math.inf
        before, t = t, min(t + _LOOK, until)
    for _ in range(60):
        middle = 0.5 * (before + t)
        if not before < middle < t:
            break
        if GRAVITY + platform_state(forcing, plan, middle)[2] < 0.0:
            t = middle
        else:
            before = middle
    return t


@rare_kernel
def _collide(
    forcing: float, restitution: float, plan: Array, state: Array, t: float
) -> tuple[int, float, float]:
    s, w, a = platform_state(forcing, plan, t)
    before = state[VELOCITY] - GRAVITY * (t - state[SINCE]) - w
    leaves = rebound(before, restitution)
    state[KIND], state[SINCE], state[POSITION], state[VELOCITY] = FLIES, t, s, w + leaves
    pull = GRAVITY + a
    if leaves < REST_SPEED and pull > 0.0 and restitution < 1.0:
        end = t + 2.0 * leaves / (pull * (1.0 - restitution))
        s, w, _ = platform_state(forcing, plan, end)
        state[KIND], state[SINCE], state[POSITION], state[VELOCITY] = RESTS, end, s, w
        return RESTED, end, before
    return IMPACT, t, before


@rare_kernel
def next_event(
    forcing: float, restitution: float, bound: float, plan: Array, state: Array, until: float
) -> tuple[int, float, float]:
    """Go on to the next impact, rest or launch not after `until`: (what, when, w before it).

    The state is changed to that after it; it is left alone where nothing happens.
    """
    begin, x, v = state[SINCE], state[POSITION], state[VELOCITY]
    if state[KIND] == RESTS:
        t = launch(forcing, plan, begin, until)
        if t > until:
            return NOTHING, until, 0.0
        s, w, _ = platform_state(forcing, plan, t)
        state[KIND], state[SINCE], state[POSITION], state[VELOCITY] = FLIES, t, s, w
        return LAUNCHED, t, 0.0
    s, w, a = platform_state(forcing, plan, begin)
    leaves = v - w
    start = begin + max(2.0 * leaves / (GRAVITY + forcing + bound) * (1.0 - 1e-9), 0.0)
    if leaves <= REST_SPEED and GRAVITY + a <= 1e-3:
        start = begin + _PAST_LAUNCH
    t = landing(forcing, bound, plan, begin, x, v, start, until)
    if t > until:
        return NOTHING, until, 0.0
    return _collide(forcing, restitution, plan, state, t)

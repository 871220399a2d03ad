"""Flights, impacts and rests of the disk on the platform Γ sin t + p(t), by the core's functions.

Units of the next-collision map (see `offset_plan`): gravity is 1/π. A state is an array of four:
whether the disk flies or rests, and the instant, position and velocity (absolute) that this flight
or rest began with.
"""

from __future__ import annotations

import math

from bouncing_disk_ros.core.arithmetic import shortest_angle, sincos, wrapped
from bouncing_disk_ros.core.chatter import BOUNCES, chatter_end
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.contact_events import load, load_returns, separation
from bouncing_disk_ros.core.flight import Launch, gap_after
from bouncing_disk_ros.core.platform import Jet, Record, axial_jet, moved_motion
from bouncing_disk_ros.core.restitution import rebound
from bouncing_disk_ros.juggling.kernels.offset_plan import (
    BEGIN,
    DURATION,
    ROWS,
    Array,
    over_at,
    piece_at,
    table_of,
)
from bouncing_disk_ros.maps.axial_map import GRAVITY, MapDisk, axial_motion, landing

KIND, SINCE, POSITION, VELOCITY = 0, 1, 2, 3
FLIES, RESTS, UNKNOWN = 0.0, 1.0, 2.0
"""Kinds of state; unknown: nothing was heard, or only the instant of one impact."""
NOTHING, IMPACT, RESTED, LAUNCHED = 0, 1, 2, 3
"""What `next_event` found."""


@rare_kernel
def sine_cosine(t: float) -> tuple[float, float]:
    """Sine and cosine of t, with the same bits on every machine."""
    found: tuple[float, float] = sincos(t)
    return found


@rare_kernel
def platform_at(forcing: float, plan: Array, t: float) -> tuple[Record, float]:
    """The motion in force at an instant, at which its `elapsed` is 0, and until when it lasts."""
    i = piece_at(plan, t)
    row = plan[i]
    over = over_at(row)
    until = plan[i + 1, BEGIN] if i + 1 < ROWS else math.inf
    moves = t < over
    if moves:
        until = min(until, over)
    motion = axial_motion(forcing)
    return moved_motion(motion, moves, table_of(row), row[DURATION], t - row[BEGIN]), until


@rare_kernel
def platform_state(forcing: float, plan: Array, t: float) -> Jet:
    """Position, velocity and further derivatives of the platform."""
    motion, _ = platform_at(forcing, plan, t)
    sine, cosine = sine_cosine(t)
    found: Jet = axial_jet(motion, sine, cosine, 0.0)
    return found


@rare_kernel
def _collide(
    forcing: float, disk: MapDisk, plan: Array, state: Array, t: float, w: float
) -> tuple[int, float, float]:
    motion, ends = platform_at(forcing, plan, t)
    sine, cosine = sine_cosine(t)
    jet = axial_jet(motion, sine, cosine, 0.0)
    u = rebound(w, disk.restitution)
    state[:] = (FLIES, t, jet[0], jet[1] + u)
    waited = 0.0
    if u > 0.0:
        end, waited = chatter_end(motion, disk, jet, u)
        if end == BOUNCES or t + waited > ends:
            return IMPACT, t, w
    _put_on_platform(forcing, plan, state, RESTS, t + waited)
    return RESTED, t + waited, w


@rare_kernel
def _put_on_platform(forcing: float, plan: Array, state: Array, kind: float, t: float) -> None:
    """Change a state to that of a disk on the platform at an instant, with its velocity."""
    jet = platform_state(forcing, plan, t)
    state[:] = (kind, t, jet[0], jet[1])


@kernel
def _next_delay(
    motion: Record, disk: MapDisk, launch: Launch, jet: Jet, tau: float, flies: bool,
    horizon: float,
) -> tuple[float, float]:  # fmt: skip
    """Delay of the impact of a disk that flies, and its w_A, or of the launch of one that rests."""
    start = 0.0
    if not flies:
        if load(motion, GRAVITY, jet)[1]:
            start = separation(motion, disk, 0.0, tau, horizon).zero
        return start, 0.0
    if launch.gap == 0.0 and launch.u == 0.0:
        start = load_returns(motion, disk, 0.0, tau, horizon).zero
        if start > horizon:
            return math.inf, 0.0
    found: tuple[float, float] = landing(motion, launch, jet, start, horizon)
    return found


@rare_kernel
def next_event(
    forcing: float, restitution: float, plan: Array, state: Array, until: float
) -> tuple[int, float, float]:
    """Go on to the next impact, rest or launch not after `until`: (what, when, w before it).

    The state is changed to that after it; it is left alone where nothing happens.
    """
    disk = MapDisk(restitution, GRAVITY, 0.0, 0.0, 0.0)
    t, flies = state[SINCE], state[KIND] == FLIES
    gap = u = 0.0
    if flies:
        s, v, _, _, _ = platform_state(forcing, plan, t)
        gap, u = max(state[POSITION] - s, 0.0), state[VELOCITY] - v
    while True:
        motion, ends = platform_at(forcing, plan, t)
        sine, cosine = sine_cosine(t)
        jet = axial_jet(motion, sine, cosine, 0.0)
        launch = Launch(0.0, sine, cosine, GRAVITY, gap, u)
        horizon = min(ends, until) - t
        tau = wrapped(shortest_angle(t, 0.0))
        d, w = _next_delay(motion, disk, launch, jet, tau, flies, horizon)
        if d <= horizon and flies:
            return _collide(forcing, disk, plan, state, t + d, w)
        if d <= horizon:
            _put_on_platform(forcing, plan, state, FLIES, t + d)
            return LAUNCHED, t + d, 0.0
        if not ends < until:
            return NOTHING, until, 0.0
        if flies:
            fallen = gap_after(motion, launch, ends - t)
            gap, u = max(fallen[0], 0.0), fallen[1]
        t = ends

"""Find the next event: computed once, with a horizon fixed by state and inputs, and stored."""

from __future__ import annotations

import math

from bouncing_disk_ros.core.arithmetic import kernel
from bouncing_disk_ros.core.clock import clock_after, elapsed, instant_of, seconds_between
from bouncing_disk_ros.core.contact import (
    load_returns,
    period_of,
    separation,
    slip_ends,
    stick_fails,
)
from bouncing_disk_ros.core.flight import first_impact, separation_phase
from bouncing_disk_ros.core.impact import (
    BOUNCES,
    STILL,
    chatter_verdict,
)
from bouncing_disk_ros.core.layout import (
    CHATTER_ENDS,
    FLIGHT,
    IMPACT,
    NEVER,
    NOTHING,
    SEPARATION,
    SKIP,
    SLIP,
    SLIP_ENDS,
    STEADY,
    STICKING,
    STILLED,
)
from bouncing_disk_ros.core.platform import Jet, Record, angular_jet, axial_jet

# A slip that begins less than this before separation (rad) changes α̇ by its square: rule 5, stick
# until then.
_LAST_SLIP = 1e-8
# Events are looked for a little past the boundary, s; the exact comparison is made with their
# instant.
_PAST_BOUNDARY = 2e-9


_LONGEST = 1e8  # s: longer waits go in several steps, so that whole nanoseconds never overflow


@kernel
def find_next(state: Record, motion: Record, disk: Record, boundary_ns: int) -> None:
    """Store the next event up to boundary_ns (an input or an end of a cross-fade) in the state."""
    horizon = math.inf
    if boundary_ns != NEVER:
        horizon = seconds_between(state.ns, state.sub, boundary_ns, 0.0) + _PAST_BOUNDARY
    since = elapsed(motion, state.ns, state.sub)
    if state.phase == FLIGHT:
        kind, d, value = _after_flight(state, motion, disk, since, horizon)
    elif state.phase == STICKING:
        kind, d, value = after_sticking(state, motion, disk, since, horizon)
    else:
        kind, d, value = after_sliding(state, motion, disk, since, horizon)
    _store(state, motion, disk, kind, d, value)
    late = state.event_ns > boundary_ns or (state.event_ns == boundary_ns and state.event_sub > 0.0)
    if state.event == NOTHING or late:
        state.event = NOTHING
        state.event_ns = NEVER


@kernel
def _after_flight(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> tuple[int, float, float]:
    start = 0.0
    s, c = state.sine, state.cosine
    jet = axial_jet(motion, s, c, since)
    if state.gap == 0.0:
        if state.u == 0.0:  # launched: no root before the platform can come back (rule 2)
            start = load_returns(motion, disk, since, state.tau, horizon)
        elif state.u > 0.0:
            kind, d, value = _chatter(state, motion, disk, jet, since, horizon)
            if kind != NOTHING:
                return kind, d, value
    d, w = first_impact(motion, since, s, c, jet, disk.g, state.gap, state.u, start, horizon)
    if d > horizon or d == math.inf:
        return NOTHING, 0.0, 0.0
    return IMPACT, d, w


@kernel
def _chatter(
    state: Record, motion: Record, disk: Record, s: Jet, since: float, horizon: float
) -> tuple[int, float, float]:
    """Complete chattering in closed form, where that is exact and friction's part decided."""
    u = state.u
    sine, cosine = state.sine, state.cosine
    end, t, sign = chatter_verdict(motion, disk, since, sine, cosine, s, u, state.omega)
    if end == STILL:
        return CHATTER_ENDS, 0.0, STILLED
    if end == BOUNCES or t + _PAST_BOUNDARY > horizon:
        return NOTHING, 0.0, 0.0
    return CHATTER_ENDS, t, sign


@kernel
def after_sticking(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> tuple[int, float, float]:
    """Next event of a disk that sticks: (kind, delay, value)."""
    leave = separation(motion, disk, since, state.tau, horizon)
    fail, sign = stick_fails(motion, disk, since, state.tau, min(horizon, leave))
    if leave != math.inf and (leave - fail) * motion.omega_max <= _LAST_SLIP:
        fail = math.inf
    if fail < leave:
        return SLIP, fail, -sign
    if leave == math.inf:
        return NOTHING, 0.0, 0.0
    return SEPARATION, leave, 0.0


@kernel
def after_sliding(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> tuple[int, float, float]:
    """Next event of a disk that slides: (kind, delay, value)."""
    leave = separation(motion, disk, since, state.tau, horizon)
    b = angular_jet(motion, state.sine, state.cosine, since)
    w = max(state.slip_sign * (state.omega - b[1]), 0.0)
    stop, skip = slip_ends(motion, disk, since, state.tau, state.slip_sign, w, min(horizon, leave))
    if stop < leave:
        return SLIP_ENDS, stop, 0.0
    if leave != math.inf:
        return SEPARATION, leave, 0.0
    if skip > 0:
        periods = math.floor(min(float(skip), _LONGEST / period_of(motion)))
        return SKIP, periods * period_of(motion), float(periods)
    return NOTHING, 0.0, 0.0


@kernel
def _store(state: Record, motion: Record, disk: Record, kind: int, d: float, value: float) -> None:
    state.event = kind
    state.event_delay = d
    state.event_value = value
    if kind == NOTHING or d > 30.0 * _LONGEST:  # a century is never
        state.event = NOTHING
        return
    ns, sub, cycles, tau = clock_after(motion, state.ns, state.sub, state.cycles, state.tau, d)
    if motion.kind == STEADY and kind in (SKIP, SEPARATION):
        if kind == SKIP:  # whole periods: the phase is the same to the bit
            cycles, tau = state.cycles + int(value), state.tau
        else:
            tau = separation_phase(motion, disk.g)
            cycles = state.cycles + (1 if tau < state.tau else 0)
        ns, sub = instant_of(motion, cycles, tau)
    state.event_ns = ns
    state.event_sub = sub
    state.event_cycles = cycles
    state.event_tau = tau

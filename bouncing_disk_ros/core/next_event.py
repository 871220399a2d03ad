"""Find the next event: computed once, with a horizon fixed by state and inputs, and stored."""

from __future__ import annotations

import math
from typing import NamedTuple

from bouncing_disk_ros.core.arithmetic import kernel
from bouncing_disk_ros.core.bounds import span_from
from bouncing_disk_ros.core.contact import (
    load_returns,
    period_of,
    separation,
    slip_ends,
    stick_fails,
)
from bouncing_disk_ros.core.flight import search_impact, separation_phase
from bouncing_disk_ros.core.forcing_clock import clock_after, elapsed, instant_of, seconds_between
from bouncing_disk_ros.core.impact_law import (
    BOUNCES,
    STILL,
    chatter_verdict,
)
from bouncing_disk_ros.core.layout import (
    CHATTER_ENDS,
    FAULT,
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
    WAYPOINT,
)
from bouncing_disk_ros.core.platform import Jet, Record, angular_jet, axial_jet

# A slip that begins less than this before separation (rad) changes α̇ by its square: rule 5, stick
# until then.
_LAST_SLIP = 1e-8
# Events are looked for a little past the boundary, s; the exact comparison is made with their
# instant.
_PAST_BOUNDARY = 2e-9


# s: longer waits go in several steps, so that whole nanoseconds never overflow and the phase that
# grows in one search keeps its whole turns
_LONGEST = 1e8
SLIDE_PERIODS = 8.0
"""Periods of one piece of a slide in a cross-fade."""
_QUADRATURE_STEPS = 500  # of a search take the time of the energy of one such piece
_STEPS_PER_EVENT = 16  # so many steps of a search cost as much as one event


class NextEvent(NamedTuple):
    """An event: its kind, when it comes (s), its value, and the steps that its search took."""

    kind: int
    delay: float
    value: float
    steps: int


@kernel
def find_next(state: Record, motion: Record, disk: Record, boundary_ns: int) -> int:
    """Store the next event up to boundary_ns (an input or an end of a cross-fade) in the state.

    A search that needs many steps ends at a waypoint. Returns what it cost, in events.
    """
    horizon = math.inf
    if boundary_ns != NEVER:
        horizon = seconds_between(state.ns, state.sub, boundary_ns, 0.0) + _PAST_BOUNDARY
    since = elapsed(motion, state.ns, state.sub)
    if motion.kind != STEADY:
        horizon = min(horizon, max(motion.duration - since, 0.0))
    if state.phase == FLIGHT:
        found = _after_flight(state, motion, disk, since, horizon)
    elif state.phase == STICKING:
        found = after_sticking(state, motion, disk, since, horizon)
    else:
        found = after_sliding(state, motion, disk, since, horizon)
    known = state.gap + state.u + state.omega + state.angle + state.tau
    known += found.delay + found.value
    if not math.isfinite(known):
        state.event = FAULT
        return 1
    _store(state, motion, disk, found.kind, found.delay, found.value)
    late = state.event_ns > boundary_ns or (state.event_ns == boundary_ns and state.event_sub > 0.0)
    if state.event == NOTHING or late:
        state.event = NOTHING
        state.event_ns = NEVER
    return 1 + found.steps // _STEPS_PER_EVENT


@kernel
def _after_flight(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    start, steps = 0.0, 0
    sine, cosine = state.sine, state.cosine
    jet = axial_jet(motion, sine, cosine, since)
    if state.gap == 0.0:
        if state.u == 0.0:  # launched: no root before the platform can come back (rule 2)
            returns = load_returns(motion, disk, since, state.tau, horizon)
            if returns.zero == math.inf:
                return _stopped(returns.reached, horizon, returns.steps)
            start, steps = returns.zero, returns.steps
        elif state.u > 0.0:
            chatter = _chatter(state, motion, disk, jet, since, horizon)
            if chatter.kind != NOTHING:
                return chatter
    within = min(horizon, start + _LONGEST)
    d, w, more = search_impact(
        motion, since, sine, cosine, jet, disk.g, state.gap, state.u, start, within
    )
    if w > 0.0:
        return _stopped(d, horizon, steps + more)
    if d > within or d == math.inf:
        return _stopped(within, horizon, steps + more)
    return NextEvent(IMPACT, d, w, steps + more)


@kernel
def _stopped(reached: float, horizon: float, steps: int) -> NextEvent:
    """A waypoint where a search has stopped, or nothing if that is its horizon."""
    if reached >= horizon:
        return NextEvent(NOTHING, 0.0, 0.0, steps)
    return NextEvent(WAYPOINT, reached, 0.0, steps)


@kernel
def _chatter(
    state: Record, motion: Record, disk: Record, s: Jet, since: float, horizon: float
) -> NextEvent:
    """Complete chattering in closed form, where that is exact and friction's part decided."""
    u = state.u
    sine, cosine = state.sine, state.cosine
    end, t, sign = chatter_verdict(motion, disk, since, sine, cosine, s, u, state.omega)
    if end == STILL:
        return NextEvent(CHATTER_ENDS, 0.0, STILLED, 0)
    if end == BOUNCES or t + _PAST_BOUNDARY > horizon:
        return NextEvent(NOTHING, 0.0, 0.0, 0)
    return NextEvent(CHATTER_ENDS, t, sign, 0)


@kernel
def after_sticking(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk that sticks."""
    leave = separation(motion, disk, since, state.tau, horizon)
    until = min(leave.reached, leave.zero)
    fail, sign = stick_fails(motion, disk, since, state.tau, min(horizon, until))
    steps = leave.steps + fail.steps
    near = fail.zero <= until and (until - fail.zero) * motion.omega_max <= _LAST_SLIP
    if near and leave.zero == math.inf and until < horizon and fail.zero > 0.0:
        # whether separation follows at once is not known yet
        return NextEvent(WAYPOINT, fail.zero, 0.0, steps)
    if fail.zero < until and not (near and leave.zero != math.inf):
        return NextEvent(SLIP, fail.zero, -sign, steps)
    if fail.zero == math.inf and fail.reached < until:
        return NextEvent(WAYPOINT, fail.reached, 0.0, steps)
    if leave.zero == math.inf:
        return _stopped(until, horizon, steps)
    return NextEvent(SEPARATION, leave.zero, 0.0, steps)


@kernel
def after_sliding(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk that slides.

    In a cross-fade a slide is propagated in pieces: its energy takes quadrature, whose work is to
    be bounded.
    """
    within = horizon
    if motion.kind != STEADY:
        within = min(horizon, span_from(motion, since, motion.duration, SLIDE_PERIODS))
    leave = separation(motion, disk, since, state.tau, within)
    until = min(leave.reached, leave.zero)
    b = angular_jet(motion, state.sine, state.cosine, since)
    w = max(state.slip_sign * (state.omega - b[1]), 0.0)
    stop, skip = slip_ends(motion, disk, since, state.tau, state.slip_sign, w, until)
    steps = leave.steps + stop.steps + (0 if motion.kind == STEADY else _QUADRATURE_STEPS)
    if stop.zero < until or (stop.zero == until < math.inf and leave.zero == math.inf):
        return NextEvent(SLIP_ENDS, stop.zero, 0.0, steps)
    if stop.zero == math.inf and stop.reached < until:
        return NextEvent(WAYPOINT, stop.reached, 0.0, steps)
    if leave.zero != math.inf:
        return NextEvent(SEPARATION, leave.zero, 0.0, steps)
    if skip > 0:
        periods = math.floor(min(float(skip), _LONGEST / period_of(motion)))
        return NextEvent(SKIP, periods * period_of(motion), float(periods), steps)
    return _stopped(until, horizon, steps)


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

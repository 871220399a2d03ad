"""The next event of a disk in contact: separation, or a change between sticking and slipping."""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import entry, kernel
from bouncing_disk_ros.core.bounds import span_from
from bouncing_disk_ros.core.brake import brake_event
from bouncing_disk_ros.core.contact import period_of, separation, slip_ends, stick_fails, stopped
from bouncing_disk_ros.core.layout import (
    DISK,
    LONGEST,
    MOTION,
    NEXT_EVENT,
    NOTHING,
    SEPARATION,
    SKIP,
    SLIDING,
    SLIP,
    SLIP_ENDS,
    STATE,
    STEADY,
    STICKING,
    WAYPOINT,
    NextEvent,
)
from bouncing_disk_ros.core.platform import Record, angular_jet

# A slip that begins less than this before separation (rad) changes α̇ by its square: rule 5, stick
# until then.
_LAST_SLIP = 1e-8
SLIDE_PERIODS = 8.0
"""Periods of one piece of a slide in a cross-fade."""
_QUADRATURE_STEPS = 500  # of a search take the time of the energy of one such piece


@kernel
def after_sticking(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk that sticks."""
    leave = separation(motion, disk, since, state.tau, horizon)
    until = min(leave.reached, leave.zero)
    fail, sign = stick_fails(motion, disk, state.drag, since, state.tau, min(horizon, until))
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
        return stopped(until, horizon, steps)
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
    stop, skip = slip_ends(motion, disk, state.drag, since, state.tau, state.slip_sign, w, until)
    steps = leave.steps + stop.steps + (0 if motion.kind == STEADY else _QUADRATURE_STEPS)
    if stop.zero < until or (stop.zero == until < math.inf and leave.zero == math.inf):
        return NextEvent(SLIP_ENDS, stop.zero, 0.0, steps)
    if stop.zero == math.inf and stop.reached < until:
        return NextEvent(WAYPOINT, stop.reached, 0.0, steps)
    if leave.zero != math.inf:
        return NextEvent(SEPARATION, leave.zero, 0.0, steps)
    if skip > 0:
        periods = math.floor(min(float(skip), LONGEST / period_of(motion)))
        return NextEvent(SKIP, periods * period_of(motion), float(periods), steps)
    return stopped(until, horizon, steps)


@kernel
def after_held(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk that its brake holds, but for those of the brake."""
    within = horizon
    if motion.kind != STEADY:  # its energy takes quadrature, as that of a slide
        within = min(horizon, span_from(motion, since, motion.duration, SLIDE_PERIODS))
    leave = separation(motion, disk, since, state.tau, within)
    steps = leave.steps + (0 if motion.kind == STEADY else _QUADRATURE_STEPS)
    if leave.zero == math.inf:
        return stopped(leave.reached, horizon, steps)
    return NextEvent(SEPARATION, leave.zero, 0.0, steps)


@entry(NEXT_EVENT(STATE.dtype, MOTION.dtype, DISK.dtype, types.float64, types.float64))
def after_contact(
    state: Record, motion: Record, disk: Record, since: float, horizon: float
) -> NextEvent:
    """Next event of a disk in contact, up to `horizon` s ahead."""
    if state.phase == STICKING:
        found = after_sticking(state, motion, disk, since, horizon)
    elif state.phase == SLIDING:
        found = after_sliding(state, motion, disk, since, horizon)
    else:
        found = after_held(state, motion, disk, since, horizon)
    if disk.brake > 0.0:
        until = horizon if found.kind == NOTHING else found.delay
        sooner = brake_event(state, motion, disk, since, until)
        steps = found.steps + sooner.steps
        if sooner.kind != NOTHING:
            return NextEvent(sooner.kind, sooner.delay, sooner.value, steps)
    return found

"""Find the next event: computed once, with a horizon fixed by state and inputs, and stored.

Flight and contact are compiled by themselves, in two processes at a time (`kernel_cache`).
"""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import chosen_by_motion, kernel, part
from bouncing_disk_ros.core.contact_event import after_contact
from bouncing_disk_ros.core.flight import separation_phase
from bouncing_disk_ros.core.flight_event import after_flight
from bouncing_disk_ros.core.forcing_clock import (
    clock_after,
    elapsed,
    instant_of,
    phase_of,
    seconds_between,
)
from bouncing_disk_ros.core.layout import (
    DISK,
    FAULT,
    FLIGHT,
    LONGEST,
    MOTION,
    NEVER,
    NOTHING,
    PAST_BOUNDARY,
    SEPARATION,
    SKIP,
    STATE,
    STEADY,
)
from bouncing_disk_ros.core.platform import Record

_STEPS_PER_EVENT = 16  # so many steps of a search cost as much as one event


@kernel
def _store(state: Record, motion: Record, disk: Record, kind: int, d: float, value: float) -> None:
    state.event = kind
    state.event_delay = d
    state.event_value = value
    if kind == NOTHING or d > 30.0 * LONGEST:  # a century is never
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


@chosen_by_motion
def rounding_at_knot(_motion: Record, _time: float) -> float:
    """What rounding may put an event past a knot, s, `time` s after the origin; 0: no offset."""
    return 0.0


@kernel
def _take_to_knot(state: Record, motion: Record, boundary_ns: int, rounding: float) -> None:
    """An event that only rounding, s, puts after a knot of an offset belongs before it."""
    past = -seconds_between(state.event_ns, state.event_sub, boundary_ns, 0.0)
    if 0.0 < past <= rounding:
        state.event_ns = boundary_ns
        state.event_sub = 0.0
        state.event_cycles, state.event_tau = phase_of(motion, boundary_ns, 0.0)


@part(STATE.dtype, MOTION.dtype, DISK.dtype, types.int64)
def find_next(state: Record, motion: Record, disk: Record, boundary_ns: int) -> int:
    """Store the next event up to boundary_ns (an input or an end of a cross-fade) in the state.

    A search that needs many steps ends at a waypoint. Returns what it cost, in events.
    """
    horizon = math.inf
    if boundary_ns != NEVER:
        horizon = seconds_between(state.ns, state.sub, boundary_ns, 0.0) + PAST_BOUNDARY
    since = elapsed(motion, state.ns, state.sub)
    if motion.kind != STEADY:
        horizon = min(horizon, max(motion.duration - since, 0.0))
    if state.phase == FLIGHT:
        found = after_flight(state, motion, disk, since, horizon)
    else:
        found = after_contact(state, motion, disk, since, horizon)
    known = state.gap + state.u + state.omega + state.angle + state.tau
    known += found.delay + found.value
    if not math.isfinite(known):
        state.event = FAULT
        return 1
    _store(state, motion, disk, found.kind, found.delay, found.value)
    if state.event != NOTHING and boundary_ns != NEVER:
        _take_to_knot(state, motion, boundary_ns, rounding_at_knot(motion, since + found.delay))
    late = state.event_ns > boundary_ns or (state.event_ns == boundary_ns and state.event_sub > 0.0)
    if state.event == NOTHING or late:
        state.event = NOTHING
        state.event_ns = NEVER
    return 1 + found.steps // _STEPS_PER_EVENT

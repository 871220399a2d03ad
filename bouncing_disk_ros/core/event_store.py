"""Store an event that was found in the state, with the clock at its instant.

Compiled by itself, beside the search for events (`kernel_cache`).
"""

from __future__ import annotations

from numba import types

from bouncing_disk_ros.core.arithmetic import chosen_by_motion, kernel, part
from bouncing_disk_ros.core.flight import separation_phase
from bouncing_disk_ros.core.forcing_clock import clock_after, instant_of, phase_of, seconds_between
from bouncing_disk_ros.core.layout import (
    DISK,
    LONGEST,
    MOTION,
    NEVER,
    NOTHING,
    SEPARATION,
    SKIP,
    STATE,
    STEADY,
)
from bouncing_disk_ros.core.platform import Record


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


@part(
    STATE.dtype,
    MOTION.dtype,
    DISK.dtype,
    types.int64,
    types.float64,
    types.float64,
    types.int64,
    types.float64,
)
def store_event(
    state: Record,
    motion: Record,
    disk: Record,
    kind: int,
    d: float,
    value: float,
    boundary_ns: int,
    since: float,
) -> None:
    """Store an event of this kind, d seconds after the state, with its value and its clock.

    boundary_ns is the end of the search; the state is `since` s after the motion's origin.
    """
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
    if boundary_ns != NEVER:
        _take_to_knot(state, motion, boundary_ns, rounding_at_knot(motion, since + d))

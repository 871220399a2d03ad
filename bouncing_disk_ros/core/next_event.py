"""Find the next event: computed once, with a horizon fixed by state and inputs, and stored.

What it calls is compiled by itself, in two processes side by side (`kernel_cache`).
"""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import part
from bouncing_disk_ros.core.contact_event import after_contact
from bouncing_disk_ros.core.event_store import store_event
from bouncing_disk_ros.core.flight_event import after_flight
from bouncing_disk_ros.core.forcing_clock import elapsed, seconds_between
from bouncing_disk_ros.core.layout import (
    DISK,
    FAULT,
    FLIGHT,
    MOTION,
    NEVER,
    NOTHING,
    PAST_BOUNDARY,
    STATE,
    STEADY,
)
from bouncing_disk_ros.core.platform import Record, fade_end
from bouncing_disk_ros.core.roots import ROUNDING

_STEPS_PER_EVENT = 16  # so many steps of a search cost as much as one event


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
        until = fade_end(motion)
        left = max(until - since, 0.0)
        if state.phase == FLIGHT:  # an impact may be due at the very end
            left += 8.0 * ROUNDING * until
        horizon = min(horizon, left)
    if state.phase == FLIGHT:
        found = after_flight(state, motion, disk, since, horizon)
    else:
        found = after_contact(state, motion, disk, since, horizon)
    known = state.gap + state.u + state.omega + state.angle + state.tau
    known += found.delay + found.value
    if not math.isfinite(known):
        state.event = FAULT
        return 1
    store_event(state, motion, disk, found.kind, found.delay, found.value, boundary_ns)
    late = state.event_ns > boundary_ns or (state.event_ns == boundary_ns and state.event_sub > 0.0)
    if state.event == NOTHING or late:
        state.event = NOTHING
        state.event_ns = NEVER
    return 1 + found.steps // _STEPS_PER_EVENT

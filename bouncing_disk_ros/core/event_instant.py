"""The instant of an event that was found: the state gets its clock; an input may be due with it."""

from __future__ import annotations

from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.flight import (
    Launch,
    flies_far,
    flown_far,
    gap_after,
    separation_phase,
)
from bouncing_disk_ros.core.forcing_clock import (
    Clock,
    clock_after,
    elapsed,
    instant_of,
    phase_of,
    seconds_between,
)
from bouncing_disk_ros.core.layout import (
    IMPACT,
    LONGEST,
    NEVER,
    NOTHING,
    SEPARATION,
    SKIP,
    STEADY,
)
from bouncing_disk_ros.core.platform import Record, frequency_at
from bouncing_disk_ros.core.roots import ROUNDING


@kernel
def instant_rounding(state: Record, motion: Record, d: float) -> float:
    """How well an instant d seconds after the state is known, s: two within it are the same.

    The state's own instant is a whole nanosecond and a part of one, however long a cross-fade has
    lasted; what is rounded is d, and the forcing phase: on the scale of the period then, not of the
    period before the cross-fade, which may be ten million times as long.
    """
    if motion.kind == STEADY:
        return 8.0 * ROUNDING * (d + 1.0 / motion.f)
    period = 1.0 / frequency_at(motion, elapsed(motion, state.ns, state.sub) + d)
    return 8.0 * ROUNDING * (d + min(motion.duration, period))


@kernel
def take_to_input(state: Record, motion: Record, disk: Record, ns: int) -> bool:
    """Take an event within rounding of an input at ns to the input's instant: it goes first.

    Returns whether it did. The instant is made of a forcing phase and a delay, which are rounded.
    An event after a state that is at the input's instant already keeps its own: so time goes on.
    """
    past = seconds_between(ns, 0.0, state.event_ns, state.event_sub)
    if past == 0.0 or seconds_between(state.ns, state.sub, ns, 0.0) <= 0.0:
        return False
    is_there = abs(past) <= instant_rounding(state, motion, state.event_delay)
    if not (is_there or (state.event == IMPACT and _hits_at(state, motion, disk, past))):
        return False
    state.event_ns = ns
    state.event_sub = 0.0
    if motion.kind != STEADY or state.event != SEPARATION:  # which keeps its phase
        state.event_cycles, state.event_tau = phase_of(motion, ns, 0.0)
    return True


@rare_kernel
def _hits_at(state: Record, motion: Record, disk: Record, past: float) -> bool:
    """Whether an impact may as well be `past` seconds earlier; then it is.

    There the gap is as large as its rounding, the disk coming down: where both are slow, as at the
    top of a flight, that is more than the rounding of an instant.
    """
    d = state.event_delay - past
    lengths = state.gap + (abs(state.u) + disk.g * d) * d
    if past < 0.0 or -past * state.event_value > 8.0 * ROUNDING * lengths:
        return False
    before = elapsed(motion, state.ns, state.sub)
    launch = Launch(before, state.sine, state.cosine, disk.g, state.gap, state.u)
    w = gap_after(motion, launch, d)[1]
    if w >= 0.0:
        return False
    state.event_delay, state.event_value = d, w
    return True


@rare_kernel
def _see_platform_at_its_phase(state: Record, motion: Record, launch: Launch, d: float) -> None:
    """Compute w_A of the stored impact, d seconds on, with the platform's speed at its phase."""
    then, tau = elapsed(motion, state.event_ns, state.event_sub), state.event_tau
    _, w = flown_far(motion, launch, d, then, tau)
    if w < 0.0:  # else the rounding of a graze
        state.event_value = w


@kernel
def store_event(
    state: Record,
    motion: Record,
    disk: Record,
    kind: int,
    d: float,
    value: float,
    boundary_ns: int,
) -> None:
    """Store an event of this kind, d seconds after the state, with its value and its clock.

    boundary_ns is the end of the search, where an input acts.
    """
    state.event = kind
    state.event_delay = d
    state.event_value = value
    if kind == NOTHING or d > 30.0 * LONGEST:  # a century is never
        state.event = NOTHING
        return
    clock = Clock(state.ns, state.sub, state.cycles, state.tau)
    if d > 0.0:  # else it is at the state's own instant, which for an input is a whole nanosecond
        clock = clock_after(motion, clock, d)
    ns, sub, cycles, tau = clock
    if motion.kind == STEADY and kind in (SKIP, SEPARATION) and d > 0.0:
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
        take_to_input(state, motion, disk, boundary_ns)
    if kind == IMPACT:
        d = state.event_delay
        before = elapsed(motion, state.ns, state.sub)
        launch = Launch(before, state.sine, state.cosine, disk.g, state.gap, state.u)
        if flies_far(motion, launch, d):
            _see_platform_at_its_phase(state, motion, launch, d)

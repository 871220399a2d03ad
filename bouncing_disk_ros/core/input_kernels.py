"""Entry points from Python: stop a state at an instant, apply inputs to it, observe it."""

from __future__ import annotations

import numpy as np
from numba import from_dtype, types

from bouncing_disk_ros.core.brake import sign_of
from bouncing_disk_ros.core.compilation import entry
from bouncing_disk_ros.core.energy_ledger import Ledger, add_entry, mechanical_energy
from bouncing_disk_ros.core.event_instant import instant_rounding, take_to_input
from bouncing_disk_ros.core.forcing_clock import Clock, elapsed, phase_of, seconds_between
from bouncing_disk_ros.core.impact_log import CHATTER_CUT, ROWS, Rows, close_row
from bouncing_disk_ros.core.layout import (
    DISK,
    FAULT,
    FLIGHT,
    LEDGER,
    MOTION,
    NOTHING,
    STATE,
    STICKING,
    UNKNOWN,
    W_IMPULSES,
    W_PARAMETERS,
)
from bouncing_disk_ros.core.platform import Record, angular_jet, axial_jet
from bouncing_disk_ros.core.propagate import (
    begin_contact,
    classify_contact,
    platform_spin,
    propagate,
    set_clock,
)

OBSERVED = np.dtype(
    [(name, "f8") for name in ("s", "s1", "b", "b1", "force", "torque", "energy", "kinetic")]
)
_OBSERVED = from_dtype(OBSERVED)[::1]
_INT, _FLOAT = types.int64, types.float64


@entry(_INT(STATE, MOTION, DISK, LEDGER, ROWS, ROWS, _INT))
def advance_to(
    states: Record,
    motion: Record,
    disk: Record,
    ledger: Ledger,
    rows: Rows,
    open_row: Rows,
    ns: int,
) -> int:
    """Propagate the state to an input at ns, before its next event; returns rows.

    An impact within rounding before the input is at its instant, as `take_to_input` has it.
    """
    state = states[0]
    d = seconds_between(state.ns, state.sub, ns, 0.0)
    if d > 0.0:
        clock = Clock(ns, 0.0, *phase_of(motion[0], ns, 0.0))
        launched = state.phase == FLIGHT and state.gap == 0.0
        if launched and d <= instant_rounding(state, motion[0], 0.0):
            set_clock(state, clock)
        else:
            propagate(state, motion[0], disk[0], ledger, d, clock)
    state.event = UNKNOWN
    if state.phase == FLIGHT and state.gap < 0.0:
        state.gap = 0.0  # rounding: an impact has just been or is just to come
    return close_row(open_row, rows, 0, state, CHATTER_CUT)


@entry(types.boolean(STATE, MOTION, DISK, _INT))
def take_due(states: Record, motion: Record, disk: Record, ns: int) -> bool:
    """Take the next event to an input at ns where only rounding puts it after that; if it did."""
    if states[0].event in (UNKNOWN, NOTHING, FAULT):
        return False
    return take_to_input(states[0], motion[0], disk[0], ns)


@entry(types.void(STATE, MOTION, DISK, LEDGER, _FLOAT, _FLOAT))
def apply_impulse(
    states: Record, motion: Record, disks: Record, ledger: Ledger, axial: float, angular: float
) -> None:
    """Add impulses (N·s, N·m·s) to a state; `classify_after_input` follows the last input."""
    state, disk = states[0], disks[0]
    since = elapsed(motion[0], state.ns, state.sub)
    climb = axial_jet(motion[0], state.sine, state.cosine, since)[1]
    add_entry(ledger, W_IMPULSES, axial * (climb + state.u) + 0.5 * axial * axial / disk.mass)
    add_entry(ledger, W_IMPULSES, angular * state.omega + 0.5 * angular * angular / disk.inertia)
    state.u += axial / disk.mass
    state.omega += angular / disk.inertia
    if angular != 0.0 and state.phase != FLIGHT:
        sticks = state.phase == STICKING
        slip = angular if sticks else state.omega - platform_spin(state, motion[0])
        state.slip_sign = sign_of(slip)
        state.spin_sign = sign_of(state.omega)


@entry(types.void(STATE, MOTION, types.boolean))
def follow_platform(states: Record, motion: Record, jumps: bool) -> None:
    """A new motion of the platform for a halted state; the signs change only where β̇ jumps.

    Where it does not, the new motion's β̇ is the old one's but for rounding: a disk that sticks
    sticks on.
    """
    state = states[0]
    if state.phase == FLIGHT:
        return
    b1 = platform_spin(state, motion[0])
    if jumps:
        state.slip_sign = sign_of(state.omega - b1)
    elif state.phase == STICKING:
        state.omega = b1


@entry(types.void(STATE, MOTION, DISK))
def classify_after_input(states: Record, motion: Record, disk: Record) -> None:
    """After the inputs of one instant: contact, flight or an impact at once (rules 1, 4 and 10)."""
    state = states[0]
    state.event = UNKNOWN
    state.rows_entered = 0
    if state.phase == FLIGHT:
        if state.gap == 0.0 and state.u == 0.0:
            classify_contact(state, motion[0], disk[0])
    elif state.u != 0.0:
        state.phase = FLIGHT
    else:
        begin_contact(state, motion[0], disk[0], state.slip_sign, state.spin_sign)


@entry(types.void(STATE, MOTION, DISK, DISK, LEDGER))
def change_disk(states: Record, motion: Record, disk: Record, new: Record, ledger: Ledger) -> None:
    """Enter the jump of the energy where parameters change; signs that now begin to count."""
    state = states[0]
    if disk[0].brake == 0.0 and state.phase != FLIGHT:
        state.spin_sign = sign_of(state.omega)
        if disk[0].grip == 0.0:
            state.slip_sign = sign_of(state.omega - platform_spin(state, motion[0]))
    jet = axial_jet(motion[0], state.sine, state.cosine, elapsed(motion[0], state.ns, state.sub))
    x, v = jet[0] + state.gap, jet[1] + state.u
    before = mechanical_energy(disk[0], x, v, state.turns, state.angle, state.omega)
    after = mechanical_energy(new[0], x, v, state.turns, state.angle, state.omega)
    add_entry(ledger, W_PARAMETERS, after - before)


@entry(types.void(STATE, MOTION, DISK, _OBSERVED))
def observe(states: Record, motion: Record, disks: Record, out: Record) -> None:
    """Platform motion, forces on the disk and mechanical energy at the clock of a state."""
    state, disk, observed = states[0], disks[0], out[0]
    since = elapsed(motion[0], state.ns, state.sub)
    jet = axial_jet(motion[0], state.sine, state.cosine, since)
    turn = angular_jet(motion[0], state.sine, state.cosine, since)
    observed.s, observed.s1, observed.b, observed.b1 = jet[0], jet[1], turn[0], turn[1]
    observed.force = 0.0
    observed.torque = 0.0
    if state.phase != FLIGHT:
        a = disk.g + jet[2]
        observed.force = disk.mass * a
        if state.phase == STICKING:
            observed.torque = disk.inertia * (turn[2] + state.drag)
        else:
            observed.torque = -state.slip_sign * disk.inertia * disk.grip * a
    v = jet[1] + state.u
    observed.kinetic = 0.5 * disk.mass * v * v + 0.5 * disk.inertia * state.omega * state.omega
    observed.energy = mechanical_energy(
        disk, jet[0] + state.gap, v, state.turns, state.angle, state.omega
    )

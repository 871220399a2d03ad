"""Stop a state at an instant, apply inputs to it, observe it: Python calls them by `engine.act`."""

from __future__ import annotations

from typing import Any, NamedTuple

from bouncing_disk_ros.core.brake import sign_of
from bouncing_disk_ros.core.compilation import rare_kernel
from bouncing_disk_ros.core.energy_ledger import Ledger, add_entry, mechanical_energy
from bouncing_disk_ros.core.event_instant import instant_rounding, take_to_input
from bouncing_disk_ros.core.forcing_clock import Clock, elapsed, phase_of, seconds_between
from bouncing_disk_ros.core.impact_log import CHATTER_CUT, Rows, close_row
from bouncing_disk_ros.core.layout import (
    FAULT,
    FLIGHT,
    NOTHING,
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

Values = Any  # float64 (8,)


class Observed(NamedTuple):
    """What `observe` writes: the platform's motion, the disk's forces and energies, SI units."""

    s: float
    s1: float
    b: float
    b1: float
    force: float
    torque: float
    energy: float
    kinetic: float


@rare_kernel
def advance_to(
    state: Record,
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
    d = seconds_between(state.ns, state.sub, ns, 0.0)
    if d > 0.0:
        clock = Clock(ns, 0.0, *phase_of(motion, ns, 0.0))
        launched = state.phase == FLIGHT and state.gap == 0.0
        if launched and d <= instant_rounding(state, motion, 0.0):
            set_clock(state, clock)
        else:
            propagate(state, motion, disk, ledger, d, clock)
    state.event = UNKNOWN
    if state.phase == FLIGHT and state.gap < 0.0:
        state.gap = 0.0  # rounding: an impact has just been or is just to come
    return close_row(open_row, rows, 0, state, CHATTER_CUT)


@rare_kernel
def take_due(state: Record, motion: Record, disk: Record, ns: int) -> bool:
    """Take the next event to an input at ns where only rounding puts it after that; if it did."""
    if state.event in (UNKNOWN, NOTHING, FAULT):
        return False
    return take_to_input(state, motion, disk, ns)


@rare_kernel
def apply_impulse(
    state: Record, motion: Record, disk: Record, ledger: Ledger, axial: float, angular: float
) -> None:
    """Add impulses (N·s, N·m·s) to a state; `classify_after_input` follows the last input."""
    since = elapsed(motion, state.ns, state.sub)
    climb = axial_jet(motion, state.sine, state.cosine, since)[1]
    add_entry(ledger, W_IMPULSES, axial * (climb + state.u) + 0.5 * axial * axial / disk.mass)
    add_entry(ledger, W_IMPULSES, angular * state.omega + 0.5 * angular * angular / disk.inertia)
    state.u += axial / disk.mass
    state.omega += angular / disk.inertia
    if angular != 0.0 and state.phase != FLIGHT:
        sticks = state.phase == STICKING
        slip = angular if sticks else state.omega - platform_spin(state, motion)
        state.slip_sign = sign_of(slip)
        state.spin_sign = sign_of(state.omega)


@rare_kernel
def follow_platform(state: Record, motion: Record, jumps: bool) -> None:
    """A new motion of the platform for a halted state; the signs change only where β̇ jumps.

    Where it does not, the new motion's β̇ is the old one's but for rounding: a disk that sticks
    sticks on.
    """
    if state.phase == FLIGHT:
        return
    b1 = platform_spin(state, motion)
    if jumps:
        state.slip_sign = sign_of(state.omega - b1)
    elif state.phase == STICKING:
        state.omega = b1


@rare_kernel
def classify_after_input(state: Record, motion: Record, disk: Record) -> None:
    """After the inputs of one instant: contact, flight or an impact at once (rules 1, 4 and 10)."""
    state.event = UNKNOWN
    state.rows_entered = 0
    if state.phase == FLIGHT:
        if state.gap == 0.0 and state.u == 0.0:
            classify_contact(state, motion, disk)
    elif state.u != 0.0:
        state.phase = FLIGHT
    else:
        begin_contact(state, motion, disk, state.slip_sign, state.spin_sign)


@rare_kernel
def change_disk(state: Record, motion: Record, disk: Record, new: Record, ledger: Ledger) -> None:
    """Enter the jump of the energy where parameters change; signs that now begin to count."""
    if disk.brake == 0.0 and state.phase != FLIGHT:
        state.spin_sign = sign_of(state.omega)
        if disk.grip == 0.0:
            state.slip_sign = sign_of(state.omega - platform_spin(state, motion))
    jet = axial_jet(motion, state.sine, state.cosine, elapsed(motion, state.ns, state.sub))
    x, v = jet[0] + state.gap, jet[1] + state.u
    before = mechanical_energy(disk, x, v, state.turns, state.angle, state.omega)
    after = mechanical_energy(new, x, v, state.turns, state.angle, state.omega)
    add_entry(ledger, W_PARAMETERS, after - before)


@rare_kernel
def observe(state: Record, motion: Record, disk: Record, values: Values) -> None:
    """Platform motion, forces on the disk and energies at the clock of a state (`Observed`)."""
    since = elapsed(motion, state.ns, state.sub)
    jet = axial_jet(motion, state.sine, state.cosine, since)
    turn = angular_jet(motion, state.sine, state.cosine, since)
    values[0], values[1], values[2], values[3] = jet[0], jet[1], turn[0], turn[1]
    force = torque = 0.0
    if state.phase != FLIGHT:
        a = disk.g + jet[2]
        force = disk.mass * a
        if state.phase == STICKING:
            torque = disk.inertia * (turn[2] + state.drag)
        else:
            torque = -state.slip_sign * disk.inertia * disk.grip * a
    v = jet[1] + state.u
    kinetic = 0.5 * disk.mass * v * v + 0.5 * disk.inertia * state.omega * state.omega
    energy = mechanical_energy(disk, jet[0] + state.gap, v, state.turns, state.angle, state.omega)
    values[4], values[5], values[6], values[7] = force, torque, energy, kinetic

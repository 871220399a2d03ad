"""Resolve the event that a state has stored."""

from __future__ import annotations

from bouncing_disk_ros.core.brake import STOPPED_TAIL, chatter_drag, sign_of, stopped_tail
from bouncing_disk_ros.core.chatter import (
    chatter_rotation,
    chatter_sums,
    first_of_chatter,
)
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.contact_table import enter, row_bit
from bouncing_disk_ros.core.energy_ledger import (
    Ledger,
    add_brake_loss,
    add_entry,
    add_impact_energy,
)
from bouncing_disk_ros.core.flight import Launch, gap_after
from bouncing_disk_ros.core.forcing_clock import Clock, elapsed
from bouncing_disk_ros.core.impact_log import (
    CHATTER_TAIL,
    Rows,
    add_impulses,
    begin_row,
    close_row,
    log_impact,
)
from bouncing_disk_ros.core.layout import (
    CHATTER_ENDS,
    FAULT,
    FLIGHT,
    IMPACT,
    L_AXIAL,
    L_FRICTION,
    LETS_GO,
    SEPARATION,
    SLIP,
    SLIP_ENDS,
    STILLED,
    STOPS,
    TURNS,
    W_ANGULAR,
    W_AXIAL,
)
from bouncing_disk_ros.core.platform import Jet, Record, angular_jet, axial_jet
from bouncing_disk_ros.core.propagate import (
    begin_contact,
    change_row,
    classify_contact,
    propagate,
    set_clock,
    spin,
    turn,
)
from bouncing_disk_ros.core.restitution import axial_push, friction_change, rebound, speed_after


@kernel
def _clock_of_event(state: Record) -> Clock:
    return Clock(state.event_ns, state.event_sub, state.event_cycles, state.event_tau)


@rare_kernel
def end_contact(state: Record, motion: Record, disk: Record, kind: int, value: float) -> None:
    """Go through the event that ends a phase of contact, at its instant."""
    if kind == SEPARATION:
        state.phase = FLIGHT
        state.gap = 0.0
        state.u = 0.0
    elif kind == SLIP:
        at_rest = disk.brake > 0.0 and state.spin_sign == 0
        enter(state, disk, int(value), int(value) if at_rest else state.spin_sign)
    elif kind == LETS_GO:
        enter(state, disk, state.slip_sign, int(value))
    elif kind == SLIP_ENDS:
        change_row(state, motion, disk, 0, state.spin_sign, 0)
    elif kind in (STOPS, TURNS):
        state.omega = 0.0
        change_row(state, motion, disk, state.slip_sign if kind == STOPS else 0, 0, int(value))


@kernel
def _impact(
    state: Record,
    motion: Record,
    disk: Record,
    ledger: Ledger,
    w: float,
    rows: Rows,
    n: int,
    open_row: Rows,
) -> int:
    since = elapsed(motion, state.ns, state.sub)
    s = axial_jet(motion, state.sine, state.cosine, since)
    b = angular_jet(motion, state.sine, state.cosine, since)
    push = axial_push(-w, disk.restitution)
    slip = state.omega - b[1]
    most = disk.grip * push
    twist = friction_change(slip, most)
    left = 0.0 if abs(slip) <= most else slip + twist
    state.omega = speed_after(state.omega, b[1], most)
    state.gap = 0.0
    state.u = rebound(-w, disk.restitution)
    state.phase = FLIGHT
    add_impact_energy(ledger, disk, w, 0.5 * (slip + left), push, twist, s[1], b[1])
    n = log_impact(rows, n, open_row, state, motion, disk, w, slip, push, twist)
    if state.u == 0.0:
        n = close_row(open_row, rows, n, state, CHATTER_TAIL)
        begin_contact(state, motion, disk, sign_of(left), sign_of(state.omega))
    return n


@kernel
def _end_chatter_rotation(
    state: Record,
    disk: Record,
    ledger: Ledger,
    sign: float,
    b: Jet,
    b_end: Jet,
    push: float,
    sums: tuple[float, float],
    t: float,
) -> float:
    """Rotation and its energy over a chatter's tail; returns Σ of the angular impulses over I."""
    moment, squares = sums
    before = state.omega
    drag = chatter_drag(disk, before)
    rho, slip = b[2] + drag, before - b[1]
    turned, state.omega = chatter_rotation(disk, drag, sign, before, b, b_end, push, sums, t)
    turn(state, turned)
    add_brake_loss(ledger, disk, abs(turned))
    if sign == 0.0:
        twist = b_end[1] - before + drag * t
        late = squares / (1.0 - disk.restitution)
        add_entry(ledger, W_ANGULAR, disk.inertia * (twist * b[1] + b[2] * rho * late))
        add_entry(ledger, L_FRICTION, 0.5 * disk.inertia * (rho * rho * squares + slip * slip))
        return twist
    twist = -sign * disk.grip * push
    add_entry(ledger, W_ANGULAR, disk.inertia * (twist * b[1] - sign * disk.grip * moment * b[2]))
    lost = -twist * (slip + 0.5 * twist) - disk.grip * sign * rho * moment
    add_entry(ledger, L_FRICTION, disk.inertia * lost)
    return twist


@rare_kernel
def end_stopped_tail(
    state: Record,
    disk: Record,
    ledger: Ledger,
    side: float,
    u: float,
    b: Jet,
    push: float,
    moment: float,
) -> float:
    """The same where the brake stops the disk in each flight; the slip has the sign `side`."""
    turned, way, squares = stopped_tail(disk, side, u, state.omega)
    turn(state, turned)
    state.omega = 0.0
    add_brake_loss(ledger, disk, way)
    twist = -side * disk.grip * push
    work = disk.inertia * (twist * b[1] - side * disk.grip * moment * b[2])
    add_entry(ledger, W_ANGULAR, work)
    add_entry(ledger, L_FRICTION, work - 0.5 * disk.inertia * squares)
    return twist


@rare_kernel
def _end_chatter(
    state: Record, motion: Record, disk: Record, ledger: Ledger, rows: Rows, n: int, open_row: Rows
) -> int:
    """All impacts that are left of a complete chatter, in closed form (rules 7 and 8).

    With flights of d₀εⁿ, d₀ = 2u/a: Σ F̂ over m is exact by momentum; the sums that weigh each
    impact with its time are geometric series, whose corrections are below rounding where the
    completion is allowed.
    """
    if state.event_value == STILLED:
        return _still(state, motion, disk, ledger, rows, n, open_row)
    t, u = state.event_delay, state.u
    since = elapsed(motion, state.ns, state.sub)
    s = axial_jet(motion, state.sine, state.cosine, since)
    b = angular_jet(motion, state.sine, state.cosine, since)
    launch = Launch(since, state.sine, state.cosine, disk.g, 0.0, u)
    push = -gap_after(motion, launch, t)[1]
    moment, squares = chatter_sums(disk, s, u)
    sign = state.event_value
    first = first_of_chatter(
        motion, disk, since, state.tau, state.sine, state.cosine, u, state.omega
    )
    set_clock(state, _clock_of_event(state))
    b_end = angular_jet(motion, state.sine, state.cosine, elapsed(motion, state.ns, state.sub))
    if abs(sign) == STOPPED_TAIL:
        twist = end_stopped_tail(state, disk, ledger, sign / STOPPED_TAIL, u, b, push, moment)
    else:
        sums = (moment, squares)
        twist = _end_chatter_rotation(state, disk, ledger, sign, b, b_end, push, sums, t)
    add_entry(ledger, W_AXIAL, disk.mass * (push * s[1] + s[2] * moment))
    add_entry(ledger, L_AXIAL, 0.5 * disk.mass * u * u)
    state.gap = 0.0
    state.u = 0.0
    row = open_row[0]
    if row.count == 0:
        begin_row(row, state, motion, disk, -first[0], first[1])
    add_impulses(row, state, motion, disk, push, twist)
    n = close_row(open_row, rows, n, state, CHATTER_TAIL)
    sticks = sign == 0.0
    side = 0 if sticks else sign_of(state.omega - b_end[1])
    begin_contact(state, motion, disk, side, sign_of(state.omega))
    return n


@kernel
def _still(
    state: Record, motion: Record, disk: Record, ledger: Ledger, rows: Rows, n: int, open_row: Rows
) -> int:
    """Take a bounce too short to move the forcing phase as contact; its energy is lost."""
    climb = axial_jet(motion, state.sine, state.cosine, elapsed(motion, state.ns, state.sub))[1]
    add_entry(ledger, W_AXIAL, -disk.mass * climb * state.u)
    add_entry(ledger, L_AXIAL, 0.5 * disk.mass * state.u * state.u)
    n = close_row(open_row, rows, n, state, CHATTER_TAIL)
    classify_contact(state, motion, disk)
    return n


@kernel
def _enter_once(state: Record) -> None:
    """At one instant events enter a row of `contact_table` once, or the run ends: FAULT."""
    row = row_bit(state)
    if state.rows_entered & row != 0:
        state.event = FAULT
    state.rows_entered |= row


@kernel
def resolve(
    state: Record, motion: Record, disk: Record, ledger: Ledger, rows: Rows, n: int, open_row: Rows
) -> int:
    """Advance the state to its next event and resolve it; returns the number of rows."""
    kind = state.event
    value = state.event_value
    if kind == CHATTER_ENDS:
        return _end_chatter(state, motion, disk, ledger, rows, n, open_row)
    d, clock = state.event_delay, _clock_of_event(state)
    if kind == IMPACT:
        spin(state, disk, ledger, d)
        set_clock(state, clock)
        return _impact(state, motion, disk, ledger, -value, rows, n, open_row)
    if clock != (state.ns, state.sub, state.cycles, state.tau):
        state.rows_entered = 0
    propagate(state, motion, disk, ledger, d, clock)
    if state.phase == FLIGHT and state.gap < 0.0:
        state.gap = 0.0  # a waypoint within rounding of an impact
    end_contact(state, motion, disk, kind, value)
    if kind in (SLIP, SLIP_ENDS, STOPS, TURNS, LETS_GO):
        _enter_once(state)
    return n

"""Propagate a state within one phase of motion, in closed form, with its energy ledger."""

from __future__ import annotations

import math

from bouncing_disk_ros.core.arithmetic import TWO_PI, floor, sincos
from bouncing_disk_ros.core.brake import braked_spin, sign_of
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.contact_events import load, slide
from bouncing_disk_ros.core.contact_table import enter_what_holds
from bouncing_disk_ros.core.energy_ledger import (
    Ledger,
    add_axial_work,
    add_brake_loss,
    add_held_work,
    add_sliding_work,
    add_sticking_work,
)
from bouncing_disk_ros.core.flight import MOST_GROWTH, Launch, flies_far, flown_far, gap_after
from bouncing_disk_ros.core.forcing_clock import Clock, elapsed
from bouncing_disk_ros.core.layout import FLIGHT, HELD, STICKING, THROUGHPUT, UNKNOWN, Slide
from bouncing_disk_ros.core.platform import Record, angular_jet, axial_jet, turns_next
from bouncing_disk_ros.core.roots import ROUNDING

_MOST_TURNS = 2.0**62  # as checkpoints hold them
_TWO_PI_LOW = 2.4492935982947064e-16  # 2π − float64(2π)


@kernel
def turn(state: Record, angle: float) -> None:
    """Add to the angle of the disk, kept as whole turns and a remainder in [−π, π]."""
    total = state.angle + angle
    whole = total / TWO_PI
    turns = floor(whole + 0.5)
    if abs(whole) + abs(float(state.turns)) >= _MOST_TURNS:
        state.angle = math.nan  # beyond the range of numbers: the run ends
        return
    state.turns += int(turns)
    state.angle = (total - turns * TWO_PI) - turns * _TWO_PI_LOW


@kernel
def spin(state: Record, disk: Record, ledger: Ledger, d: float) -> None:
    """Rotation in d seconds of flight: only the load torque and the brake act."""
    if disk.brake > 0.0:
        turned, state.omega, way = braked_spin(state.omega, disk, d)
        turn(state, turned)
        add_brake_loss(ledger, disk, way)
        return
    turn(state, (state.omega - 0.5 * disk.lag * d) * d)
    state.omega -= disk.lag * d


@kernel
def set_clock(state: Record, clock: Clock) -> None:
    """Move the clock of a state; what is known of the next event is forgotten."""
    state.ns, state.sub, state.cycles, state.tau = clock
    state.sine, state.cosine = sincos(clock.tau)
    state.event = UNKNOWN


@rare_kernel
def _fly(
    state: Record,
    motion: Record,
    disk: Record,
    ledger: Ledger,
    before: float,
    d: float,
    after: float,
    tau: float,
) -> None:
    """Gap and its velocity after d seconds of flight, to the phase τ.

    They are those of the disk less the platform's, and are rounded on the scale of both: where the
    platform's is the larger one by far, the energy of that scale enters the throughput.
    """
    sine, cosine, gap, u = state.sine, state.cosine, state.gap, state.u
    launch = Launch(before, sine, cosine, disk.g, gap, u)
    if flies_far(motion, launch, d):
        state.gap, state.u = flown_far(motion, launch, d, after, tau)
    else:
        state.gap, state.u, _, _, _ = gap_after(motion, launch, d)
    s = axial_jet(motion, sine, cosine, before)
    v = s[1] + u - disk.g * d
    x = s[0] + gap + (v + 0.5 * disk.g * d) * d
    if abs(state.gap) > MOST_GROWTH * MOST_GROWTH * abs(x):
        ledger[0, THROUGHPUT] += disk.weight * abs(state.gap)
    fast = abs(state.u)
    if fast > MOST_GROWTH * abs(v):
        ledger[0, THROUGHPUT] += disk.mass * fast * (abs(v) + ROUNDING * fast)


@rare_kernel
def propagate(
    state: Record,
    motion: Record,
    disk: Record,
    ledger: Ledger,
    d: float,
    clock: Clock,
) -> None:
    """Propagate a state by d seconds, to the clock given, without leaving its phase of motion."""
    tau = clock.tau
    before, after = elapsed(motion, state.ns, state.sub), elapsed(motion, clock.ns, clock.sub)
    if state.phase == FLIGHT:
        _fly(state, motion, disk, ledger, before, d, after, tau)
        spin(state, disk, ledger, d)
    else:
        sine, cosine = sincos(tau)
        s0 = axial_jet(motion, state.sine, state.cosine, before)
        s1 = axial_jet(motion, sine, cosine, after)
        b0 = angular_jet(motion, state.sine, state.cosine, before)
        b1 = angular_jet(motion, sine, cosine, after)
        if state.phase == STICKING:
            add_axial_work(ledger, disk, s0, s1)
            add_sticking_work(ledger, disk, state.spin_sign, b0, b1)
            add_brake_loss(ledger, disk, state.spin_sign * (b1[0] - b0[0]))
            turn(state, b1[0] - b0[0])
            state.omega = b1[1]
        elif state.phase == HELD:
            add_axial_work(ledger, disk, s0, s1)
            add_held_work(ledger, state, motion, disk, before, d)
        else:
            sign = float(state.slip_sign)
            begin = Slide(before, state.tau, state.sine, state.cosine, sign, state.drag)
            turned, omega, pushed, q = slide(motion, disk, begin, state.omega, d)
            slip = state.omega - b0[1]
            add_axial_work(ledger, disk, s0, s1)
            add_sliding_work(ledger, motion, disk, begin, slip, d, q, pushed, b0, b1)
            add_brake_loss(ledger, disk, state.spin_sign * turned)
            turn(state, turned)
            state.omega = omega
        state.gap = 0.0
        state.u = 0.0
    set_clock(state, clock)


@rare_kernel
def begin_contact(state: Record, motion: Record, disk: Record, slip: int, spin: int) -> None:
    """With gap = 0 and u = 0: contact or flight (rule 1), and in contact what holds (rule 4).

    `slip` and `spin` are the signs of w_T and α̇ at this instant (`contact_table.what_holds`).
    """
    state.gap = 0.0
    state.u = 0.0
    state.event = UNKNOWN
    since = elapsed(motion, state.ns, state.sub)
    s = axial_jet(motion, state.sine, state.cosine, since)
    a, pressed = load(motion, disk.g, s)
    if not pressed:
        state.phase = FLIGHT
        return
    b = angular_jet(motion, state.sine, state.cosine, since)
    enter_what_holds(state, disk, slip, spin, turns_next(motion, b), a, b)


@kernel
def classify_contact(state: Record, motion: Record, disk: Record) -> None:
    """`begin_contact` for a state that is given: its signs are those of its numbers."""
    slip = state.omega - platform_spin(state, motion)
    begin_contact(state, motion, disk, sign_of(slip), sign_of(state.omega))


@kernel
def platform_spin(state: Record, motion: Record) -> float:
    """β̇ at the clock of a state, rad/s."""
    since = elapsed(motion, state.ns, state.sub)
    spin: float = angular_jet(motion, state.sine, state.cosine, since)[1]
    return spin


@kernel
def change_row(
    state: Record, motion: Record, disk: Record, slip: int, spin: int, ahead: int
) -> None:
    """Put in force what holds after an event in contact that has set the signs of w_T and α̇.

    `ahead` is the sign of β̇ after it, if both are 0.
    """
    since = elapsed(motion, state.ns, state.sub)
    a = disk.g + axial_jet(motion, state.sine, state.cosine, since)[2]
    b = angular_jet(motion, state.sine, state.cosine, since)
    enter_what_holds(state, disk, slip, spin, ahead, a, b)

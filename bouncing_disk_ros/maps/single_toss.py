"""Single tosses: contact with the platform up to separation, for many motions.

A disk in contact with a steady motion sticks and slides until the platform falls away from under
it (eq. 3). The events, the closed forms between them and the energy ledger are those of the
stepper, given a named tuple in place of its record of a motion: numba leaves out what a steady
motion does not need.
"""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, sincos
from bouncing_disk_ros.core.compilation import entry, kernel
from bouncing_disk_ros.core.energy_ledger import Ledger
from bouncing_disk_ros.core.flight import separation_phase
from bouncing_disk_ros.core.forcing_clock import Clock, phase_after
from bouncing_disk_ros.core.layout import (
    DISK,
    FLIGHT,
    LEDGER,
    SEPARATION,
    STATE,
    STICKING,
    W_ANGULAR,
    W_AXIAL,
)
from bouncing_disk_ros.core.next_event import after_sliding, after_sticking
from bouncing_disk_ros.core.platform import Record, steady_motion
from bouncing_disk_ros.core.propagate import classify_contact, propagate, set_clock
from bouncing_disk_ros.core.resolve_event import end_contact

TOSS_SLID, TOSS_STUCK, TOSS_NONE, TOSS_STAYS, TOSS_UNRESOLVED = 0, 1, 2, 3, -1
"""How the contact ended: the disk left sliding; it left sticking (ν is the platform's); it left
at once, the platform falling away at the start; it never leaves (Γ ≤ 1/π); the events allowed were
used up."""

(
    START_AXIAL_AMPLITUDE,
    START_ANGULAR_AMPLITUDE,
    START_PHASE_LAG,
    START_FORCING_PHASE,
    START_ANGULAR_SPEED,
) = range(5)
"""Columns of what `toss_each` reads: m, rad, rad, rad in [0, 2π), rad/s."""
RESULT_AIRBORNE_SPEED, RESULT_DELAY, RESULT_WORK_AXIAL, RESULT_WORK_ANGULAR = range(4)
"""Columns of what `toss_each` writes: α̇ at separation in rad/s, time to it in s, and until then
∫N ṡ dt and ∫M β̇ dt in J."""


@kernel
def toss_once(
    state: Record, motion: Record, disk: Record, ledger: Ledger, leave: float, events: int
) -> tuple[int, float]:
    """Follow a disk in contact to its separation at the phase `leave`; how it ended, seconds."""
    # The loop of rotation_map.contact_until_flight is this one without state record and energy
    # ledger: the map has no place for them, and the angle here is kept as whole turns and a rest,
    # there as one sum.
    total = 0.0
    for _ in range(events):
        phase = state.phase
        if phase == STICKING:
            kind, d, value, _ = after_sticking(state, motion, disk, 0.0, math.inf)
        else:
            kind, d, value, _ = after_sliding(state, motion, disk, 0.0, math.inf)
        tau = leave if kind == SEPARATION else phase_after(state.tau, motion.omega * d)[1]
        propagate(state, motion, disk, ledger, d, Clock(0, 0.0, 0, tau))
        end_contact(state, motion, disk, kind, value)
        total += d
        if kind == SEPARATION:
            return (TOSS_STUCK if phase == STICKING else TOSS_SLID), total
    return TOSS_UNRESOLVED, total


_TABLE = types.Array(types.float64, 2, "C")


@entry(
    types.void(
        _TABLE,
        types.float64,
        DISK,
        types.int64,
        STATE,
        LEDGER,
        _TABLE,
        types.Array(types.int8, 1, "C"),
    )
)
def toss_each(
    starts: Record,
    frequency: float,
    disks: Record,
    events: int,
    states: Record,
    ledger: Ledger,
    out: Record,
    codes: Record,
) -> None:
    """Toss from each row of starts (n, 5) into out (n, 4) and codes (n,), at most `events` each.

    The disk starts on the platform, with the platform's axial velocity. `state` and `ledger` are
    work space. Without a separation a row of `out` is nan.
    """
    disk = disks[0]
    state = states[0]
    for i in range(len(starts)):
        axial, angular = starts[i, START_AXIAL_AMPLITUDE], starts[i, START_ANGULAR_AMPLITUDE]
        lag = starts[i, START_PHASE_LAG]
        motion = steady_motion(axial, angular, frequency, TWO_PI * frequency, lag, *sincos(lag))
        ledger[:] = 0.0
        set_clock(state, Clock(0, 0.0, 0, starts[i, START_FORCING_PHASE]))
        state.turns, state.angle, state.omega = 0, 0.0, starts[i, START_ANGULAR_SPEED]
        classify_contact(state, motion, disk)
        delay = 0.0
        leave = separation_phase(motion, disk.g)
        if leave < 0.0:
            code = TOSS_STAYS
        elif state.phase == FLIGHT:
            code = TOSS_NONE
        else:
            code, delay = toss_once(state, motion, disk, ledger, leave, events)
        codes[i] = code
        left = code in (TOSS_SLID, TOSS_STUCK, TOSS_NONE)
        out[i, RESULT_AIRBORNE_SPEED] = state.omega if left else math.nan
        out[i, RESULT_DELAY] = delay if left else math.nan
        out[i, RESULT_WORK_AXIAL] = ledger[0, W_AXIAL] + ledger[1, W_AXIAL] if left else math.nan
        out[i, RESULT_WORK_ANGULAR] = (
            ledger[0, W_ANGULAR] + ledger[1, W_ANGULAR] if left else math.nan
        )

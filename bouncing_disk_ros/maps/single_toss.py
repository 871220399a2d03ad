"""Single tosses: contact with the platform up to separation, with its work, for many motions."""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, sincos
from bouncing_disk_ros.core.compilation import entry, kernel
from bouncing_disk_ros.core.contact_events import load
from bouncing_disk_ros.core.energy_ledger import (
    Ledger,
    add_axial_work,
    add_sliding_work,
    add_sticking_work,
)
from bouncing_disk_ros.core.flight import separation_phase
from bouncing_disk_ros.core.layout import DISK, LEDGER, W_ANGULAR, W_AXIAL
from bouncing_disk_ros.core.next_event import Stretch, contact_run
from bouncing_disk_ros.core.platform import Record, axial_jet, steady_motion

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
def _add_work(ledger: Ledger, motion: Record, disk: Record, stretch: Stretch) -> None:
    """Enter the work of a phase of contact, as `propagate` does for a disk without a brake."""
    begin, slip, d, pushed, q, (s0, s1), (b0, b1) = stretch
    add_axial_work(ledger, disk, s0, s1)
    if begin.sign == 0.0:
        add_sticking_work(ledger, disk, 0, b0, b1)
    else:
        add_sliding_work(ledger, motion, disk, begin, slip, d, q, pushed, b0, b1)


_contact_until_flight = contact_run(_add_work)

_TABLE = types.Array(types.float64, 2, "C")


@entry(
    types.void(
        _TABLE, types.float64, DISK, types.int64, LEDGER, _TABLE, types.Array(types.int8, 1, "C")
    )
)
def toss_each(
    starts: Record,
    frequency: float,
    disks: Record,
    most: int,
    ledger: Ledger,
    out: Record,
    codes: Record,
) -> None:
    """Toss from each row of starts (n, 5) into out (n, 4) and codes (n,), `most` phases each.

    The disk starts on the platform, with the platform's axial velocity. `ledger` is work space.
    Without a separation a row of `out` is nan.
    """
    disk = disks[0]
    for i in range(len(starts)):
        axial, angular = starts[i, START_AXIAL_AMPLITUDE], starts[i, START_ANGULAR_AMPLITUDE]
        lag, omega = starts[i, START_PHASE_LAG], starts[i, START_ANGULAR_SPEED]
        motion = steady_motion(axial, angular, frequency, TWO_PI * frequency, lag, *sincos(lag))
        tau = starts[i, START_FORCING_PHASE]
        sine, cosine = sincos(tau)
        ledger[:] = 0.0
        delay = 0.0
        if separation_phase(motion, disk.g) < 0.0:
            code, delay = TOSS_STAYS, math.nan
        elif not load(motion, disk.g, axial_jet(motion, sine, cosine, 0.0))[1]:
            code = TOSS_NONE
        else:
            delay, omega, _, sign = _contact_until_flight(motion, disk, tau, omega, most, ledger)
            code = TOSS_STUCK if sign == 0.0 else TOSS_SLID
            if math.isnan(delay):
                code = TOSS_UNRESOLVED
        codes[i] = code
        left = not math.isnan(delay)
        out[i, RESULT_AIRBORNE_SPEED] = omega if left else math.nan
        out[i, RESULT_DELAY] = delay
        out[i, RESULT_WORK_AXIAL] = ledger[0, W_AXIAL] + ledger[1, W_AXIAL] if left else math.nan
        out[i, RESULT_WORK_ANGULAR] = (
            ledger[0, W_ANGULAR] + ledger[1, W_ANGULAR] if left else math.nan
        )

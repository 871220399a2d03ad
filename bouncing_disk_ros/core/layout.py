"""Records that the kernels work on. Arrays of one element each: numba changes them in place.

Plain numbers only, so a copy of the bytes is an exact checkpoint.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numba import from_dtype, types
from numpy.typing import NDArray

if TYPE_CHECKING:
    from bouncing_disk_ros.core.model import Disk

FLIGHT, STICKING, SLIDING, HELD = 0, 1, 2, 3  # model.Phase as plain integers, for the kernels
STEADY, FADE = 0, 1
MOVING = 2  # a steady sinusoid with an offset that changes: a fade without change and without end
NEVER = np.int64(2**63 - 1)  # an instant that does not come, ns

# Pending events.
UNKNOWN, NOTHING, IMPACT, SEPARATION, SLIP, SLIP_ENDS, CHATTER_ENDS, SKIP = range(8)
WAYPOINT = 8  # no event up to there: the search goes on from it
FAULT = 9  # the state is not finite, or a root was not found: the run ends
STOPS, TURNS, LETS_GO = 10, 11, 12  # with a brake: the disk stops, the platform turns back, slip
STILLED = 2.0  # value of a CHATTER_ENDS whose bounces are too short to have a duration

STATE_DTYPE = np.dtype(
    [
        # clock of the last event or input: whole nanoseconds and a remainder, whole cycles and a
        # phase
        ("ns", "i8"),
        ("sub", "f8"),  # ns, in [0, 1)
        ("cycles", "i8"),
        ("tau", "f8"),  # rad, in [0, 2π)
        ("sine", "f8"),  # of tau
        ("cosine", "f8"),
        ("phase", "i8"),
        # in contact (contact_table): the signs of w_T and, with a brake, of α̇; what load
        # and brake take from α̇, rad/s²; the rows entered at this very instant, as bits
        ("slip_sign", "i8"),
        ("spin_sign", "i8"),
        ("drag", "f8"),
        ("rows_entered", "i8"),
        # axial: relative to the platform, so that tiny bounces keep their digits
        ("gap", "f8"),
        ("u", "f8"),  # gap velocity
        # angular: whole turns, a remainder in [−π, π], absolute velocity
        ("turns", "i8"),
        ("angle", "f8"),
        ("omega", "f8"),
        # the next event, computed once and stored
        ("event", "i8"),
        ("event_delay", "f8"),  # s after the clock above
        ("event_value", "f8"),  # w_A of an impact, periods of a skip
        ("event_ns", "i8"),
        ("event_sub", "f8"),
        ("event_cycles", "i8"),
        ("event_tau", "f8"),
        ("rows", "i8"),  # rows reported so far
        ("initial_energy", "f8"),
    ],
    align=True,
)

MOTION_DTYPE = np.dtype(
    [
        ("kind", "i8"),
        ("begin_ns", "i8"),
        ("end_ns", "i8"),  # of a fade; NEVER for a steady motion
        ("cycles", "i8"),  # at begin_ns
        ("tau", "f8"),  # at begin_ns
        ("duration", "f8"),  # s, of a fade
        # values at begin_ns and what a fade adds to them
        ("a", "f8"),
        ("da", "f8"),
        ("p", "f8"),
        ("dp", "f8"),
        ("f", "f8"),
        ("df", "f8"),
        ("lag", "f8"),
        ("dlag", "f8"),
        # derived
        ("lag_sine", "f8"),
        ("lag_cosine", "f8"),
        ("omega", "f8"),  # 2π f, of the steady motion or at begin_ns
        ("omega_max", "f8"),
        ("top", "f8"),  # bound of |s|
        ("s2", "f8"),  # bounds of the absolute second, third and fourth derivatives of s and β
        ("s3", "f8"),
        ("s4", "f8"),
        ("b2", "f8"),
        ("b3", "f8"),
        ("b4", "f8"),
    ],
    align=True,
)

OFFSET_DEGREE = 5
PLATFORM_DTYPE = np.dtype(
    [
        *((name, MOTION_DTYPE[name]) for name in MOTION_DTYPE.names or ()),
        ("offset", "i8"),  # 1: there is one
        # of the segments in force: derivatives 0 to 5, as polynomials of (t − begin)/duration, each
        # coefficient with what its rounding left out
        ("axial", "f8", (OFFSET_DEGREE + 1, OFFSET_DEGREE + 1, 2)),
        ("angular", "f8", (OFFSET_DEGREE + 1, OFFSET_DEGREE + 1, 2)),
        ("axial_duration", "f8"),  # whole ns
        ("angular_duration", "f8"),
        ("span", "f8"),  # s: longest piece that shares bounds of derivatives
        ("origin_ns", "i8"),  # `elapsed` counts from here
        ("axial_lead", "f8"),  # s from the segment's begin to the origin
        ("angular_lead", "f8"),
        ("fade_lead", "f8"),  # s from a cross-fade's begin to the origin
        ("fade_end", "f8"),  # s from the origin to its end; inf for none
        ("turning", "i8"),  # 1: the angular offset changes
        ("bending", "i8"),  # 1: the axial offset has an acceleration
        ("fifth", "f8"),  # derivative of the angular offset, the last that is not 0
        ("separation_g", "f8"),  # g for which `separation_phase` is known; nan: it is not
        ("separation_phase", "f8"),
    ],
    align=True,
)
"""What the kernels read: a sinusoid or a cross-fade (MOTION_DTYPE), and the offset added to it.

Its kind is MOVING while the offset changes in a steady motion."""

DISK_DTYPE = np.dtype(
    [
        ("mass", "f8"),
        ("restitution", "f8"),
        ("friction", "f8"),
        ("inertia", "f8"),  # I = m a_g² + J
        ("weight", "f8"),  # m g + P, N
        ("g", "f8"),  # g + P/m
        ("grip", "f8"),  # μ a_e m/I: angular acceleration by friction over g + s̈, rad/m
        ("load_torque", "f8"),
        ("lag", "f8"),  # T_L/I, rad/s²
        ("brake_torque", "f8"),
        ("brake", "f8"),  # T_B/I, rad/s²
        ("report_speed", "f8"),  # m/s: slower impacts share a row; changes no result
    ],
    align=True,
)

LEDGER_FIELDS = (
    "work_axial",
    "work_angular",
    "work_impulses",
    "work_parameters",
    "loss_impact_axial",
    "loss_impact_friction",
    "loss_sliding",
    "loss_brake",
    "throughput",
)
W_AXIAL, W_ANGULAR, W_IMPULSES, W_PARAMETERS = range(4)
L_AXIAL, L_FRICTION, L_SLIDING, L_BRAKE, THROUGHPUT = range(4, 9)

STATE = from_dtype(STATE_DTYPE)[::1]
MOTION = from_dtype(PLATFORM_DTYPE)[::1]
DISK = from_dtype(DISK_DTYPE)[::1]
LEDGER = types.float64[:, ::1]  # (2, 9): sums and what their rounding left out


LONGEST = 1e8
"""s: longer waits go in several steps, so that whole nanoseconds never overflow and the phase that
grows in one search keeps its whole turns."""
PAST_BOUNDARY = 2e-9
"""s: events are searched for a little past a boundary; the exact comparison is made with their
instant."""


class Slide(NamedTuple):
    """Where a slide begins, and what acts in it."""

    elapsed: float  # s since the motion's origin
    tau: float
    sine: float  # of τ
    cosine: float
    sign: float  # of the slip
    drag: float  # rad/s²


class NextEvent(NamedTuple):
    """An event: its kind, when it comes (s), its value, and the steps that its search took."""

    kind: int
    delay: float
    value: float
    steps: int


def disk_record(disk: Disk, report_speed: float) -> NDArray[np.void]:
    """The disk as the kernels read it, with what follows from it."""
    record = np.zeros(1, DISK_DTYPE)
    inertia = disk.inertia
    record["mass"], record["restitution"] = disk.mass, disk.restitution
    record["friction"] = disk.friction
    record["inertia"] = inertia
    record["weight"] = disk.mass * disk.gravity + disk.preload
    record["g"] = disk.gravity + disk.preload / disk.mass
    squared = disk.gyration_radius**2 + disk.load_inertia / disk.mass
    record["grip"] = disk.friction * disk.friction_radius / squared
    record["load_torque"], record["lag"] = disk.load_torque, disk.load_torque / inertia
    record["brake_torque"], record["brake"] = disk.brake_torque, disk.brake_torque / inertia
    record["report_speed"] = report_speed
    return record

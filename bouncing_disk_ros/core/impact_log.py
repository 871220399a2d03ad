"""Rows of the impact log: one for each impact, or one for a run of impacts too slow to report."""

from __future__ import annotations

import math
from typing import Any

from numba import from_dtype

from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.forcing_clock import elapsed
from bouncing_disk_ros.core.layout import STEADY
from bouncing_disk_ros.core.model import IMPACT_DTYPE, LARGEST_FLOAT32, ImpactKind
from bouncing_disk_ros.core.platform import Record, axial_jet, blend_jet

Rows = Any  # array of IMPACT_DTYPE
ROWS = from_dtype(IMPACT_DTYPE)[::1]

ONE_IMPACT, CHATTER_TAIL, CHATTER_CUT = (int(kind) for kind in ImpactKind)  # for kernels


@kernel
def shown(value: float) -> float:
    """The value as a float32 can hold it: one beyond the range would become infinite."""
    return min(max(value, -LARGEST_FLOAT32), LARGEST_FLOAT32)


@kernel
def begin_row(
    row: Record, state: Record, motion: Record, disk: Record, w: float, slip: float
) -> None:
    """Start a row with its first impact: w = |w_A| and w_T before it."""
    row.count = 0
    row.axial_impulse = 0.0
    row.angular_impulse = 0.0
    row.axial_impact_velocity = -w
    row.angular_impact_velocity = slip
    blend = 0.0
    if motion.kind != STEADY:
        since = elapsed(motion, state.ns, state.sub) + motion.fade_lead
        blend = blend_jet(since / motion.duration, motion.duration)[0]
    omega = TWO_PI * (motion.f + motion.df * blend)
    row.y = shown(-w * omega / (math.pi * disk.g))


@kernel
def end_row(row: Record, state: Record, motion: Record) -> None:
    """Write clock and state just after the last impact so far."""
    since = elapsed(motion, state.ns, state.sub)
    s = axial_jet(motion, state.sine, state.cosine, since)
    row.time = (float(state.ns) + state.sub) / 1e9
    row.cycles = float(state.cycles)
    row.forcing_phase = state.tau
    row.axial_position = s[0] + state.gap
    row.axial_velocity = s[1] + state.u
    row.angular_velocity = state.omega
    row.x = state.tau / TWO_PI
    blend = 0.0
    if motion.kind != STEADY:
        blend = blend_jet((since + motion.fade_lead) / motion.duration, motion.duration)[0]
    reach = TWO_PI * (motion.f + motion.df * blend) * (motion.p + motion.dp * blend)
    row.z = shown(state.omega / reach) if reach > 0.0 else 0.0


@kernel
def close_row(open_row: Rows, rows: Rows, n: int, state: Record, kind: int) -> int:
    """Report the open row, if there is one; returns the number of rows."""
    return n if open_row[0].count == 0 else _report(open_row, rows, n, state, kind)


@rare_kernel
def _report(open_row: Rows, rows: Rows, n: int, state: Record, kind: int) -> int:
    after = number_row(open_row[0], n, state, kind)
    rows[n] = open_row[0]
    open_row[0].count = 0
    return after


@kernel
def number_row(row: Record, n: int, state: Record, kind: int) -> int:
    """Give a whole row its kind and index; returns the number of rows with it."""
    row.kind = kind
    row.index = float(state.rows)
    state.rows += 1
    return n + 1


@kernel
def keep_last(open_row: Rows, rows: Rows, n: int) -> None:
    """Leave what is reported of the last row in the open row, for snapshots alone."""
    if n == 0:
        return
    last = rows[n - 1]
    if open_row[0].count == 0:
        open_row[0] = last
        open_row[0].count = 0
    else:
        open_row[0].kind = last.kind
        open_row[0].index = last.index


@kernel
def log_impact(
    rows: Rows,
    n: int,
    open_row: Rows,
    state: Record,
    motion: Record,
    disk: Record,
    w: float,
    slip: float,
    push: float,
    twist: float,
) -> int:
    """Report an impact just resolved (impulses over m, m a_g²); returns the number of rows."""
    alone = w >= disk.report_speed or disk.restitution == 0.0  # ε = 0: one impact is no chatter
    if alone:
        n = close_row(open_row, rows, n, state, CHATTER_CUT)
    row = rows[n] if alone else open_row[0]  # to copy a row just written would wait for its numbers
    if alone or row.count == 0:
        begin_row(row, state, motion, disk, w, slip)
    add_impulses(row, state, motion, disk, push, twist)
    return number_row(row, n, state, ONE_IMPACT) if alone else n


@kernel
def add_impulses(
    row: Record, state: Record, motion: Record, disk: Record, push: float, twist: float
) -> None:
    """Add one impact, or the closed form of all that are left, to a row."""
    row.count += 1
    row.axial_impulse += disk.mass * push
    row.angular_impulse += disk.inertia * twist
    end_row(row, state, motion)

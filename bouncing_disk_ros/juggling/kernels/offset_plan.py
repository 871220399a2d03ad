"""An offset of the platform as quintic pieces, for kernels.

Units of the next-collision map: time 1/ω (so that an instant is a forcing phase, never wrapped),
length πg/ω². A plan is an array (ROWS, COLUMNS): each piece with its begin, its duration, the state
at its end and the table that the core reads of it (`core.platform.offset_at`). A piece is in force
until the next one begins; a piece that is over before has led the offset to nothing. The core
counts the duration of a piece in 1e-9 of its unit of time.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import GIGA
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.layout import OFFSET_DEGREE
from bouncing_disk_ros.core.offset import quintic_coefficients
from bouncing_disk_ros.core.platform import offset_at, offset_bounds

Array = NDArray[np.float64]
Triple = tuple[float, float, float]
BEGIN, DURATION, END, TABLE = 0, 1, 2, 5
"""Columns: begin, duration, position, velocity and acceleration at the end, then the table."""
SIZE = OFFSET_DEGREE + 1
ROWS, COLUMNS = 12, TABLE + SIZE * SIZE * 2
KEPT = 5
"""Pieces that are over or in force, which a new plan keeps: impacts may be heard late."""
_SAMPLES = 32  # of a piece, where its largest position is looked for

plan_type = types.float64[:, ::1]


def empty_plan() -> Array:
    """A plan that adds nothing."""
    plan = np.zeros((ROWS, COLUMNS))
    plan[:, BEGIN] = math.inf
    plan[0, BEGIN], plan[0, DURATION] = -math.inf, 1.0
    return plan


new_plan = rare_kernel(empty_plan)


@rare_kernel
def table_of(row: Array) -> Any:
    """The derivatives 0 to 5 of a piece as polynomials of (t − begin)/duration: (6, 6, 2)."""
    return row[TABLE:].reshape((SIZE, SIZE, 2))


@rare_kernel
def piece_at(plan: Array, t: float) -> int:
    """The row in force just after an instant."""
    i = 0
    while i + 1 < ROWS and plan[i + 1, BEGIN] <= t:
        i += 1
    return i


@rare_kernel
def is_still(state: Triple) -> bool:
    """Whether a state of the offset is that of no offset."""
    return state[0] == 0.0 and state[1] == 0.0 and state[2] == 0.0


@kernel
def over_at(row: Array) -> float:
    """When a piece has led the offset to nothing; inf: it has not when the next one begins."""
    still = is_still((row[END], row[END + 1], row[END + 2]))
    return row[BEGIN] + row[DURATION] if still else math.inf


@rare_kernel
def offset_state(plan: Array, t: float) -> Triple:
    """Position, velocity and acceleration of the offset at an instant."""
    row = plan[piece_at(plan, t)]
    if t >= over_at(row):
        return 0.0, 0.0, 0.0
    p, v, a, _, _, _ = offset_at(table_of(row), row[DURATION] * GIGA, t - row[BEGIN])
    return p, v, a


_quintic = kernel(quintic_coefficients)


@rare_kernel
def write_piece(row: Array, begin: float, end: float, s: Triple, e: Triple) -> None:
    """Enter the quintic from state s at `begin` to state e at `end`."""
    t = end - begin
    row[BEGIN], row[DURATION] = begin, t
    row[END], row[END + 1], row[END + 2] = e
    rise = e[0] - s[0]
    v0, v1 = s[1] * t, e[1] * t
    a0, a1 = 0.5 * s[2] * t * t, 0.5 * e[2] * t * t
    table = table_of(row)
    table[:] = 0.0
    table[0, 0, 0], table[0, 1, 0], table[0, 2, 0] = s[0], v0, a0
    table[0, 3, 0], table[0, 4, 0], table[0, 5, 0] = _quintic(rise, v0, v1, a0, a1)
    for order in range(1, SIZE):
        for i in range(SIZE - order):
            table[order, i, 0] = (i + 1) * table[order - 1, i + 1, 0] / t


@rare_kernel
def largest_acceleration(row: Array) -> float:
    """Largest absolute acceleration of a piece, rounded up."""
    bounds: Triple = offset_bounds(table_of(row), row[DURATION] * GIGA, 0.0, row[DURATION])
    return bounds[0]


@rare_kernel
def largest_position(row: Array, acceleration: float) -> float:
    """A bound from above of the absolute position of a piece, whose acceleration is bounded."""
    top = 0.0
    table = table_of(row)
    for i in range(_SAMPLES + 1):
        x, p = i / _SAMPLES, 0.0
        for k in range(OFFSET_DEGREE, -1, -1):
            p = p * x + table[0, k, 0]
        top = max(top, abs(p))
    step = row[DURATION] / _SAMPLES
    return top + 0.125 * acceleration * step * step


@rare_kernel
def use_of_limits(row: Array, position_limit: float, acceleration_limit: float) -> float:
    """Largest part of the limits that a piece uses; not above 1: it keeps within both."""
    acceleration = largest_acceleration(row)
    part = acceleration / acceleration_limit
    if part > 1.0:
        return part
    return max(part, largest_position(row, acceleration) / position_limit)


@rare_kernel
def keep_past(plan: Array, t: float, out: Array) -> int:
    """Copy what is in force before t, a few pieces of it; how many rows that is."""
    out[:] = new_plan()
    last = piece_at(plan, t)
    while last > 0 and plan[last, BEGIN] >= t:
        last -= 1
    first = max(0, last + 1 - KEPT)
    for i in range(first, last + 1):
        out[i - first] = plan[i]
    return last + 1 - first

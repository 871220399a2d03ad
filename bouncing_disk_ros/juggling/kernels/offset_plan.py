"""An offset of the platform as quintic pieces, for kernels.

Units of the next-collision map: time 1/ω (so that an instant is a forcing phase, never wrapped),
length πg/ω². A plan is an array (ROWS, COLUMNS): each piece with its begin, duration, coefficients
over x = (t − begin)/duration and the state at its end. A piece is in force until the next one
begins; after its own end its position is held.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import rare_kernel

Array = NDArray[np.float64]
ROWS, COLUMNS = 12, 11
BEGIN, DURATION, FIRST, END = 0, 1, 2, 8
"""Columns: begin, duration, six coefficients, and position, velocity, acceleration at the end."""
KEPT = 5
"""Pieces that are over or in force, which a new plan keeps: impacts may be heard late."""
_SAMPLES = 32  # of a piece, where its largest position is looked for

plan_type = types.float64[:, ::1]


def empty_plan() -> Array:
    """A plan that adds nothing."""
    plan = np.zeros((ROWS, COLUMNS))
    plan[:, BEGIN] = np.inf
    plan[0, BEGIN], plan[0, DURATION] = -np.inf, 1.0
    return plan


@rare_kernel
def clear_plan(plan: Array) -> None:
    """Make it one that adds nothing."""
    plan[:] = 0.0
    plan[:, BEGIN] = math.inf
    plan[0, BEGIN], plan[0, DURATION] = -math.inf, 1.0


@rare_kernel
def piece_at(plan: Array, t: float) -> int:
    """The row in force just after an instant."""
    i = 0
    while i + 1 < ROWS and plan[i + 1, BEGIN] <= t:
        i += 1
    return i


@rare_kernel
def offset_state(plan: Array, t: float) -> tuple[float, float, float]:
    """Position, velocity and acceleration of the offset at an instant."""
    row = plan[piece_at(plan, t)]
    span = row[DURATION]
    x = (t - row[BEGIN]) / span
    if not x < 1.0 or row[BEGIN] == -math.inf:
        return row[END], 0.0, 0.0
    p = v = a = 0.0
    for k in range(5, -1, -1):
        c = row[FIRST + k]
        p = p * x + c
        if k > 0:
            v = v * x + k * c
        if k > 1:
            a = a * x + k * (k - 1) * c
    return p, v / span, a / (span * span)


@rare_kernel
def write_piece(
    row: Array, begin: float, end: float, s: tuple[float, float, float],
    e: tuple[float, float, float],
) -> None:  # fmt: skip
    """Enter the quintic from state s at `begin` to state e at `end`."""
    t = end - begin
    row[BEGIN], row[DURATION] = begin, t
    row[END], row[END + 1], row[END + 2] = e
    rise = e[0] - s[0]
    v0, v1 = s[1] * t, e[1] * t
    a0, a1 = 0.5 * s[2] * t * t, 0.5 * e[2] * t * t
    row[FIRST], row[FIRST + 1], row[FIRST + 2] = s[0], v0, a0
    row[FIRST + 3] = 10.0 * rise - 6.0 * v0 - 4.0 * v1 - 3.0 * a0 + a1
    row[FIRST + 4] = -15.0 * rise + 8.0 * v0 + 7.0 * v1 + 3.0 * a0 - 2.0 * a1
    row[FIRST + 5] = 6.0 * rise - 3.0 * v0 - 3.0 * v1 - a0 + a1


@rare_kernel
def largest_acceleration(row: Array) -> float:
    """Largest absolute acceleration of a piece: at an end or where the third derivative is 0."""
    c2, c3, c4, c5 = (
        2.0 * row[FIRST + 2], 6.0 * row[FIRST + 3], 12.0 * row[FIRST + 4], 20.0 * row[FIRST + 5]
    )  # fmt: skip
    top = max(abs(c2), abs(c2 + c3 + c4 + c5))
    root = c4 * c4 - 3.0 * c5 * c3
    if root >= 0.0:
        q = -(c4 + (math.sqrt(root) if c4 >= 0.0 else -math.sqrt(root)))
        x = q / (3.0 * c5) if c5 != 0.0 else -1.0
        if 0.0 < x < 1.0:
            top = max(top, abs(c2 + x * (c3 + x * (c4 + x * c5))))
        x = c3 / q if q != 0.0 else -1.0
        if 0.0 < x < 1.0:
            top = max(top, abs(c2 + x * (c3 + x * (c4 + x * c5))))
    return top / (row[DURATION] * row[DURATION])


@rare_kernel
def largest_position(row: Array, acceleration: float) -> float:
    """A bound from above of the absolute position of a piece, whose acceleration is bounded."""
    top = 0.0
    for i in range(_SAMPLES + 1):
        x, p = i / _SAMPLES, 0.0
        for k in range(5, -1, -1):
            p = p * x + row[FIRST + k]
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
def is_still(state: tuple[float, float, float]) -> bool:
    """Whether a state of the offset is that of no offset."""
    return state[0] == 0.0 and state[1] == 0.0 and state[2] == 0.0


@rare_kernel
def keep_past(plan: Array, t: float, out: Array) -> int:
    """Copy what is in force before t, a few pieces of it; how many rows that is."""
    clear_plan(out)
    last = piece_at(plan, t)
    while last > 0 and plan[last, BEGIN] >= t:
        last -= 1
    first = max(0, last + 1 - KEPT)
    for i in range(first, last + 1):
        out[i - first] = plan[i]
    return last + 1 - first

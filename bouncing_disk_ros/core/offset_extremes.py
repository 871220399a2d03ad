"""Largest position, velocity, acceleration and jump of velocity of an offset trajectory, compiled.

Extremes lie at ends of a segment and where the next derivative is 0. These zeros are found in
float64 between those of the derivative after it; values there are summed in double-double numbers
and rounded once, so that each is the value at some instant of the segment, right to half an ulp
(but for cancellation beyond 1e-14), and off the extreme by the square of the zero's error.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import (
    entry,
    kernel,
    pair_product,
    pair_quotient,
    pair_sum,
    rare_kernel,
    two_sum,
)
from bouncing_disk_ros.core.offset import CONSTANT, CUBIC, LINE, Extremes, Lane, Segment

_SIZE = 6
"""Coefficients of a polynomial of degree 5."""
_COLUMNS = 9
"""Of a row: degree, whole seconds and further ns, the three numbers of either state."""
_ROUGH = 1e-13
"""Error of a polynomial in float64, over the sum of its coefficients' absolute values."""
_NEAR = 1e-12
"""A last step of Newton's method, which leaves its square; so near an extreme all is flat."""
_STEPS = 100
"""Most steps of a search: bisection alone takes some 60 to the last bit of a place in (0, 1)."""


def newest_extremes(lane: Lane) -> Extremes:
    """Extremes of the trajectory spliced last, with the jump where it takes over."""
    plan = lane.plans[-1]
    found = extremes(plan.segments)
    return found._replace(jump=max(found.jump, abs(lane.jump_at(plan.begin_ns))))


def extremes(segments: Sequence[Segment]) -> Extremes:
    """Of segments that follow each other."""
    rows = [
        number
        for begin_ns, end_ns, start, end, degree in segments
        for number in (degree, *divmod(end_ns - begin_ns, 10**9), *start, *end)
    ]
    return Extremes(*_largest_of(np.array(rows, np.float64).reshape(-1, _COLUMNS)))


@rare_kernel
def _add(c: NDArray[np.float64], power: int, high: float, low: float, factor: float) -> None:
    """Add a multiple of a pair of numbers to a coefficient."""
    h, l = pair_product(high, low, factor, 0.0)  # noqa: E741
    c[power, 0], c[power, 1] = pair_sum(c[power, 0], c[power, 1], h, l)


@rare_kernel
def _enter(c: NDArray[np.float64], row: NDArray[np.float64]) -> tuple[float, float]:
    """Coefficients of a segment over x in [0, 1], as pairs; its duration in s, as a pair."""
    c[:] = 0.0
    c[0, 0] = row[3]
    if row[0] == CONSTANT:
        return 1.0, 0.0
    th, tl = pair_quotient(row[2], 0.0, 1e9)
    th, tl = pair_sum(row[1], 0.0, th, tl)
    rh, rl = two_sum(row[6], -row[3])
    if row[0] == LINE:
        c[1, 0], c[1, 1] = rh, rl
        return th, tl
    vh, vl = pair_product(th, tl, row[4], 0.0)
    wh, wl = pair_product(th, tl, row[7], 0.0)
    c[1, 0], c[1, 1] = vh, vl
    if row[0] == CUBIC:
        _add(c, 2, rh, rl, 3.0)
        _add(c, 2, vh, vl, -2.0)
        _add(c, 2, wh, wl, -1.0)
        _add(c, 3, vh, vl, 1.0)
        _add(c, 3, wh, wl, 1.0)
        _add(c, 3, rh, rl, -2.0)
        return th, tl
    sh, sl = pair_product(th, tl, th, tl)
    ah, al = pair_product(sh, sl, 0.5 * row[5], 0.0)
    bh, bl = pair_product(sh, sl, 0.5 * row[8], 0.0)
    c[2, 0], c[2, 1] = ah, al
    for power in range(3, _SIZE):
        q = power - 3
        _add(c, power, rh, rl, (10.0, -15.0, 6.0)[q])
        _add(c, power, vh, vl, (-6.0, 8.0, -3.0)[q])
        _add(c, power, wh, wl, (-4.0, 7.0, -3.0)[q])
        _add(c, power, ah, al, (-3.0, 3.0, -1.0)[q])
        _add(c, power, bh, bl, (1.0, -2.0, 1.0)[q])
    return th, tl


@rare_kernel
def _differentiate(c: NDArray[np.float64]) -> None:
    """Replace a polynomial by its derivative."""
    for power in range(1, _SIZE):
        h, l = pair_product(c[power, 0], c[power, 1], float(power), 0.0)  # noqa: E741
        c[power - 1, 0], c[power - 1, 1] = h, l
    c[_SIZE - 1, 0] = c[_SIZE - 1, 1] = 0.0


@kernel
def _rough(c: NDArray[np.float64], x: float) -> float:
    """A polynomial in float64."""
    total = 0.0
    for power in range(_SIZE - 1, -1, -1):
        total = total * x + c[power, 0]
    return total


@rare_kernel
def _value(c: NDArray[np.float64], x: float) -> tuple[float, float]:
    """A polynomial as a pair of numbers."""
    h, l = 0.0, 0.0  # noqa: E741
    for power in range(_SIZE - 1, -1, -1):
        h, l = pair_product(h, l, x, 0.0)  # noqa: E741
        h, l = pair_sum(h, l, c[power, 0], c[power, 1])  # noqa: E741
    return h, l


@rare_kernel
def _zero_between(c: NDArray[np.float64], low: float, high: float) -> float:
    """Where a polynomial that is monotone between two places changes its sign; -1: nowhere."""
    below, above = _rough(c, low), _rough(c, high)
    if not below * above < 0.0:
        return -1.0
    x = low + (high - low) * (below / (below - above))
    for _ in range(_STEPS):
        if not low < x < high:
            x = 0.5 * (low + high)
            if not low < x < high:
                break
        value, slope = 0.0, 0.0
        for power in range(_SIZE - 1, -1, -1):
            slope = slope * x + value
            value = value * x + c[power, 0]
        if value == 0.0:
            break
        width = high - low
        if (value > 0.0) == (below > 0.0):
            low = x
        else:
            high = x
        step = -value / slope if slope != 0.0 else 2.0
        if abs(step) < _NEAR:
            x += step
            break
        halved = high - low <= 0.5 * width
        x = x + step if halved or abs(step) < 0.25 * width else 0.5 * (low + high)
    return x


@rare_kernel
def _zeros(c: NDArray[np.float64], places: NDArray[np.float64], count: int) -> int:
    """Replace the zeros of a derivative by those of the polynomial; how many there are.

    `places` holds `count` rising numbers in (0, 1).
    """
    found, low = 0, 0.0
    for i in range(count + 1):
        high = places[i] if i < count else 1.0
        x = _zero_between(c, low, high)
        low = high
        if x > 0.0:
            places[found] = x  # found <= i: that place has been read
            found += 1
    return found


@kernel
def _ratio(ah: float, al: float, bh: float, bl: float) -> float:
    """Quotient of two pairs of numbers, rounded."""
    q = ah / bh
    ph, pl = pair_product(bh, bl, q, 0.0)
    rh, _ = pair_sum(ah, al, -ph, -pl)
    return q + rh / bh


@kernel
def _sizes(c: NDArray[np.float64]) -> float:
    """Sum of the absolute values of the coefficients."""
    total = 0.0
    for power in range(_SIZE):
        total += abs(c[power, 0])
    return total


@rare_kernel
def _inner(
    c: NDArray[np.float64],
    th: float,
    tl: float,
    work: NDArray[np.float64],
    most: NDArray[np.float64],
) -> None:
    """Take in the extremes of a cubic or quintic within it; c: of its derivatives 0 to 3."""
    places, before = work[0], work[1]
    sh, sl = pair_product(th, tl, th, tl)
    turn = -c[3, 1, 0] / (2.0 * c[3, 2, 0]) if c[3, 2, 0] != 0.0 else -1.0
    earlier, places[0] = 1 if 0.0 < turn < 1.0 else 0, turn
    for order in (2, 1, 0):
        uh, ul = (sh, sl) if order == 2 else (th, tl) if order == 1 else (1.0, 0.0)
        # at the zeros of the next derivative; where that only touches 0, at those of the one after
        before[:earlier] = places[:earlier]
        count = _zeros(c[order + 1], places, earlier)
        least = most[order] * uh - _ROUGH * _sizes(c[order])
        for k in range(earlier + count):
            x = before[k] if k < earlier else places[k - earlier]
            if abs(_rough(c[order], x)) >= least:
                h, l = _value(c[order], x)  # noqa: E741
                most[order] = max(most[order], abs(_ratio(h, l, uh, ul)))
        earlier = count


@rare_kernel
def _ends(
    c: NDArray[np.float64],
    row: NDArray[np.float64],
    th: float,
    tl: float,
    most: NDArray[np.float64],
) -> tuple[float, float]:
    """Take in a segment's ends; its velocities there."""
    degree, entered, ended = row[0], row[4], row[7]
    if degree == CONSTANT:
        entered = ended = 0.0
    elif degree == LINE:
        entered = ended = _ratio(c[1, 0], c[1, 1], th, tl)
    elif degree == CUBIC:
        sh, sl = pair_product(th, tl, th, tl)
        h, l = pair_product(c[2, 0], c[2, 1], 2.0, 0.0)  # noqa: E741
        most[2] = max(most[2], abs(_ratio(h, l, sh, sl)))
        uh, ul = pair_product(c[3, 0], c[3, 1], 6.0, 0.0)
        h, l = pair_sum(h, l, uh, ul)  # noqa: E741
        most[2] = max(most[2], abs(_ratio(h, l, sh, sl)))
    else:
        most[2] = max(most[2], abs(row[5]), abs(row[8]))
    most[0] = max(most[0], abs(row[3]), abs(row[6]))
    most[1] = max(most[1], abs(entered), abs(ended))
    return entered, ended


@entry(types.UniTuple(types.float64, 4)(types.float64[:, ::1]))
def _largest_of(table: NDArray[np.float64]) -> tuple[float, float, float, float]:
    """The four numbers of `Extremes` for rows of `_COLUMNS`."""
    c, work, most = np.zeros((4, _SIZE, 2)), np.zeros((2, _SIZE)), np.zeros(4)
    before = 0.0
    for i in range(len(table)):
        th, tl = _enter(c[0], table[i])
        entered, ended = _ends(c[0], table[i], th, tl, most)
        if i > 0:
            most[3] = max(most[3], abs(entered - before))
        before = ended
        if table[i, 0] > LINE:
            for order in range(1, 4):
                c[order] = c[order - 1]
                _differentiate(c[order])
            _inner(c, th, tl, work, most)
    return most[0], most[1], most[2], most[3]

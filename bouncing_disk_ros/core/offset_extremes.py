"""Largest position, velocity, acceleration and jump of velocity of an offset trajectory, compiled.

Extremes lie at the ends of a segment and at the zeros of the next derivative, which are found
between the zeros of the derivative after it. A value is computed by a polynomial in the time from
the nearer end, so that a value stated at an end comes out unchanged, to the bit. The segment takes
each other value too, up to the rounding of the polynomial's terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core.compilation import entry, kernel, rare_kernel
from bouncing_disk_ros.core.offset import (
    CONSTANT,
    CUBIC,
    LINE,
    QUINTIC,
    Extremes,
    Lane,
    Segment,
    quintic_coefficients,
)

_SIZE = 6
"""Coefficients of a polynomial of degree 5."""
_NEAR = 1e-8
"""Last step of a search, over the duration: a value at an extreme is off by its square."""


def newest_extremes(lane: Lane) -> Extremes:
    """Extremes of the trajectory spliced last, with the jump where it takes over."""
    plan = lane.plans[-1]
    found = extremes(plan.segments)
    return found._replace(jump=max(found.jump, abs(lane.jump_at(plan.begin_ns))))


def extremes(segments: Sequence[Segment]) -> Extremes:
    """Extremes of segments of which each begins where the one before it ends."""
    first = segments[0]
    instants = [first.begin_ns, *[one.end_ns for one in segments]]
    states = [*first.start, *chain.from_iterable([one.end for one in segments])]
    return Extremes(
        *_largest_of(
            np.array(instants, np.int64),
            np.array([one.degree for one in segments], np.int64),
            np.array(states, np.float64).reshape(-1, 3),
        )
    )


_quintic = kernel(quintic_coefficients)


@kernel
def _enter(
    d: NDArray[np.float64],
    degree: int,
    t: float,
    start: tuple[float, float, float],
    end: tuple[float, float, float],
) -> None:
    """Coefficients of a segment of duration t and of its derivatives."""
    (p0, v0, a0), (p1, v1, a1) = start, end
    rise = (p1 - p0) / t
    c = d[0]
    c[0], c[1], c[2], c[3], c[4], c[5] = p0, v0, 0.5 * a0, 0.0, 0.0, 0.0
    if degree <= LINE:
        c[1], c[2] = rise, 0.0
    elif degree == CUBIC:
        c[2] = (3.0 * rise - 2.0 * v0 - v1) / t
        c[3] = (v0 + v1 - 2.0 * rise) / t / t
    else:
        c3, c4, c5 = _quintic(rise, v0, v1, 0.5 * a0 * t, 0.5 * a1 * t)
        c[3], c[4], c[5] = c3 / t / t, c4 / t / t / t, c5 / t / t / t / t
    for order in range(1, QUINTIC):
        for power in range(_SIZE - order):
            d[order, power] = (power + 1) * d[order - 1, power + 1]


@kernel
def _value(c: NDArray[np.float64], degree: int, x: float) -> float:
    """Value of a polynomial."""
    total = c[degree]
    for power in range(degree - 1, -1, -1):
        total = total * x + c[power]
    return total


@kernel
def _zero_between(
    c: NDArray[np.float64], degree: int, low: float, high: float, below: float, above: float,
    near: float,
) -> float:  # fmt: skip
    """Where a polynomial is 0 between two places where it has these values, of other signs.

    By Newton's method while each step is at most half the one before it, else by bisection.
    """
    x = low + (high - low) * (below / (below - above))
    step = high - low
    while abs(step) > near:
        value, slope = c[degree], 0.0
        for power in range(degree - 1, -1, -1):
            slope = slope * x + value
            value = value * x + c[power]
        if (value < 0.0) == (below < 0.0):
            low = x
        else:
            high = x
        newton = -value / slope if slope != 0.0 else np.inf
        if abs(newton) <= 0.5 * abs(step) and low <= x + newton <= high:
            step = newton
        else:
            step = 0.5 * (low + high) - x
        x += step
    return x


@rare_kernel
def _zeros(
    c: NDArray[np.float64], degree: int, places: NDArray[np.float64], count: int, t: float
) -> int:
    """Replace the zeros of a derivative in (0, t] by the polynomial's zeros; how many they are.

    `places` holds `count` numbers that do not fall. A zero at 0 is left out.
    """
    found, low, below = 0, 0.0, c[0]
    for i in range(count + 1):
        high = places[i] if i < count else t
        above = _value(c, degree, high)
        if above == 0.0:
            places[found] = high  # found <= i: that place has been read
            found += 1
        elif below != 0.0 and (below < 0.0) != (above < 0.0):
            places[found] = _zero_between(c, degree, low, high, below, above, _NEAR * t)
            found += 1
        low, below = high, above
    return found


@rare_kernel
def _take_segment(
    d: NDArray[np.float64], e: NDArray[np.float64], degree: int, t: float,
    places: NDArray[np.float64], most: NDArray[np.float64],
) -> None:  # fmt: skip
    """Take in the extremes of a segment: d from its begin, e backwards from its end."""
    for order in range(3):
        most[order] = max(most[order], abs(d[order, 0]), abs(e[order, 0]))
    count = 0
    for order in range(degree - 2, -1, -1):
        count = _zeros(d[order + 1], degree - order - 1, places, count, t)
        for k in range(count if order < 3 else 0):
            x = places[k]
            c, since = (d, x) if x + x <= t else (e, t - x)
            most[order] = max(most[order], abs(_value(c[order], degree - order, since)))


@entry(types.UniTuple(types.float64, 4)(types.int64[::1], types.int64[::1], types.float64[:, ::1]))
def _largest_of(
    instants: NDArray[np.int64], degrees: NDArray[np.int64], states: NDArray[np.float64]
) -> tuple[float, float, float, float]:
    """The four numbers of `Extremes`: instants in ns and states at both ends of each segment."""
    d, e = np.zeros((_SIZE, _SIZE)), np.zeros((_SIZE, _SIZE))
    places, most = np.zeros(_SIZE), np.zeros(4)
    before = 0.0
    for i in range(len(degrees)):
        p0, v0, a0 = states[i]
        p1, v1, a1 = states[i + 1]
        if degrees[i] == CONSTANT:
            p1, v0, v1, a0, a1 = p0, 0.0, 0.0, 0.0, 0.0
        t = (instants[i + 1] - instants[i]) / 1e9
        _enter(d, degrees[i], t, (p0, v0, a0), (p1, v1, a1))
        _enter(e, degrees[i], t, (p1, -v1, a1), (p0, -v0, a0))
        _take_segment(d, e, degrees[i], t, places, most)
        if i > 0:
            most[3] = max(most[3], abs(d[0, 1] - before))
        before = -e[0, 1]
    return most[0], most[1], most[2], most[3]

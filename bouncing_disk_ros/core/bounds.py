"""Bounds of the platform's derivatives over a piece of a motion: what certifies each search step.

A steady motion has one set of bounds for all times. A cross-fade is cut into panels of at most one
period of the moment, over which the frequency at most doubles: so the steps of a search follow the
frequency of the moment, not the highest of the whole fade.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from bouncing_disk_ros.core.arithmetic import TWO_PI, chosen_by_motion, kernel, rare_kernel
from bouncing_disk_ros.core.layout import STEADY
from bouncing_disk_ros.core.platform import ROOM, Record, derivative_bounds, fade_time

_FEWEST_PANELS = 16.0
_SECOND_PEAK = 0.5 - math.sqrt(3.0) / 6.0  # where |b''| is largest, 10/√3; and at 1 minus that


class Bounds(NamedTuple):
    """Bounds of |s̈|, |s⃛|, |s⁗| and |β̈|, |β⃛|, |β⁗|, valid up to the delay `until` (s)."""

    s2: float
    s3: float
    s4: float
    b2: float
    b3: float
    b4: float
    until: float


@chosen_by_motion
def bounds_of_offset(
    _motion: Record, _begin: float, _end: float
) -> tuple[float, float, float, float, float, float]:
    """Bounds of |p̈|, |p⃛|, |p⁗| and |q̈|, |q⃛|, |q⁗| between two values of `elapsed`."""
    return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0


@chosen_by_motion
def span_within_offset(_motion: Record, span: float) -> float:
    """A span of time, s, of which no segment of an offset has more than a few."""
    return span


@kernel
def bounds_from(motion: Record, elapsed: float, d: float) -> Bounds:
    """Bounds from the delay d on, to the end of the panel of a cross-fade that holds d.

    `elapsed` is that of delay 0 in the cross-fade, in s.
    """
    if motion.kind == STEADY:
        return _whole(motion)
    return _fading_bounds_from(motion, elapsed, d)


@rare_kernel
def _fading_bounds_from(motion: Record, elapsed: float, d: float) -> Bounds:
    span = span_from(motion, elapsed + d, motion.duration / _FEWEST_PANELS, 1.0)
    end = d + span_within_offset(motion, span)
    return _fading_bounds(motion, elapsed, d, end)


@kernel
def span_from(motion: Record, elapsed: float, longest: float, periods: float) -> float:
    """Seconds: at most `longest`, and so many periods of the moment; the frequency doubles at most.

    `elapsed` seconds into a cross-fade.
    """
    f = frequency_at(motion, elapsed)
    span = min(longest, periods / f)
    for _ in range(60):
        if frequency_at(motion, elapsed + span) <= 2.0 * f:
            break
        span *= 0.5
    return span


@kernel
def frequency_at(motion: Record, elapsed: float) -> float:
    """f, `elapsed` seconds into a cross-fade, Hz; that of its end after it."""
    x = min(max(fade_time(motion, elapsed) / motion.duration, 0.0), 1.0)
    return motion.f + motion.df * _blend(x)


@kernel
def _whole(motion: Record) -> Bounds:
    return Bounds(motion.s2, motion.s3, motion.s4, motion.b2, motion.b3, motion.b4, math.inf)


@kernel
def bounds_between(motion: Record, elapsed: float, d: float, end: float) -> Bounds:
    """Bounds between two delays, s."""
    if motion.kind == STEADY:
        return _whole(motion)
    return _fading_bounds(motion, elapsed, d, end)


@rare_kernel
def _fading_bounds(motion: Record, elapsed: float, d: float, end: float) -> Bounds:
    r = 1.0 / motion.duration
    since = fade_time(motion, elapsed)
    x0, x1 = min(max(since + d, 0.0) * r, 1.0), min(max(since + end, 0.0) * r, 1.0)
    b1, b2, b3, b4 = _blend_bounds(x0, x1, r)
    low, high = _blend(x0), _blend(x1)
    w = TWO_PI * _largest(motion.f, motion.df, low, high)
    dw, turn = TWO_PI * abs(motion.df), abs(motion.dlag)
    a = _largest(motion.a, motion.da, low, high)
    p = _largest(motion.p, motion.dp, low, high)
    z, y = abs(motion.da), abs(motion.dp)
    s2, s3, s4 = derivative_bounds(
        (a, z * b1, z * b2, z * b3, z * b4), w, dw * b1, dw * b2, dw * b3
    )
    q2, q3, q4 = dw * b1 + turn * b2, dw * b2 + turn * b3, dw * b3 + turn * b4
    c2, c3, c4 = derivative_bounds((p, y * b1, y * b2, y * b3, y * b4), w + turn * b1, q2, q3, q4)
    x2, x3, x4, y2, y3, y4 = bounds_of_offset(motion, elapsed + d, elapsed + end)
    return Bounds(
        (s2 + x2) * ROOM, (s3 + x3) * ROOM, (s4 + x4) * ROOM,
        (c2 + y2) * ROOM, (c3 + y3) * ROOM, (c4 + y4) * ROOM, end,
    )  # fmt: skip


@kernel
def _largest(begin: float, change: float, low: float, high: float) -> float:
    """Bound of a value that fades, also as it is rounded where it comes near 0."""
    largest = max(begin + change * low, begin + change * high)
    return largest + 2e-15 * max(begin, begin + change)


@kernel
def _blend(x: float) -> float:
    return x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)


@kernel
def _second(x: float) -> float:
    return abs(60.0 * x * (1.0 - x) * (1.0 - 2.0 * x))


@kernel
def _blend_bounds(x0: float, x1: float, r: float) -> tuple[float, float, float, float]:
    """Largest |b'|, |b''|, |b'''|, |b''''| in time for σ in [x0, x1]; r = 1/duration."""
    x = min(max(0.5, x0), x1)
    b1 = 30.0 * x * x * (1.0 - x) * (1.0 - x)
    b2 = max(_second(x0), _second(x1))
    if x0 <= _SECOND_PEAK <= x1 or x0 <= 1.0 - _SECOND_PEAK <= x1:
        b2 = 10.0 / math.sqrt(3.0)
    b3 = max(abs(1.0 - 6.0 * x0 * (1.0 - x0)), abs(1.0 - 6.0 * x1 * (1.0 - x1)))
    b3 = 60.0 * max(b3, 0.5)  # |b'''| = 30 in the middle
    b4 = 360.0 * max(abs(2.0 * x0 - 1.0), abs(2.0 * x1 - 1.0))
    # with what σ itself is rounded by, where a derivative is next to 0
    b1, b2, b4 = b1 + 1e-15, b2 + 1e-13, b4 + 1e-12
    return b1 * r, b2 * r * r, b3 * r * r * r, b4 * r * r * r * r

"""What an offset adds to the platform's motion, for kernels.

A kernel is compiled for a motion without an offset (layout.MOTION) and, where one is used for the
first time, once more for a motion with one (OFFSET_MOTION): then the functions here stand in place
of those of the same name that add nothing.
"""

from __future__ import annotations

import math
from typing import Any

from bouncing_disk_ros.core.arithmetic import (
    for_offsets,
    kernel,
    pair_sum,
    rare_kernel,
    two_product,
)
from bouncing_disk_ros.core.layout import OFFSET_DEGREE

Record = Any
Table = Any  # float64 (6, 6, 2)
Jet = tuple[float, float, float, float, float]
Six = tuple[float, float, float, float, float, float]

_GIGA = 1e9
PAST_END = 4.0
"""ns: how far past its end a segment is followed (events are searched a little past a boundary)."""
_SLACK = 2e-15  # of the sum of a polynomial's coefficients: the rounding of its bounds


@rare_kernel
def offset_at(table: Table, duration: float, time: float) -> Six:
    """Derivatives 0 to 5 of a segment of `duration` ns, `time` s after its begin, to rounding."""
    t, more = two_product(time, _GIGA)
    x = t / duration
    p, e = two_product(x, duration)
    rest = (((t - p) - e) + more) / duration  # of the quotient
    d0 = d1 = d2 = d3 = d4 = d5 = 0.0
    for order in range(OFFSET_DEGREE + 1):
        high = low = 0.0
        for i in range(OFFSET_DEGREE - order, -1, -1):
            # Horner's step with pairs: what x lacks and the products' errors are carried along
            p, e = two_product(high, x)
            e += high * rest + low * x
            high, low = pair_sum(p, e, table[order, i, 0], table[order, i, 1])
        if order == 0:
            d0 = high
        elif order == 1:
            d1 = high
        elif order == 2:
            d2 = high
        elif order == 3:
            d3 = high
        elif order == 4:
            d4 = high
        else:
            d5 = high
    return d0, d1, d2, d3, d4, d5


@kernel
def added(jet: Jet, p: Six) -> Jet:
    """A platform's jet with an offset."""
    return jet[0] + p[0], jet[1] + p[1], jet[2] + p[2], jet[3] + p[3], jet[4] + p[4]


@kernel
def gap_less(jet: Jet, p: Six, d: float) -> Jet:
    """A gap's jet d seconds on, less what the offset p(t + d) − p(t) − ṗ(t) d takes of it."""
    _, _, p2, p3, p4, p5 = p
    rise = d * d * (p2 / 2.0 + d * (p3 / 6.0 + d * (p4 / 24.0 + d * p5 / 120.0)))
    slope = d * (p2 + d * (p3 / 2.0 + d * (p4 / 6.0 + d * p5 / 24.0)))
    pull = p2 + d * (p3 + d * (p4 / 2.0 + d * p5 / 6.0))
    jerk = p3 + d * (p4 + d * p5 / 2.0)
    return jet[0] - rise, jet[1] - slope, jet[2] - pull, jet[3] - jerk, jet[4] - (p4 + d * p5)


@rare_kernel
def offset_bounds(
    table: Table, duration: float, begin: float, end: float
) -> tuple[float, float, float]:
    """Largest absolute second, third and fourth derivative between two times of a segment, s.

    At the ends, or where the next derivative is 0; rounded up.
    """
    x0 = begin * _GIGA / duration
    x1 = max(x0, min(end * _GIGA, duration + PAST_END) / duration)
    a, b = table[4, 0, 0], table[4, 1, 0]
    s4 = max(abs(a + b * x0), abs(a + b * x1))
    s4 += _SLACK * (abs(a) + abs(b))
    a, b, c = table[3, 0, 0], table[3, 1, 0], table[3, 2, 0]
    s3 = max(abs(a + x0 * (b + x0 * c)), abs(a + x1 * (b + x1 * c)))
    if c != 0.0:
        x = min(max(-0.5 * b / c, x0), x1)
        s3 = max(s3, abs(a + x * (b + x * c)))
    s3 += _SLACK * (abs(a) + abs(b) + abs(c))
    a, b, c, e = table[2, 0, 0], table[2, 1, 0], table[2, 2, 0], table[2, 3, 0]
    s2 = max(abs(a + x0 * (b + x0 * (c + x0 * e))), abs(a + x1 * (b + x1 * (c + x1 * e))))
    root = c * c - 3.0 * b * e
    if root >= 0.0:
        q = -(c + (math.sqrt(root) if c >= 0.0 else -math.sqrt(root)))
        x = x0 if e == 0.0 else min(max(q / (3.0 * e), x0), x1)
        y = x0 if q == 0.0 else min(max(b / q, x0), x1)
        s2 = max(s2, abs(a + x * (b + x * (c + x * e))), abs(a + y * (b + y * (c + y * e))))
    s2 += _SLACK * (abs(a) + abs(b) + abs(c) + abs(e))
    return s2, s3, s4


# --- in place of what adds nothing (see arithmetic.chosen_by_motion) ------------------------------
@for_offsets
def with_axial_offset(motion: Record, elapsed: float, jet: Jet) -> Jet:
    """See `platform`."""
    return added(jet, offset_at(motion.axial, motion.axial_duration, elapsed + motion.axial_lead))


@for_offsets
def with_angular_offset(motion: Record, elapsed: float, jet: Jet) -> Jet:
    """See `platform`."""
    time = elapsed + motion.angular_lead
    return added(jet, offset_at(motion.angular, motion.angular_duration, time))


@for_offsets
def fifth_of_angular_offset(motion: Record) -> float:
    """See `platform`."""
    fifth: float = motion.angular[5, 0, 0]
    return fifth


@for_offsets
def offset_turns(motion: Record) -> bool:
    """See `platform`."""
    return bool(motion.turning != 0)


@for_offsets
def offset_bends(motion: Record) -> bool:
    """See `flight`."""
    return bool(motion.bending != 0)


@for_offsets
def gap_with_offset(motion: Record, elapsed: float, d: float, jet: Jet) -> Jet:
    """See `flight`."""
    p = offset_at(motion.axial, motion.axial_duration, elapsed + motion.axial_lead)
    return gap_less(jet, p, d)


@for_offsets
def fade_time(motion: Record, elapsed: float) -> float:
    """See `platform`."""
    return float(elapsed + motion.fade_lead)


@for_offsets
def fade_end(motion: Record) -> float:
    """See `platform`."""
    return float(motion.fade_end)


@for_offsets
def bounds_of_offset(motion: Record, begin: float, end: float) -> Six:
    """See `platform`."""
    lead = motion.axial_lead
    s2, s3, s4 = offset_bounds(motion.axial, motion.axial_duration, begin + lead, end + lead)
    lead = motion.angular_lead
    b2, b3, b4 = offset_bounds(motion.angular, motion.angular_duration, begin + lead, end + lead)
    return s2, s3, s4, b2, b3, b4


@for_offsets
def span_within_offset(motion: Record, span: float) -> float:
    """See `platform`."""
    return min(span, motion.span)


@for_offsets
def origin_of(motion: Record) -> int:
    """See `forcing_clock`."""
    return motion.origin_ns

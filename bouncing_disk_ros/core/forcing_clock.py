"""Time and forcing phase, tied together without a running sum.

A steady motion holds an anchor (whole ns, whole cycles, phase): an event there is known by its
phase and its time follows; in a cross-fade it is known by its time and the phase follows. Both
directions go through double-double numbers, so after centuries at 100 kHz a phase is still good to
1e-15 rad of its instant.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from bouncing_disk_ros.core.arithmetic import (
    GIGA,
    TWO_PI,
    fast_two_sum,
    floor,
    pair_product,
    pair_quotient,
    pair_sum,
    two_product,
    two_sum,
    wrapped,
)
from bouncing_disk_ros.core.compilation import kernel, rare_kernel
from bouncing_disk_ros.core.layout import FADE, STEADY
from bouncing_disk_ros.core.platform import Record, phase_advance


@kernel
def _pair_of_int(n: int) -> tuple[float, float]:
    high = float(n)
    return high, float(n - int(high))


@kernel
def _whole(high: float, low: float) -> tuple[int, float]:
    """A double-double number as an integer and a remainder in [0, 1)."""
    below = floor(high)
    part = (high - below) + low  # beyond 2⁵³ low alone holds whole units
    more = floor(part)
    rest = part - more
    if rest >= 1.0:  # a tiny negative part, rounded up
        rest = 0.0
        more += 1.0
    return int(below) + int(more), rest


@kernel
def instant_of(motion: Record, cycles: int, tau: float) -> tuple[int, float]:
    """(ns, remainder in ns) of a forcing phase of a steady motion."""
    nh, nl = _pair_of_int(cycles - motion.cycles)
    xh, xl = fast_two_sum(nh, (tau - motion.tau) / TWO_PI)  # of a whole number and a part of 1
    if nl != 0.0:
        xh, xl = two_sum(xh, xl + nl)
    th, tl = pair_product(xh, xl, GIGA, 0.0)
    qh, ql = pair_quotient(th, tl, motion.f)
    n, sub = _whole(qh, ql)
    return motion.begin_ns + n, sub


@kernel
def phase_of(motion: Record, ns: int, sub: float) -> tuple[int, float]:
    """(cycles, τ) of the instant ns + sub, sub in ns."""
    th, tl = _pair_of_int(ns - motion.begin_ns)
    th, tl = pair_sum(th, tl, sub, 0.0)
    xh, xl = pair_product(th, tl, motion.f, 0.0)
    if motion.kind == FADE:
        yh, yl = _faded_cycles(motion, th, tl)
        xh, xl = pair_sum(xh, xl, yh, yl)
    xh, xl = pair_quotient(xh, xl, GIGA)
    n, part = _whole(xh, xl)
    tau = motion.tau + TWO_PI * part
    if tau >= TWO_PI:
        tau -= TWO_PI
        n += 1
    return motion.cycles + n, wrapped(tau)


@rare_kernel
def _faded_cycles(motion: Record, th: float, tl: float) -> tuple[float, float]:
    """What a fade of the frequency has added to the phase, in 1e-9 cycles: Δf D ∫b dσ."""
    dh, dl = _pair_of_int(motion.end_ns - motion.begin_ns)
    # σ = t/D as a pair; D < 2⁵³ ns, so dl = 0 and one Newton step on the quotient is exact enough
    xh, xl = pair_quotient(th, tl, dh)
    x2h, x2l = pair_product(xh, xl, xh, xl)
    x4h, x4l = pair_product(x2h, x2l, x2h, x2l)
    ph, pl = pair_sum(xh, xl, -3.0, 0.0)
    ph, pl = pair_product(ph, pl, xh, xl)
    ph, pl = pair_sum(ph, pl, 2.5, 0.0)
    ph, pl = pair_product(ph, pl, x4h, x4l)
    ch, cl = two_product(dh, motion.df)
    return pair_product(ph, pl, ch, cl + dl * motion.df)


@kernel
def later(ns: int, sub: float, d: float) -> tuple[int, float]:
    """The instant d seconds after ns + sub."""
    h, e = two_product(d, GIGA)
    h, f = two_sum(h, sub)
    n, rest = _whole(h, e + f)
    return ns + n, rest


@kernel
def seconds_between(ns0: int, sub0: float, ns1: int, sub1: float) -> float:
    """Seconds from the first instant to the second."""
    return (float(ns1 - ns0) + (sub1 - sub0)) / GIGA


@kernel
def elapsed(motion: Record, ns: int, sub: float) -> float:
    """Seconds since a fade began, not past its end; 0 for a steady motion.

    Where an offset moves: since the segment or the fade that began last, for all its digits.
    """
    if motion.kind == STEADY:
        return 0.0
    return min((float(ns - motion.origin_ns) + sub) / GIGA, motion.fade_end)


@kernel
def phase_after(tau: float, advance: float) -> tuple[float, float]:
    """Whole turns and the phase in [0, 2π) after τ has grown by `advance` ≥ 0, rad."""
    grown = tau + advance
    if 0.0 <= grown < 2.0 * TWO_PI:  # most, and without a division
        if grown < TWO_PI:
            return 0.0, grown
        return 1.0, grown - TWO_PI
    turns: float = math.floor(grown / TWO_PI)
    if turns > 1.0:
        h, e = two_product(turns, TWO_PI)
        grown = ((grown - h) - e) - turns * 2.4492935982947064e-16
    elif turns == 1.0:
        grown = grown - TWO_PI
    if grown < 0.0:
        grown += TWO_PI
        turns -= 1.0
    elif grown >= TWO_PI:
        grown -= TWO_PI
        turns += 1.0
    return turns, grown


class Clock(NamedTuple):
    """An instant and the forcing phase at it."""

    ns: int
    sub: float  # ns besides, in [0, 1)
    cycles: int
    tau: float


@kernel
def clock_after(motion: Record, clock: Clock, d: float) -> Clock:
    """The clock d seconds on; steady: the phase leads, in a fade: the time leads."""
    ns, sub, cycles, tau = clock
    if motion.kind != STEADY:
        ns1, sub1 = later(ns, sub, d)
        cycles1, tau1 = phase_of(motion, ns1, sub1)
        return Clock(ns1, sub1, cycles1, tau1)
    turns, grown = phase_after(tau, phase_advance(motion, 0.0, d))
    cycles1 = cycles + int(turns)
    ns1, sub1 = instant_of(motion, cycles1, grown)
    return Clock(ns1, sub1, cycles1, grown)

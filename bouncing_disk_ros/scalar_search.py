"""Maximum and root of a function of one variable, and the end of a condition, by their values."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Place = TypeVar("Place", float, NDArray[np.float64])
WIDTH = 1e-12
"""Brackets are closed to this, unless given otherwise: for angles in rad, next to rounding."""
_GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0


def golden_section(
    function: Callable[[float], float], low: float, high: float, width: float = WIDTH
) -> tuple[float, float]:
    """Place and value of the maximum of a function with one maximum between low and high.

    A smooth maximum is flat: its place is known to about √(rounding) only, that of a crease to
    `width`. nan counts as lower than everything.
    """

    def value(x: float) -> float:
        y = function(x)
        return -math.inf if math.isnan(y) else y

    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    fa, fb = value(a), value(b)
    best = max((fa, a), (fb, b))
    while high - low > width:
        if fa >= fb:
            high, b, fb = b, a, fa
            a = high - _GOLDEN * (high - low)
            fa = value(a)
            best = max(best, (fa, a))
        else:
            low, a, fa = a, b, fb
            b = low + _GOLDEN * (high - low)
            fb = value(b)
            best = max(best, (fb, b))
    return best[1], best[0]


def root_between(
    function: Callable[[float], float],
    a: float,
    fa: float,
    b: float,
    fb: float,
    width: float = 0.0,
) -> float:
    """Root of a function with fa ≥ 0 ≥ fb, to `width` or a few roundings: the end where it is ≤ 0.

    The false position with the weight of the end that stays halved (Illinois), halving the bracket
    where that does not.
    """
    for _ in range(200):
        if fa == 0.0:
            return a
        before = abs(b - a)
        if fb == 0.0 or before <= max(width, 4.0 * math.ulp(max(abs(a), abs(b)))):
            return b
        c = b - fb * (b - a) / (fb - fa)
        fc = function(c)
        if fc > 0.0:
            a, fa, fb = c, fc, 0.5 * fb
        else:
            b, fb, fa = c, fc, 0.5 * fa
        if abs(b - a) > 0.5 * before:
            c = 0.5 * (a + b)
            fc = function(c)
            a, fa, b, fb = (c, fc, b, fb) if fc > 0.0 else (a, fa, c, fc)
    return b


def halved(
    holds: Callable[[Place], bool], inside: Place, outside: Place, *, steps: int = 200,
    width: float = 0.0,
) -> tuple[Place, Place]:  # fmt: skip
    """Where a condition ends on the way from a place `inside`, at which it holds, to one outside.

    The way is halved `steps` times, that between numbers until it is `width` long: the last place
    where the condition holds, and the first one where it does not.
    """
    for _ in range(steps):
        if width and abs(outside - inside) <= width:
            break
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside, outside

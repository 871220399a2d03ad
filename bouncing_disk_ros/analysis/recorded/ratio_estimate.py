"""The ratio of two measured columns, both with errors, by the signed-rank test turned round.

Where y = r x holds for the true values, y − r x is all error. If the errors are independent from
row to row and as often positive as negative at each size (symmetric; their sizes may differ from
row to row, and x and y may share them), every ratio r₀ can be tested with Wilcoxon's signed-rank
test of y − r₀ x, whose distribution is known exactly. The ratios that pass are the interval, the
one in the middle is the estimate. So errors in x give no bias, as they would in a regression or
in a mean of ratios; and up to a quarter of the rows may be grossly wrong.

Source: Wilcoxon 1945; Hodges, Lehmann 1963 (the estimate); Fieller 1954 (ratios by inverted tests).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Column = NDArray[np.float64]

LEVEL = 0.95
LEAST_ROWS = 6
"""With fewer rows no two-sided test of 5 % exists: even the clearest signs have a chance 2/2⁵."""
_NORMAL = 1.959963984540054  # 97.5 % of the normal distribution
_EXACT_UP_TO = 60
"""From here on the normal approximation, with its continuity correction, has the same counts."""
_MANY = 1000
"""With more rows than this the gap between two neighbouring ratios of pairs is no matter."""
_DOUBLINGS = 150
"""From the scatter of rounding to 10²⁹: a ratio beyond is unbounded, for Σx may be 0."""
_KOLMOGOROV = 1.949474
"""The largest height of a Brownian bridge passes this with a chance of 0.1 %."""


class Ratio(NamedTuple):
    """A ratio and its interval of 95 %."""

    value: float
    low: float
    high: float


def ratio_of(y: Column, x: Column, resolution: float = 0.0) -> Ratio:
    """The ratio r of y = r x, with its interval of 95 %; all nan without rows or where Σx = 0.

    `resolution`: errors of y − r x below this are rounding, alike in many rows, not chance; the
    interval is widened by it. Fewer than `LEAST_ROWS` rows: the interval is (−inf, inf).
    """
    n, total, value = len(y), float(np.sum(x)), middle_of(y, x)
    if math.isnan(value):
        return Ratio(value, value, value)
    if n < LEAST_ROWS:
        return Ratio(value, -math.inf, math.inf)
    count = critical_count(n, 0.5 * (1.0 - LEVEL))
    low = _crossing(y, x, value, float(n * (n + 1) - 2 * count), strict=False)
    high = _crossing(y, x, value, 2.0 * count, strict=True)
    wide = resolution / abs(total / n)
    return Ratio(value, min(low, value) - wide, max(high, value) + wide)


def middle_of(y: Column, x: Column) -> float:
    """The estimate alone: the ratio whose test is the most balanced; nan without rows or Σx = 0."""
    n, total = len(y), float(np.sum(x))
    if n == 0 or total == 0.0:
        return math.nan
    start = float(np.sum(y)) / total
    above = _crossing(y, x, start, 0.5 * n * (n + 1), strict=True)
    if n > _MANY:
        return above
    return 0.5 * (above + _crossing(y, x, start, 0.5 * n * (n + 1), strict=False))


def lower_bound(y: Column, x: Column) -> float:
    """The ratio that r surely exceeds where y ≤ r x, one-sided 95 %; −inf with too few rows."""
    count = critical_count(len(y), 1.0 - LEVEL)
    if count < 0 or np.sum(x) == 0.0:
        return -math.inf
    n = len(y)
    start = float(np.sum(y) / np.sum(x))
    return _crossing(y, x, start, float(n * (n + 1) - 2 * count), strict=False)


def critical_count(n: int, chance: float) -> int:
    """Largest c with P(W ≤ c) ≤ chance, W the signed-rank statistic of n rows; −1: none."""
    if n <= _EXACT_UP_TO:
        ways = np.ones(1)
        for rank in range(1, n + 1):  # each rank is counted in W or not
            ways = np.concatenate((ways, np.zeros(rank))) + np.concatenate((np.zeros(rank), ways))
        cumulated = np.cumsum(ways) / 2.0**n
        return int(np.searchsorted(cumulated, chance, side="right")) - 1
    quantile = _NORMAL if chance < 0.03 else 1.6448536269514722
    spread = math.sqrt(n * (n + 1) * (2 * n + 1) / 24.0)
    return math.floor(0.25 * n * (n + 1) - quantile * spread - 0.5)


def twice_rank_sum(d: Column) -> tuple[float, Column]:
    """Twice the signed-rank statistic of d (zeros count half), and the signed ranks."""
    n, size = len(d), np.abs(d)
    order = np.argsort(size)
    ordered = size[order]
    begins = np.concatenate(([0], np.flatnonzero(ordered[1:] > ordered[:-1]) + 1))
    ends = np.concatenate((begins[1:], [n]))
    ranks = 0.5 * (begins + ends + 1)  # the mean rank of those that are alike
    scores = np.empty(n)
    scores[order] = ranks if len(ranks) == n else np.repeat(ranks, ends - begins)
    scores *= np.sign(d)
    return 0.5 * n * (n + 1) + float(np.sum(scores)), scores


def _crossing(y: Column, x: Column, start: float, level: float, *, strict: bool) -> float:
    """Where twice the rank sum of y − r x, which falls with r, falls below `level` (strict: to it).

    Found to a millionth of the scatter of the ratio, or to rounding, by the secant of an interval
    that holds it; by halves where that is slow, as at the step of rows without errors.
    """

    def excess(r: float) -> float:
        return twice_rank_sum(y - r * x)[0] - level

    def passed(r: float) -> bool:
        return excess(r) <= 0.0 if strict else excess(r) < 0.0

    scatter = float(np.median(np.abs(y - start * x))) / abs(float(np.mean(x)))
    step = max(scatter / math.sqrt(len(y)), 4.0 * np.finfo(float).eps * max(abs(start), 1e-300))
    low = _beyond(start, -step, lambda r: not passed(r))
    high = _beyond(start, step, passed)
    if math.isinf(low) or math.isinf(high):
        return low if math.isinf(low) else high
    above, below = excess(low), excess(high)
    secant = True
    while high - low > 1e-6 * step:
        width = high - low
        part = above / (above - below) if secant and above > below else 0.5
        middle = low + min(max(part, 0.02), 0.98) * width
        if not low < middle < high:
            middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        value = excess(middle)
        if value < 0.0 or (strict and value == 0.0):
            high, below, above = middle, value, 0.5 * above  # Illinois: the other end counts half
        else:
            low, above, below = middle, value, 0.5 * below
        secant = high - low < 0.5 * width
    return 0.5 * (low + high)


def _beyond(start: float, step: float, reached: Callable[[float], bool]) -> float:
    """The first of start + step, + 2 step, + 4 step, ... at which it is so; ±inf: at none."""
    for _ in range(_DOUBLINGS):
        if reached(start + step):
            return start + step
        step *= 2.0
    return math.copysign(math.inf, step)


def change_of(y: Column, x: Column, ratio: float, resolution: float = 0.0) -> int | None:
    """The row before which the ratio changed; None: the rows are consistent with one ratio.

    The cumulated signed ranks of y − r x make a Brownian bridge if r is one for all; its largest
    height passes the limit used here with a chance of 0.1 %. The row is then the one that parts
    the rows with the least sum of absolute errors. Errors up to `resolution` count as 0.
    """
    d = y - ratio * x
    _, scores = twice_rank_sum(np.where(np.abs(d) <= resolution, 0.0, d))
    scores = scores - np.mean(scores)
    height = np.abs(np.cumsum(scores))
    spread = math.sqrt(float(np.sum(scores**2)))
    if len(d) < 2 * LEAST_ROWS or spread == 0.0 or np.max(height) <= _KOLMOGOROV * spread:
        return None
    at = int(np.argmax(height)) + 1
    first, second = ratio_of(y[:at], x[:at]).value, ratio_of(y[at:], x[at:]).value
    gain = np.abs(y - second * x) - np.abs(y - first * x)  # of counting a row to the first part
    return int(np.argmax(np.cumsum(gain)[:-1])) + 1

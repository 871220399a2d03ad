"""Estimates of restitution and friction from the rows of a run, with intervals.

First the ratio of two measured columns, both with errors, by the signed-rank test turned round.

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

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.distributions import normal_quantile
from bouncing_disk_ros.errors import InputError, counted
from bouncing_disk_ros.field_checks import number, numbers, plain
from bouncing_disk_ros.report.recorded_offset import Offsets, axial_offset
from bouncing_disk_ros.report.section import rows_of, single_impacts
from bouncing_disk_ros.scalar_search import root_between

Column = NDArray[np.float64]

LEVEL = 0.95
LEAST_ROWS = 6
"""With fewer rows no two-sided test of 5 % exists: even the clearest signs have a chance 2/2⁵."""
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
    quantile = normal_quantile(1.0 - chance)
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

    Found to a millionth of the scatter of the ratio, or to rounding.
    """
    aim = level + (0.25 if strict else -0.25)  # twice the rank sum is a multiple of 1/2

    def excess(r: float) -> float:
        return twice_rank_sum(y - r * x)[0] - aim

    scatter = float(np.median(np.abs(y - start * x))) / abs(float(np.mean(x)))
    step = max(scatter / math.sqrt(len(y)), 4.0 * np.finfo(float).eps * max(abs(start), 1e-300))
    low, above = _beyond(excess, start, -step)
    high, below = _beyond(excess, start, step)
    if math.isinf(low) or math.isinf(high):
        return low if math.isinf(low) else high
    return root_between(excess, low, above, high, below, 1e-6 * step)


def _beyond(falling: Callable[[float], float], start: float, step: float) -> tuple[float, float]:
    """First of start + step, + 2 step, … on its side of the root, and its value; ±inf: none."""
    for _ in range(_DOUBLINGS):
        value = falling(start + step)
        if value * step < 0.0:
            return start + step, value
        step *= 2.0
    return math.copysign(math.inf, step), math.nan


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


# ------------------------------------------------------------------------------------------------
# Restitution and friction estimated from recorded impacts alone, with 95 % intervals.
#
# The impact law (docs/model.md): a disk that meets the platform with the relative velocity w_A
# leaves it with −ε w_A; the axial impulse is F̂ = m (1 + ε) |w_A|; friction removes slip up to its
# limit, |Ĥ| = min(m a_g² |w_T|, μ a_e F̂). All rows may have errors in all columns: `ratio_of`
# says what is assumed of them. Systematic errors (a wrong mass, a wrong platform motion) are not
# seen.


SURELY = 3.0
"""A row counts as slipping where the slip left over is this many times the noise."""
_GRID = 128  # trial values for the start of the search for μ
_ENOUGH = 5000  # impacts for that start
_ROUNDS = 20


class Estimate(NamedTuple):
    """An estimated value and its 95 % confidence interval."""

    value: float  # nan: not identifiable, see `note`
    low: float
    high: float  # inf: no upper bound
    impacts: int  # rows that were used
    note: str  # what to know about it; '' if there is nothing


def platform_velocities(rows: NDArray[np.void], motion: Motion, offsets: Offsets = ()) -> Column:
    """Velocity ṡ (m/s) of the platform in steady motion at each row of IMPACT_DTYPE, shape (n,).

    `offsets`: of the run, on top of that motion. nan where the velocity is not known, or jumps.

    >>> record = read_run("run_1")
    >>> platform_velocities(record.rows, record.motion, record.offsets)
    """
    rows, omega = rows_of(rows), math.tau * motion.frequency
    velocities: Column = motion.axial_amplitude * omega * np.cos(rows["forcing_phase"])
    return velocities + axial_offset(rows["time"], offsets, 1) if offsets else velocities


def restitution_of(
    rows: NDArray[np.void],
    platform_velocity: Column | None = None,
    mass: float | None = None,
) -> Estimate:
    """Restitution ε from impacts (IMPACT_DTYPE), by velocities or by impulses.

    With `platform_velocity` (ṡ at each row, m/s, shape (n,); nan leaves a row out, as where the
    motion is changing): from ẋ⁺ − ṡ = ε |w_A|. With `mass` (kg) instead: from F̂ = m (1 + ε) |w_A|.
    ValueError unless exactly one is given, InputError for what cannot be used. Rows that sum
    several impacts are left out; the `note` says so, and also where ε seems to have changed: then
    the interval spans the parts.

    >>> record = read_run("run_1")
    >>> restitution_of(record.rows, mass=record.disk.mass)
    """
    if (platform_velocity is None) == (mass is None):
        raise ValueError("give either platform_velocity or mass")
    rows = rows_of(rows)
    fall = -rows["axial_impact_velocity"]
    if platform_velocity is not None:
        platform_velocity = numbers("platform_velocity", platform_velocity)
        if platform_velocity.shape not in ((), rows.shape):
            shape = f"an array of shape {platform_velocity.shape}"
            raise InputError("platform_velocity", shape, f"one of shape {rows.shape}, as the rows")
        y = rows["axial_velocity"] - platform_velocity
        size = np.abs(rows["axial_velocity"]) + np.abs(platform_velocity)
    else:
        mass = number("mass", plain(mass), math.ulp(0.0))
        y = rows["axial_impulse"] / mass - fall
        size = rows["axial_impulse"] / mass + fall
    use = single_impacts(rows) & np.isfinite(y) & np.isfinite(fall)
    notes = _left_out(rows, use)
    if not np.any(use):
        return Estimate(
            math.nan, 0.0, 1.0, 0, _text(["not identifiable: no single impacts", *notes])
        )
    resolution = precision_of(rows) * float(np.max(size[use]))
    return _bounded(_checked(rows[use], y[use], fall[use], resolution, notes), 1.0)


def friction_of(rows: NDArray[np.void], disk: Disk) -> Estimate:
    """Friction μ from impacts (IMPACT_DTYPE); uses mass, friction and gyration radius of `disk`.

    Slipping impacts have |Ĥ| = μ a_e F̂. Which impacts slip is judged by their velocities, with a
    margin for noise (`SURELY`), and μ by their impulses: so the choice does not bias the estimate.
    Where (almost) every impact sticks there is only a lower bound: value nan, high inf.

    >>> record = read_run("run_1")
    >>> friction_of(record.rows, record.disk)
    """
    rows = rows_of(rows)
    use = single_impacts(rows)
    for name in ("axial_impulse", "angular_impulse", "angular_impact_velocity"):
        use &= np.isfinite(rows[name])
    notes = _left_out(rows, use)
    rows = rows[use]
    pushed = rows["axial_impulse"]
    if not np.any(pushed > 0.0):
        note = _text(["not identifiable: no single impacts", *notes])
        return Estimate(math.nan, 0.0, math.inf, 0, note)
    inertia = disk.inertia
    gripped = -np.sign(rows["angular_impact_velocity"]) * rows["angular_impulse"]
    gripped = gripped / disk.friction_radius
    needed = inertia / disk.friction_radius * np.abs(rows["angular_impact_velocity"])
    left = np.abs(inertia * rows["angular_impact_velocity"] + rows["angular_impulse"])
    expected = _expected(pushed, -rows["axial_impact_velocity"], precision_of(rows))
    resolution = precision_of(rows) * float(np.max(np.abs(needed) + np.abs(gripped)))
    slips = _slipping(gripped, needed, expected, left / disk.friction_radius, resolution)
    if np.sum(slips) < LEAST_ROWS:
        slack = resolution if _scatter(left) <= resolution * disk.friction_radius else math.inf
        bound = _least_friction(gripped, pushed, needed / expected, slack)
        note = _why_unknown(int(np.sum(slips)), len(rows))
        return Estimate(math.nan, bound, math.inf, len(rows), _text([note, *notes]))
    found = _checked(rows[slips], gripped[slips], pushed[slips], resolution, notes)
    demand = needed[slips] / expected[slips]
    found = _compared_by_demand(found, gripped[slips], pushed[slips], demand, resolution)
    return _bounded(found, math.inf)


def _compared_by_demand(
    found: Estimate, gripped: Column, pushed: Column, demand: Column, resolution: float
) -> Estimate:
    """Compare with the half of the rows that slip most; where it differs, span both.

    Locked impacts look like slipping ones where w_T is noisier than the impulses: then their
    demand is noise, and so they are few among the rows of the greatest demand. The order does not
    bend the ratio, for it is one of velocities.
    """
    if len(gripped) < 2 * LEAST_ROWS:
        return found
    most = np.argsort(demand, kind="stable")[len(demand) // 2 :]
    half = ratio_of(gripped[most], pushed[most], resolution)
    if found.low <= half.value <= found.high:
        return found
    note = (
        f"the half that slips most gives {half.value:.4g}: w_T may be too noisy to tell locked "
        "impacts from slipping ones"
    )
    low, high = min(found.low, half.low), max(found.high, half.high)
    return found._replace(low=low, high=high, note=_text([note, found.note]))


def _expected(pushed: Column, fall: Column, precision: float) -> Column:
    """Axial impulses from the velocities alone, with 1 + ε fitted; the recorded where it changed.

    Never 0 or less, so that a ratio to it has the sign of the other number.
    """
    ratio = middle_of(pushed, fall)
    changed = change_of(pushed, fall, ratio, SURELY * precision * float(np.max(pushed)))
    expected = pushed if changed is not None else ratio * fall
    return np.maximum(expected, precision * float(np.max(pushed)))


def _slipping(
    gripped: Column, needed: Column, expected: Column, left: Column, resolution: float
) -> NDArray[np.bool_]:
    """Rows that slip for sure: min(needed, μ expected) fitted to what gripped, then a margin."""
    ratios = np.maximum(gripped / expected, 0.0)
    ends = np.linspace(0.0, 1.0, _GRID)
    trial = np.unique(np.concatenate((np.quantile(ratios, ends), ends * np.max(ratios))))
    part = slice(None, None, -(-len(gripped) // _ENOUGH))
    few = gripped[part], needed[part], expected[part]
    misfit = [float(np.sum(np.abs(few[0] - np.minimum(few[1], r * few[2])))) for r in trial]
    friction = float(trial[int(np.argmin(misfit))])
    chosen = needed > friction * expected
    for _ in range(_ROUNDS):
        limit = friction * expected
        impulses = _scatter(gripped[chosen] - limit[chosen])
        # what sticks by velocities has small w_T, and so by chance small errors of it; what sticks
        # by impulses has errors of w_T of all sizes
        locked = np.abs(gripped) < limit - SURELY * max(impulses, resolution)
        sticks = max(_scatter(left[needed <= limit]), _scatter(left[locked]))
        noise = math.hypot(impulses, sticks)
        before = chosen
        chosen = needed - friction * expected > SURELY * max(noise, resolution)
        if np.array_equal(chosen, before) or np.sum(chosen) < LEAST_ROWS:
            break
        friction = max(middle_of(gripped[chosen], expected[chosen]), 0.0)
    return chosen


def _least_friction(gripped: Column, pushed: Column, demand: Column, slack: float) -> float:
    """A lower bound from the impacts with the greatest demand for friction (by velocities).

    Rows without noise (finite `slack`, their rounding) bound it one by one.
    """
    if math.isfinite(slack):
        return max(float(np.max((gripped - slack) / np.maximum(pushed, slack))), 0.0)
    greatest = np.argsort(demand)[-LEAST_ROWS:]
    return max(lower_bound(gripped[greatest], pushed[greatest]), 0.0)


def _why_unknown(slips: int, impacts: int) -> str:
    if slips or impacts < LEAST_ROWS:
        counted = f"{slips} of {impacts} impacts slip for sure"
        return f"not identifiable: {counted}, at least {LEAST_ROWS} are needed"
    return "not identifiable: every impact sticks, there is only a lower bound"


def _checked(
    rows: NDArray[np.void], y: Column, x: Column, resolution: float, notes: list[str]
) -> Estimate:
    """The ratio with what is to be said of it; where it changes, the interval spans both parts."""
    found = ratio_of(y, x, resolution)
    if len(y) < LEAST_ROWS:
        notes = [f"too few impacts ({len(y)}) for an interval, at least {LEAST_ROWS}", *notes]
    at = change_of(y, x, found.value, SURELY * resolution)
    if at is not None:
        parts = ratio_of(y[:at], x[:at], resolution), ratio_of(y[at:], x[at:], resolution)
        at_index = int(rows["index"][at])
        notes = [f"not one value: {_change(parts)} from about index {at_index} on", *notes]
        found = Ratio(
            found.value, min(p.low for p in (*parts, found)), max(p.high for p in (*parts, found))
        )
    value, low, high = (float(v) for v in found)
    return Estimate(value, low, high, len(y), _text(notes))


def _change(parts: tuple[Ratio, Ratio]) -> str:
    return f"{parts[0].value:.4g} before, {parts[1].value:.4g}"


def _bounded(found: Estimate, most: float) -> Estimate:
    """Within what is possible, unless all of the interval is outside: then it is said."""
    if found.high < 0.0 or found.low > most:
        note = _text([f"outside 0 to {most:g}: check mass, units and platform motion", found.note])
        return found._replace(note=note)
    value, low, high = (min(max(v, 0.0), most) for v in found[:3])
    return found._replace(value=value, low=low, high=high)


def _left_out(rows: NDArray[np.void], use: NDArray[np.bool_]) -> list[str]:
    summed = int(np.sum(~single_impacts(rows)))
    other = int(np.sum(~use)) - summed
    notes = [f"left out {counted(summed, 'row')} of summed impacts"] if summed else []
    return [*notes, f"left out {counted(other, 'row')} without a value"] if other else notes


def precision_of(rows: NDArray[np.void]) -> float:
    """Relative size of rounding in the rows: that of float32 if all values are float32 numbers."""
    names = ("forcing_phase", "axial_impact_velocity", "axial_velocity", "axial_impulse")
    short = all(np.array_equal(rows[name], rows[name].astype(np.float32)) for name in names)
    return 8.0 * float(np.finfo(np.float32 if short else np.float64).eps)


def _scatter(errors: Column) -> float:
    """Standard deviation of errors about 0, from their median; 0 without errors."""
    return 1.4826 * float(np.median(np.abs(errors))) if len(errors) else 0.0


def _text(notes: list[str]) -> str:
    return "; ".join(note for note in notes if note)

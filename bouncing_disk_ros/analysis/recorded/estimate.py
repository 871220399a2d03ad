"""Restitution and friction estimated from recorded impacts alone, with 95 % intervals.

The impact law (docs/model.md): a disk that meets the platform with the relative velocity w_A leaves
it with −ε w_A; the axial impulse is F̂ = m (1 + ε) |w_A|; friction removes slip up to its limit,
|Ĥ| = min(m a_g² |w_T|, μ a_e F̂). All rows may have errors in all columns: see `ratio` for what is
assumed of them. Systematic errors (a wrong mass, a wrong platform motion) are not seen.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.recorded.ratio_estimate import (
    LEAST_ROWS,
    Column,
    Ratio,
    change_of,
    lower_bound,
    middle_of,
    ratio_of,
)
from bouncing_disk_ros.analysis.recorded.recorded_offset import Offsets, axial_offset
from bouncing_disk_ros.analysis.recorded.section import single_impacts
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import counted

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

    `offsets`: of the run, on top of that motion; nan where it is not known, or where it jumps.

    >>> platform_velocities(record.rows, record.motion, record.offsets)
    """
    omega = math.tau * motion.frequency
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
    ValueError unless exactly one is given. Rows that sum several impacts are left out; the `note`
    says so, and also where ε seems to have changed: then the interval spans the parts.

    >>> restitution_of(record.rows, mass=record.disk.mass)
    """
    if (platform_velocity is None) == (mass is None):
        raise ValueError("give either platform_velocity or mass")
    fall = -rows["axial_impact_velocity"]
    if platform_velocity is not None:
        y = rows["axial_velocity"] - platform_velocity
        size = np.abs(rows["axial_velocity"]) + np.abs(platform_velocity)
    else:
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

    >>> friction_of(record.rows, record.disk)
    """
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

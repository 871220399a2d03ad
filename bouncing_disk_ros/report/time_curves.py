"""Curves for a speed that settles, fitted by least squares, with intervals by their profile.

level: c; line: c + b t; ramp: a line that ends on a level; exponential: c + b exp(−t/T). Errors may
last over many points: what counts is the number of points that are independent (`effective`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.distributions import t_quantile
from bouncing_disk_ros.report.estimate import Estimate
from bouncing_disk_ros.scalar_search import halved

Values = NDArray[np.float64]

LEAST = 8
"""Fewer times show nothing."""
_TRIALS = 200
_LONGEST = 100.0
"""Time constants beyond this many spans are a straight line."""
_ROUNDING = 1e-13
_CHI_SQUARE = {1: 10.828, 3: 16.266}
"""99.9 % of χ² by degrees of freedom: how sure a less simple curve must be."""


class Curve(StrEnum):
    """The curves."""

    LEVEL = "level"
    LINE = "line"
    RAMP = "ramp"
    EXPONENTIAL = "exponential"


class Fit(NamedTuple):
    """A curve fitted to speeds."""

    curve: Curve
    start: float  # of the curve at the first time, rad/s
    final: float  # where it ends, rad/s; of a line: at the last time
    slope: float  # line, ramp: rad/s²; exponential: initial − final, rad/s
    shape: float  # ramp: the time of its end, s; exponential: T, s; else nan
    misfit: float  # sum of squares, at least that of rounding


def fit(curve: Curve, times: Values, speeds: Values) -> Fit:
    """The least squares fit of a curve; times rise, shape (n,)."""
    if curve is Curve.LEVEL:
        mean = float(np.mean(speeds))
        return Fit(curve, mean, mean, 0.0, math.nan, _misfit(speeds - mean, speeds))
    if curve is Curve.LINE:
        return _linear(curve, math.nan, times, speeds)
    trials = [_linear(curve, shape, times, speeds) for shape in _shapes(curve, times)]
    at = int(np.argmin([trial.misfit for trial in trials]))
    low, high = trials[max(at - 1, 0)].shape, trials[min(at + 1, len(trials) - 1)].shape
    return _polished(trials[at], low, high, times, speeds)


def residuals(found: Fit, times: Values, speeds: Values) -> Values:
    """What the fit leaves, shape (n,)."""
    basis = _basis(found.curve, found.shape, times)
    errors: Values = speeds - found.slope * basis
    if found.curve is Curve.LINE:
        return errors - found.start
    return errors - found.final


def effective(found: Fit, times: Values, speeds: Values) -> float:
    """How many independent points n/τ there are: τ = 1 + 2 Σ ρ_k of the residuals.

    The sum ends at the first lag beyond 5 τ (Sokal).
    """
    errors = residuals(found, times, speeds)
    n, power = len(errors), float(np.sum(errors**2))
    if power <= n * (_ROUNDING * float(np.max(np.abs(speeds)))) ** 2:
        return float(n)  # a perfect fit: what is left is rounding, not chance
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.fft.rfft(errors, size)
    correlation = np.fft.irfft(np.abs(spectrum) ** 2, size)[:n] / power
    tau = 2.0 * np.cumsum(correlation) - 1.0
    ends = np.flatnonzero(np.arange(n) >= 5.0 * tau)
    length = float(tau[ends[0]]) if len(ends) else float(n)
    return n / min(max(length, 1.0), float(n))


def threshold(more: int, count: float) -> float:
    """The gain count · ln(misfit ratio) that `more` parameters must exceed; inf for few points."""
    return _CHI_SQUARE[more] * count / (count - 4.0) if count > 4.0 else math.inf


def interval(found: Fit, times: Values, speeds: Values, count: float) -> Estimate:
    """95 % interval of a line's or ramp's slope (rad/s²), or of a time constant (s)."""
    n = len(times)
    free = max(count - 3.0, 1.0)
    quantile = t_quantile(free)
    if found.curve is not Curve.EXPONENTIAL:
        basis = _basis(found.curve, found.shape, times)
        columns = [np.ones(n), basis]
        if found.curve is Curve.RAMP:
            columns.append(np.where(times < found.shape, -found.slope, 0.0))
        error = math.sqrt(found.misfit / n * (n / count) * count / free * _variance(columns, 1))
        wide = quantile * error
        return Estimate(found.slope, found.slope - wide, found.slope + wide, n, "")
    most = found.misfit * (1.0 + quantile**2 / free)
    span = float(times[-1] - times[0])

    def inside(shape: float) -> bool:
        return _linear(found.curve, shape, times, speeds).misfit <= most

    low = _edge(inside, found.shape, 1e-3 * span / n)
    high = _edge(inside, found.shape, _LONGEST * span)
    note = "" if high < math.inf else "no upper bound: too little of the approach was seen"
    return Estimate(found.shape, low, high, n, note)


def _variance(columns: list[Values], number: int) -> float:
    """A diagonal element of the inverse of the normal matrix.

    Columns of length 1: times of milliseconds beside rad/s² are all rounding otherwise.
    """
    rows = np.stack(columns)
    lengths = np.linalg.norm(rows, axis=1)
    lengths[lengths == 0.0] = 1.0  # a column of zeros stays one
    rows /= lengths[:, None]
    inverse = np.linalg.pinv(rows @ rows.T, hermitian=True)
    return float(inverse[number, number]) / float(lengths[number]) ** 2


def _edge(inside: Callable[[float], bool], start: float, limit: float) -> float:
    """Where `inside` ends between start and limit, by the ratio of times; 0 or inf if nowhere."""
    if inside(limit):
        return math.inf if limit > start else 0.0
    good, bad = math.log(start), math.log(limit)
    step = math.copysign(1e-12, bad - good)
    while abs(step) < abs(bad - good) and inside(math.exp(good + step)):
        step *= 4.0
    bad = good + step if abs(step) < abs(bad - good) else bad
    return math.exp(halved(lambda place: inside(math.exp(place)), good, bad, steps=40)[1])


def _shapes(curve: Curve, times: Values) -> Values:
    span = times[-1] - times[0]
    if curve is Curve.RAMP:
        shapes: Values = np.quantile(times, np.linspace(0.0, 1.0, _TRIALS)[1:])
        return shapes
    return np.geomspace(0.1 * span / len(times), _LONGEST * span, _TRIALS)


def _basis(curve: Curve, shape: float, times: Values) -> Values:
    since = times - times[0]
    if curve is Curve.LEVEL:
        return np.zeros(len(times))
    if curve is Curve.LINE:
        return since
    if curve is Curve.RAMP:
        return np.minimum(times - shape, 0.0)
    values: Values = np.exp(-since / shape)
    return values


def _linear(curve: Curve, shape: float, times: Values, speeds: Values) -> Fit:
    """The best level and slope for a given shape."""
    basis = _basis(curve, shape, times)
    away = basis - np.mean(basis)
    power = float(away @ away)
    slope = float(away @ (speeds - np.mean(speeds))) / power if power > 0.0 else 0.0
    level = float(np.mean(speeds) - slope * np.mean(basis))
    errors = speeds - level - slope * basis
    start = level + slope * float(basis[0])
    final = level + (slope * float(basis[-1]) if curve is Curve.LINE else 0.0)
    return Fit(curve, start, final, slope, shape, _misfit(errors, speeds))


def _polished(found: Fit, low: float, high: float, times: Values, speeds: Values) -> Fit:
    """Newton-like steps (Gauss) for the shape as well, as long as they help; within low, high."""
    for _ in range(50):
        basis = _basis(found.curve, found.shape, times)
        if found.curve is Curve.RAMP:
            bent = -found.slope * (times < found.shape)
        else:
            bent = found.slope * basis * (times - times[0]) / found.shape**2
        matrix = np.stack([np.ones(len(times)), basis, bent], axis=1)
        step = np.linalg.lstsq(matrix, residuals(found, times, speeds), rcond=None)[0][2]
        shape = min(max(found.shape + float(step), low), high)
        trial = _linear(found.curve, shape, times, speeds)
        if trial.misfit >= found.misfit:
            return found
        found = trial
    return found


def _misfit(errors: Values, speeds: Values) -> float:
    rounding = 1e-15 * max(float(np.max(np.abs(speeds))), 1e-130)
    return float(errors @ errors) + len(errors) * rounding**2

"""How a rotor speed changed: exponentially, at a constant rate, or not."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.report.estimate import Estimate
from bouncing_disk_ros.report.time_curves import (
    LEAST,
    Curve,
    Fit,
    effective,
    fit,
    interval,
    threshold,
)

FEWEST = 3
"""A straight line through fewer points gives no rate."""
MOST = 2000
"""More points are averaged in groups first."""
FEW = 30
"""Where errors last so long that there are fewer independent points than this, ..."""
CLEAR = 0.1
"""... a curve counts only if it leaves less than this part of the squares: a random walk can look
like any curve, but 97 of 100 leave more."""
FINISHED = 3.0
"""An exponential approach counts as finished after so many time constants (5 % are left)."""


class TransientKind(StrEnum):
    """How the speed changed."""

    NONE = "none"  # it did not, beyond its scatter
    EXPONENTIAL = "exponential"
    LINEAR = "linear"  # at a constant rate, until it locks
    UNRESOLVED = "unresolved"  # too few data


class Transient(NamedTuple):
    """A speed transient; times are seconds on the clock of the input."""

    kind: TransientKind
    finished: bool
    initial: float  # at the first time, by the fit, rad/s
    final: float  # rad/s; nan where it is not reached
    time_constant: Estimate  # T, s; nan unless exponential
    rate: Estimate  # of a linear transient, rad/s²; nan otherwise
    end: float  # when a linear transient locked, s; nan otherwise
    note: str

    @property
    def is_known(self) -> bool:
        """Whether it is more than a few steps: its rate or time constant is known to a quarter."""
        _, low, high, points, _ = found = (
            self.rate if self.kind is TransientKind.LINEAR else self.time_constant
        )
        return points >= FEWEST and high - low <= 0.5 * abs(found.value)


def transient_of(times: NDArray[np.float64], speeds: NDArray[np.float64]) -> Transient:
    """The transient in speeds (rad/s) at rising times (s), both shape (n,).

    Give samples (joint_states, rotor_speed) or impacts (`time`, `angular_velocity` just after), and
    only those since the platform's motion last changed. Points that are not finite are left out.
    Intervals (95 %) take account of errors that last over many points, such as chaotic wandering.
    ValueError if the shapes differ or times fall.
    """
    times, speeds = np.asarray(times, float), np.asarray(speeds, float)
    if times.shape != speeds.shape or times.ndim != 1:
        raise ValueError(f"times and speeds must be alike: {times.shape}, {speeds.shape}")
    good = np.isfinite(times) & np.isfinite(speeds)
    times, speeds = times[good], speeds[good]
    if np.any(np.diff(times) < 0.0):
        raise ValueError("times must rise")
    if len(times) < LEAST or times[-1] == times[0]:
        note = f"not identifiable: {len(times)} points, at least {LEAST} are needed"
        return _nothing(TransientKind.UNRESOLVED, math.nan, math.nan, note)
    times, speeds = _downsample(times), _downsample(speeds)
    fits = {curve: fit(curve, times, speeds) for curve in Curve}
    return _chosen(fits, times, speeds)


def _chosen(
    fits: dict[Curve, Fit], times: NDArray[np.float64], speeds: NDArray[np.float64]
) -> Transient:
    best = min(fits.values(), key=lambda f: f.misfit)
    count = effective(best, times, speeds)
    level, line = fits[Curve.LEVEL], fits[Curve.LINE]
    if count < min(FEW, len(times) / 2.0):
        if best.misfit > CLEAR * level.misfit:
            note = "not identifiable: the speed wanders too slowly for the length of the data"
            return _nothing(TransientKind.UNRESOLVED, level.start, math.nan, note)
        count = max(count, float(LEAST))
    if _as_good(level, best, count, 3):
        return _nothing(TransientKind.NONE, level.start, level.start, "")
    if _as_good(line, best, count, 1):
        rate = interval(line, times, speeds, count)
        note = "not finished: a straight line so far, linear or the start of an exponential"
        slow = Estimate(math.nan, 0.0, math.inf, len(times), "not identifiable: not finished")
        return Transient(
            TransientKind.LINEAR, False, line.start, math.nan, slow, rate, math.nan, note
        )
    ramp, exponential = fits[Curve.RAMP], fits[Curve.EXPONENTIAL]
    if not _as_good(exponential, best, count, 1):
        return _ramp(ramp, times, speeds, count)
    found = _exponential(exponential, times, speeds, count)
    if not _as_good(ramp, best, count, 1):
        return found
    also = "a straight line that ends fits as well"
    return found._replace(note="; ".join(note for note in (found.note, also) if note))


def _ramp(
    found: Fit, times: NDArray[np.float64], speeds: NDArray[np.float64], count: float
) -> Transient:
    before = times <= found.shape
    rate = interval(found, times, speeds, count)._replace(impacts=int(np.sum(before)))
    none = Estimate(math.nan, math.nan, math.nan, 0, "not exponential")
    return Transient(
        TransientKind.LINEAR, True, found.start, found.final, none, rate, found.shape, ""
    )


def _exponential(
    found: Fit, times: NDArray[np.float64], speeds: NDArray[np.float64], count: float
) -> Transient:
    constant = interval(found, times, speeds, count)
    finished = bool(times[-1] - times[0] >= FINISHED * found.shape and constant.high < math.inf)
    note = "" if finished else "not finished: less than three time constants were seen"
    none = Estimate(math.nan, math.nan, math.nan, 0, "not linear")
    kind = TransientKind.EXPONENTIAL
    return Transient(kind, finished, found.start, found.final, constant, none, math.nan, note)


def _downsample(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Means of equal numbers of points, at most MOST of them (a rest at the end is left out)."""
    group = -(-len(values) // MOST)
    whole = len(values) // group * group
    means: NDArray[np.float64] = np.mean(values[:whole].reshape(-1, group), axis=1)
    return means


def _nothing(kind: TransientKind, initial: float, final: float, note: str) -> Transient:
    none = Estimate(math.nan, math.nan, math.nan, 0, note or "no transient")
    finished = kind is TransientKind.NONE
    return Transient(kind, finished, initial, final, none, none, math.nan, note)


def _as_good(simple: Fit, best: Fit, count: float, more: int) -> bool:
    """Whether a simpler curve (fewer parameters by `more`) is not contradicted."""
    return count * math.log(simple.misfit / best.misfit) <= threshold(more, count)

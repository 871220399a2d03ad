"""How long a rotor takes from one speed to the next: to 1 − 1/e and to 95 % of the way."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.report.time_curves import LEAST

PARTS = (1.0 - math.exp(-1.0), 0.95)
"""Parts of the way that a rise time is given for."""
LAST_PART = 0.2
"""Share of the time at the end whose mean is the speed that was reached."""
ONE_STEP = 1.5
"""Neighbours on a grid further apart than so many of its steps have another one missing between."""
LEAST_STEPS = 2
"""So many equal steps show the step of a grid."""
_CLEAR = 5.0
"""A change counts only if it is so many times the scatter at its end."""
_STILL_CHANGES = 0.02
"""Between the halves of the last part of an exponential approach cut after three time constants,
of its whole change."""
_DRIFT = 1.5
"""Between the halves of a straight line, √3 standard deviations."""


class RiseTime(NamedTuple):
    """A change of speed; times are seconds since it began."""

    begin: float  # simulated s
    initial: float  # rad/s
    final: float  # rad/s, mean of the last part; the last speed where it has not ended
    to_1_e: float  # until 1 − 1/e of the way is first made; nan where it has not ended
    to_95: float  # until 95 % of it are; nan likewise

    @property
    def ended(self) -> bool:
        """Whether the speed no longer changed at the end of the data."""
        return not math.isnan(self.to_95)


def rise_time_of(
    times: NDArray[np.float64],
    speeds: NDArray[np.float64],
    begin: float,
    *,
    is_sampled: bool = False,
) -> RiseTime | None:
    """The rise time in speeds (rad/s) at rising times (s), of a change that begins at `begin`.

    Give speeds from before the change on: the last one up to `begin` is where it starts. None where
    there are too few, where none is from before, or where the speed does not change clearly. With
    `is_sampled` the times lie on a grid, and None where one is missing at the beginning or where a
    part of the way is made.
    """
    after = times > begin
    if np.sum(after) < LEAST or np.all(after):
        return None
    initial = float(speeds[~after][-1])
    late = speeds[times >= times[-1] - LAST_PART * (times[-1] - begin)]
    final = float(np.mean(late))
    if abs(final - initial) <= _CLEAR * float(np.std(late)) or final == initial:
        return None
    if _goes_on(late, final - initial):
        return RiseTime(begin, initial, float(speeds[-1]), math.nan, math.nan)
    step = ONE_STEP * smallest_step(times) if is_sampled else math.inf
    if float(times[after][0] - times[~after][-1]) > step:
        return None
    at = np.concatenate([[begin], times[after]])
    way = (np.concatenate([[initial], speeds[after]]) - initial) / (final - initial)
    places = [int(np.argmax(way >= part)) for part in PARTS]
    if any(at[place] - at[place - 1] > step for place in places):
        return None
    made = (_made(at, way, *one) for one in zip(places, PARTS, strict=True))
    return RiseTime(begin, initial, final, *(time - begin for time in made))


def smallest_step(times: NDArray[np.float64]) -> float:
    """The step of the grid on which times lie, some of them perhaps missing; inf: they are one."""
    steps = np.diff(times)
    return float(np.min(steps[steps > 0.0], initial=math.inf))


def _goes_on(late: NDArray[np.float64], change: float) -> bool:
    """Whether the speed in the last part still goes the way of the change.

    Its second half is ahead of the first by more than _STILL_CHANGES of the change and _DRIFT
    standard deviations: of a stationary speed, wandering too, that is seldom so.
    """
    half = len(late) // 2
    if half == 0:
        return False
    ahead = (float(np.mean(late[-half:])) - float(np.mean(late[:half]))) * math.copysign(1, change)
    return ahead > max(_STILL_CHANGES * abs(change), _DRIFT * float(np.std(late)))


def _made(times: NDArray[np.float64], way: NDArray[np.float64], place: int, part: float) -> float:
    """When a part of the way is made that is made at a place, on a straight line to there."""
    before, there = float(way[place - 1]), float(way[place])
    share = (part - before) / (there - before)
    return float(times[place - 1] + share * (times[place] - times[place - 1]))

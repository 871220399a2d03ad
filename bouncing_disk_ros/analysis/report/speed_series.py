"""The rotor speed of a segment of a run: a series for its transient, and the mean at its end."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.recorded.run_record import SETTLED_SECONDS, RunRecord
from bouncing_disk_ros.analysis.recorded.segments import Segment
from bouncing_disk_ros.analysis.recorded.transient import LEAST
from bouncing_disk_ros.core.model import ImpactKind

Rows = NDArray[np.void]
Column = NDArray[np.float64]

MOST_POINTS = 5000
"""A transient is fitted to at most so many points, evenly taken."""


class Speeds:
    """The rotor speeds received from a run, in the order of their times."""

    def __init__(self, record: RunRecord) -> None:
        states = [(state.time, state.angular_velocity) for state in record.states]
        self._states, self._means = _sorted(states), _sorted(record.speeds)

    def of(self, segment: Segment, own: Rows) -> tuple[Column, Column]:
        """Times (s) and rotor speeds (rad/s) of a segment: just after impacts, or samples.

        Samples where the impacts are few, or where the disk is in contact in between.
        """
        flights = bool(np.all(own["kind"] == ImpactKind.IMPACT))
        if (flights and len(own) >= LEAST) or not len(self._states):
            times, speeds = own["time"].copy(), own["angular_velocity"].copy()
        else:
            within = np.searchsorted(self._states[:, 0], (segment.begin, segment.end))
            times, speeds = self._states[int(within[0]) : int(within[1])].T
        step = max(1, -(-len(times) // MOST_POINTS))
        return times[::step], speeds[::step]

    def settled(self, segment: Segment, own: Rows) -> float:
        """Mean rotor speed in time over the last SETTLED_SECONDS of a segment, rad/s; nan: unknown.

        From disk/rotor_speed, which is the angle turned over time; else from joint_states; else
        from the impacts, where the disk only flies between them.
        """
        begin = max(segment.begin, segment.end - SETTLED_SECONDS)
        means = _between(self._means, begin, segment.end)
        if len(means) > 1:
            return float(np.mean(means[1:]))  # the first is over a time that may begin before
        states = _between(self._states, begin, segment.end)
        if len(states):
            return float(np.mean(states))
        last = own[own["time"] >= begin]
        if len(last) < 2 or np.any(last["kind"] != ImpactKind.IMPACT):
            return math.nan
        flown = np.diff(last["time"])
        if not flown.sum() > 0.0:
            return math.nan
        return float(last["angular_velocity"][:-1] @ flown / flown.sum())


def _sorted(pairs: Sequence[tuple[float, float]]) -> Column:
    """Pairs as an array of shape (n, 2), by their times."""
    found = np.array(pairs, float).reshape(-1, 2)
    ordered: Column = found[np.argsort(found[:, 0], kind="stable")]
    return ordered


def _between(pairs: Column, begin: float, end: float) -> Column:
    """The values of those later than `begin` and earlier than `end`."""
    first = int(np.searchsorted(pairs[:, 0], begin, side="right"))
    values: Column = pairs[first : int(np.searchsorted(pairs[:, 0], end)), 1]
    return values

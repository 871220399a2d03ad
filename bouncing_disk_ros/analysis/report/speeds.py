"""The rotor speed of a segment of a run: a series for its transient, and the mean at its end."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.recorded.run_record import SETTLED_SECONDS, RunRecord
from bouncing_disk_ros.analysis.recorded.segments import Segment
from bouncing_disk_ros.analysis.recorded.transient import LEAST
from bouncing_disk_ros.core.model import ImpactKind

Rows = NDArray[np.void]

MOST_POINTS = 5000
"""A transient is fitted to at most so many points, evenly taken."""


def speeds_of(
    record: RunRecord, segment: Segment, own: Rows
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (s) and rotor speeds (rad/s) of a segment: just after impacts, or samples.

    Samples where the impacts are few, or where the disk rides on the platform in between.
    """
    flights = bool(np.all(own["kind"] == ImpactKind.IMPACT))
    if (flights and len(own) >= LEAST) or not record.states:
        times, speeds = own["time"].copy(), own["angular_velocity"].copy()
    else:
        states = np.array([(state.time, state.angular_velocity) for state in record.states])
        states = states[(states[:, 0] >= segment.begin) & (states[:, 0] < segment.end)]
        states = states[np.argsort(states[:, 0], kind="stable")]
        times, speeds = states[:, 0], states[:, 1]
    step = max(1, -(-len(times) // MOST_POINTS))
    return times[::step], speeds[::step]


def settled_speed(record: RunRecord, segment: Segment, own: Rows) -> float:
    """Mean rotor speed in time over the last SETTLED_SECONDS of a segment, rad/s; nan: not known.

    From disk/rotor_speed, which is the angle turned over time; else from joint_states; else from
    the impacts, where the disk only flies between them.
    """
    begin = max(segment.begin, segment.end - SETTLED_SECONDS)
    means = [speed for time, speed in record.speeds if begin < time < segment.end]
    if len(means) > 1:
        return float(np.mean(means[1:]))  # the first is over a time that may begin before
    states = [s.angular_velocity for s in record.states if begin < s.time < segment.end]
    if states:
        return float(np.mean(states))
    last = own[own["time"] >= begin]
    if len(last) < 2 or np.any(last["kind"] != ImpactKind.IMPACT):
        return math.nan
    flown = np.diff(last["time"])
    return float(last["angular_velocity"][:-1] @ flown / flown.sum())

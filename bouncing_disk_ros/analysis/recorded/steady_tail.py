"""Mean rotor speed at the end of a segment, over the part in which it no longer changes."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.recorded.rise_time import LAST_PART
from bouncing_disk_ros.analysis.recorded.run_record import SETTLED_SECONDS
from bouncing_disk_ros.analysis.recorded.segments import Segment
from bouncing_disk_ros.analysis.recorded.transient import Transient, TransientKind
from bouncing_disk_ros.core.model import Disk, ImpactKind

LEAST_PERIODS = 3
"""In contact the rotor speed changes within each period: a mean needs some of them."""
_CONSTANTS = 7.0
"""An exponential approach is left out for so many time constants: a thousandth is left then."""
_AFTER = 0.1
"""Of what follows a straight line that ends, so much is left out: its end is a fit."""


def tail_begin(segment: Segment, transient: Transient | None) -> float:
    """When the steady tail of a segment begins, simulated s.

    That is at most SETTLED_SECONDS before its end.
    The transient is left out, but the last fifth of the segment and the last LEAST_PERIODS of the
    platform are always in it. Where no transient was looked for (None) or it has not finished, the
    tail is no longer than these.
    """
    least, motion = LAST_PART * (segment.end - segment.begin), segment.motion
    if motion is not None and (motion.axial_amplitude or motion.angular_amplitude):
        least = max(least, LEAST_PERIODS / motion.frequency)
    latest = max(segment.begin, segment.end - least)
    begin = segment.begin
    if transient is None:
        begin = latest
    elif transient.kind is TransientKind.LINEAR:
        begin = transient.end + _AFTER * (segment.end - transient.end)  # nan: not finished
    elif transient.kind is TransientKind.EXPONENTIAL:
        begin = segment.begin + _CONSTANTS * transient.time_constant.value
    return max(min(latest, begin), segment.end - SETTLED_SECONDS)


def mean_in_flight(rows: NDArray[np.void], disk: Disk) -> float:
    """Mean rotor speed in time between impacts (IMPACT_DTYPE), rad/s, its loads included.

    Nan with fewer than two impacts, in contact, where rows were lost, and where a brake stops the
    rotor between impacts.
    """
    alone = np.all(rows["kind"] == ImpactKind.IMPACT) and np.all(np.diff(rows["index"]) == 1.0)
    flown = np.diff(rows["time"])
    if not alone or not flown.sum() > 0.0:
        return math.nan
    speeds = rows["angular_velocity"][:-1].copy()
    if abs(disk.load_torque) + disk.brake_torque > 0.0:  # nan: not known
        ends = rows["angular_velocity"][1:] - rows["angular_impulse"][1:] / disk.inertia
        if disk.brake_torque and np.any(speeds * ends <= 0.0):
            return math.nan
        speeds = 0.5 * (speeds + ends)  # a constant torque: a straight line
    return float(speeds @ flown / flown.sum())

"""Mean rotor speed at the end of a segment, over the part in which it no longer changes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.maps.scales import acceleration
from bouncing_disk_ros.report.orbit import Orbit, OrbitKind
from bouncing_disk_ros.report.rise_time import LAST_PART, LEAST_STEPS, ONE_STEP, smallest_step
from bouncing_disk_ros.report.run_record import SETTLED_SECONDS
from bouncing_disk_ros.report.section import single_impacts
from bouncing_disk_ros.report.spans import Segment
from bouncing_disk_ros.report.transient import Transient, TransientKind

Column = NDArray[np.float64]
LEAST_PERIODS = 3
"""In contact the rotor speed changes within each period: a mean needs some of them."""
_CONSTANTS = 7.0
"""An exponential approach is left out for so many time constants: a thousandth is left then."""
_AFTER = 0.1
"""Of what follows a straight line that ends, so much is left out: its end is a fit."""
_FLOWN = 1e-9
"""A parabola through two impacts meets the second to rounding; a contact between is far off."""


class Mean(NamedTuple):
    """A mean rotor speed, angle over time, and from when to when; simulated s."""

    value: float  # rad/s; nan: not known
    begin: float = math.nan
    end: float = math.nan
    periods: int = 0  # of the platform, in whole repetitions of the orbit; 0: of no orbit


NO_MEAN = Mean(math.nan)


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


def flown(rows: NDArray[np.void], disk: Disk) -> NDArray[np.bool_]:
    """Whether the disk only flew from each row (IMPACT_DTYPE) to the next, shape (n − 1,).

    All False where the disk is not known. An impact from which the disk does not take off leads
    into contact, and its parabola misses the next one.
    """
    first, then = rows[:-1], rows[1:]
    passed = np.diff(rows["time"])
    fall = 0.5 * acceleration(disk) * passed * passed
    away = first["axial_position"] + first["axial_velocity"] * passed - fall
    size = np.abs(first["axial_velocity"]) * passed + fall + np.abs(then["axial_position"])
    tick = np.spacing(rows["time"][1:]) * np.abs(then["axial_impact_velocity"])
    hits = np.abs(away - then["axial_position"]) <= _FLOWN * size + 8.0 * tick
    single = single_impacts(rows)
    follow = np.diff(rows["index"]) == 1.0
    found: NDArray[np.bool_] = hits & follow & single[:-1] & single[1:]
    return found


def mean_in_flight(rows: NDArray[np.void], disk: Disk) -> float:
    """Mean rotor speed in time between impacts (IMPACT_DTYPE), rad/s, its loads included.

    Nan with fewer than two impacts, in contact, where rows were lost, where the disk is not known,
    and where a brake stops the rotor between impacts.
    """
    passed = np.diff(rows["time"])
    if not passed.sum() > 0.0 or not np.all(flown(rows, disk)):
        return math.nan
    speeds = rows["angular_velocity"][:-1].copy()
    if abs(disk.load_torque) + disk.brake_torque > 0.0:
        ends = rows["angular_velocity"][1:] - rows["angular_impulse"][1:] / disk.inertia
        if disk.brake_torque and np.any(speeds * ends <= 0.0):
            return math.nan
        speeds = 0.5 * (speeds + ends)  # a constant torque: a straight line
    return float(speeds @ passed / passed.sum())


def mean_of_orbit(own: NDArray[np.void], disk: Disk, orbit: Orbit, begin: float) -> Mean:
    """The mean over whole repetitions of a periodic orbit, those from `begin` on, at least one."""
    if orbit.kind is not OrbitKind.PERIODIC or len(own) <= orbit.impacts:
        return NO_MEAN
    within = int(np.sum(own["time"] >= begin)) - 1
    repeats = max(1, within // orbit.impacts)
    last = own[-1 - repeats * orbit.impacts :]
    value = mean_in_flight(last, disk)
    times = float(last["time"][0]), float(last["time"][-1])
    return Mean(value, *times, repeats * orbit.cycles)


def mean_of_angle(times: Column, angles: Column, begin: float, period: float) -> Mean:
    """The mean from angles (rad, unwrapped) at rising times (s): angle over time.

    From `begin` on; with the `period` of an orbit (s; 0: none) over about whole numbers of it.
    """
    first = int(np.searchsorted(times, begin))
    times, angles = times[first:], angles[first:]
    if len(times) < 2 or not times[-1] > times[0]:
        return NO_MEAN
    place = 0
    if period > 0.0 and (whole := math.floor((times[-1] - times[0]) / period + 1e-9)) > 0:
        place = int(np.argmin(np.abs(times[:-1] - (times[-1] - whole * period))))
    passed = float(times[-1] - times[place])
    value = float(angles[-1] - angles[place]) / passed
    return Mean(value, float(times[place]), float(times[-1]))


def angle_of_means(times: Column, means: Column) -> tuple[Column, Column]:
    """Times (s) and angles (rad) from means, each since the one before: the last without a gap.

    None where fewer than LEAST_STEPS steps are alike: others may be missing between two means.
    """
    steps = np.diff(times)
    is_gap = steps > ONE_STEP * smallest_step(times)
    if np.sum(~is_gap) < LEAST_STEPS:
        return times[:0], means[:0]
    gaps = np.flatnonzero(is_gap)
    first = int(gaps[-1]) + 1 if len(gaps) else 0
    turned = np.concatenate(([0.0], np.cumsum(means[first + 1 :] * steps[first:])))
    return times[first:], turned

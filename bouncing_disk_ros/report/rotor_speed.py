"""The rotor speeds received from a run."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import ImpactKind
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.report.orbit import Orbit
from bouncing_disk_ros.report.rise_time import RiseTime, rise_time_of
from bouncing_disk_ros.report.run_record import RunRecord
from bouncing_disk_ros.report.spans import Segment, Spans, known, lost_rows
from bouncing_disk_ros.report.steady_speed import (
    NO_MEAN,
    Column,
    Mean,
    angle_of_means,
    mean_in_flight,
    mean_of_angle,
    mean_of_orbit,
)
from bouncing_disk_ros.report.time_curves import LEAST

LEAST_GAPS = 2
"""So many samples in contact show that contact lasts ..."""
TOUCHING = 1e-12
"""... and in contact the disk is less than this above the platform, m: rounding."""
MOST_POINTS = 5000
"""A transient is fitted to at most so many points, evenly taken."""


class Speeds:
    """The rotor speeds received from a run, in the order of their times."""

    def __init__(self, record: RunRecord, spans: Spans) -> None:
        self._end = spans.end
        states = [(state.time, state.angular_velocity) for state in record.states]
        self._states, self._means = _sorted(states), _sorted(record.speeds)
        gaps = [(one.time, one.disk_position - one.platform_position) for one in record.states]
        self._gaps = _sorted(gaps)
        self._angles = _sorted([(state.time, state.angle) for state in record.states])
        self._margin = 1.5 * record.rounding

    def of(self, segment: Segment, own: NDArray[np.void]) -> tuple[Column, Column]:
        """Times (s) and rotor speeds (rad/s) of a segment: just after impacts, or samples.

        Samples where the impacts are few, or where the disk is in contact in between.
        """
        flights = bool(np.all(own["kind"] == ImpactKind.IMPACT))
        if (flights and len(own) >= LEAST) or not len(self._states):
            times, speeds = own["time"].copy(), own["angular_velocity"].copy()
        else:
            times, speeds = self._part(self._states, segment.begin, segment.end).T
        step = max(1, -(-len(times) // MOST_POINTS))
        return times[::step], speeds[::step]

    def rise(self, before: Segment, segment: Segment, rows: NDArray[np.void]) -> RiseTime | None:
        """The rise time from the speed of the segment `before`, over a cross-fade in between.

        Of samples; of impacts where there are none. None where some of them are missing.
        """
        if len(self._states):
            times, speeds = self._part(self._states, before.begin, segment.end).T
            return rise_time_of(times, speeds, before.end, is_sampled=True)
        whole = before._replace(end=segment.end).of(rows)
        if lost_rows(whole):
            return None
        return rise_time_of(whole["time"], whole["angular_velocity"], before.end)

    def stays_in_contact(self, segment: Segment, own: NDArray[np.void]) -> bool:
        """Whether the disk lies on a platform that cannot throw it, at the end of a segment.

        Γ is at most 1/π, and a chatter has ended in contact, the last impact did not throw the disk
        (ε = 0), or no sample since is off the platform.
        """
        motion, disk = segment.motion, segment.disk
        if motion is None or not known(disk) or axial_forcing_of(motion, disk) * math.pi > 1.0:
            return False
        if not len(own):
            since = segment.begin
        elif own["kind"][-1] == ImpactKind.CHATTER_TAIL or disk.restitution == 0.0:
            return True
        else:
            since = float(own["time"][-1])
        gaps = self._part(self._gaps, since, segment.end)[:, 1]
        return len(gaps) >= LEAST_GAPS and bool(np.all(np.abs(gaps) < TOUCHING))

    def settled(
        self, segment: Segment, own: NDArray[np.void], orbit: Orbit | None, begin: float
    ) -> Mean:
        """Mean rotor speed, angle over time, from about `begin` to the end of a segment.

        Over whole repetitions of an orbit, by its impacts where the disk only flies between them;
        else by the angles of joint_states, by disk/rotor_speed, or by the impacts.
        """
        periodic = orbit is not None and orbit.cycles > 0 and segment.motion is not None
        if orbit is not None:
            found = mean_of_orbit(own, segment.disk, orbit, begin)
            if not math.isnan(found.value):
                return found
        period = 0.0
        if periodic and orbit is not None and segment.motion is not None:
            period = orbit.cycles / segment.motion.frequency
        means = self._part(self._means, segment.begin, segment.end)
        for times, angles in (
            self._part(self._angles, segment.begin, segment.end).T,
            angle_of_means(*means.T),
        ):
            found = mean_of_angle(times, angles, begin, period)
            if not math.isnan(found.value):
                return found
        last = own[own["time"] >= begin]
        value = mean_in_flight(last, segment.disk)
        if math.isnan(value):
            return NO_MEAN
        return Mean(value, float(last["time"][0]), float(last["time"][-1]))

    def _part(self, pairs: Column, begin: float, end: float) -> Column:
        """Those surely later than `begin` and earlier than `end`, shape (n, 2)."""
        low, high = begin + self._margin, end - self._margin
        first, last = np.searchsorted(pairs[:, 0], (low, high if end < self._end else math.inf))
        part: Column = pairs[int(first) : int(last)]
        return part


def _sorted(pairs: Sequence[tuple[float, float]]) -> Column:
    """Pairs as an array of shape (n, 2), by their times."""
    found = np.array(pairs, float).reshape(-1, 2)
    ordered: Column = found[np.argsort(found[:, 0], kind="stable")]
    return ordered

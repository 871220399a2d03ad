"""The rotor speed of a recorded run: transients, rise times and means at the end."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, ImpactKind
from bouncing_disk_ros.maps.period_one import separation_phase
from bouncing_disk_ros.maps.scales import acceleration
from bouncing_disk_ros.report.estimate import Estimate
from bouncing_disk_ros.report.orbit import Orbit, OrbitKind
from bouncing_disk_ros.report.run_record import SETTLED_SECONDS, RunRecord
from bouncing_disk_ros.report.spans import Segment, Spans, known, lost_rows
from bouncing_disk_ros.report.time_curves import (
    Curve,
    Fit,
    effective,
    fit,
    interval,
    threshold,
)

FEWEST = 3
"""A straight line through fewer points gives no rate."""
LEAST = 8
"""Fewer times show nothing."""
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


# ------------------------------------------------------------------------------------------------
# How long a rotor takes from one speed to the next: to 1 − 1/e and to 95 % of the way.


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


# ------------------------------------------------------------------------------------------------
# Mean rotor speed at the end of a segment, over the part in which it no longer changes.


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
    single = (rows["kind"] == ImpactKind.IMPACT) & (rows["count"] == 1)
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


# ------------------------------------------------------------------------------------------------
# The rotor speeds received from a run.


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
        if motion is None or not known(disk) or separation_phase(motion, disk) is not None:
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

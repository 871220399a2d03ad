"""The rotor speeds received from a run: transients, rise times and means from them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, ImpactKind, join_rows
from bouncing_disk_ros.errors import InputError, counted
from bouncing_disk_ros.maps.scales import separation_phase
from bouncing_disk_ros.report.estimate import (
    Estimate,
    friction_of,
    platform_velocities,
    restitution_of,
)
from bouncing_disk_ros.report.impact_energy import LedgerCheck, check_ledger
from bouncing_disk_ros.report.on_platform import OffPlatform, off_platform
from bouncing_disk_ros.report.orbit import Orbit, OrbitKind, orbit_of
from bouncing_disk_ros.report.record_validation import checked_times
from bouncing_disk_ros.report.recorded_offset import Offsets, axial_offset
from bouncing_disk_ros.report.rise_time import RiseTime, rise_time_of
from bouncing_disk_ros.report.run_record import Health, RunRecord
from bouncing_disk_ros.report.spans import (
    Segment,
    Spans,
    known,
    lost_rows,
    spans_of,
    time_decimals,
)
from bouncing_disk_ros.report.steady_tail import (
    NO_MEAN,
    Mean,
    angle_of_means,
    mean_in_flight,
    mean_of_angle,
    mean_of_orbit,
    tail_begin,
)
from bouncing_disk_ros.report.transient import LEAST, Transient, transient_of

Rows = NDArray[np.void]
Column = NDArray[np.float64]

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

    def of(self, segment: Segment, own: Rows) -> tuple[Column, Column]:
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

    def rise(self, before: Segment, segment: Segment, rows: Rows) -> RiseTime | None:
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

    def stays_in_contact(self, segment: Segment, own: Rows) -> bool:
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

    def settled(self, segment: Segment, own: Rows, orbit: Orbit | None, begin: float) -> Mean:
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


# ------------------------------------------------------------------------------------------------
# Report on a recorded run: segments, orbits, transients, estimates, energy, real time.


ABSENT = "not in this bag"
MOST_SEGMENTS = 50
"""Of so many segments, those with the most impacts, orbit and transient are worked out."""
STILL = 1e-9
"""A rotor slower than this (rad/s) is at rest."""
MOST_ESTIMATED = 200_000
"""Restitution and friction are estimated from at most so many rows, the last ones."""
LONGEST, LAST = "longest", "last"


class TopicCount(NamedTuple):
    """One topic as recorded; `lost` in words, from the publisher's numbering."""

    topic: str
    messages: int
    lost: str


@dataclass(frozen=True)
class Source:
    """Where a record comes from, and what is known of the recording."""

    name: str
    namespace: str = "/"
    run: int = 1  # of `runs`
    runs: int = 1
    version: str = ""  # of the package that simulated
    topics: tuple[TopicCount, ...] = ()
    missing: tuple[str, ...] = ()  # topics of a simulator that are not in the bag
    empty: tuple[str, ...] = ()  # that are, without any message
    notes: Mapping[str, str] | None = None  # of the recorder
    remarks: tuple[str, ...] = ()  # damage
    limits: tuple[str, ...] = ()  # what was left out or downsampled on reading
    is_cut: bool = False  # only the times asked for were read
    is_cut_off: bool = False  # of these, the run goes on after the last one

    def absence(self, *topics: str) -> str:
        """Why nothing of these topics (if named) is there, in words that follow "is"."""
        asked = {*topics}
        if asked and asked <= {*self.missing}:
            return ABSENT
        if asked and asked <= {*self.missing, *self.empty}:
            return "in this bag without messages"
        return f"without messages {'within these times' if self.is_cut else 'of this run'}"


class SegmentReport(NamedTuple):
    """What one segment shows; `orbit` and `transient` are None where not worked out."""

    segment: Segment
    rows: int
    impacts: int  # those summed in a row included
    orbit: Orbit | None
    transient: Transient | None
    lost: int  # rows between the first and the last of them
    settled: Mean  # rotor speed in its steady tail
    off: OffPlatform  # impacts that are not where its motion says
    rise: RiseTime | None = None  # from the speed before it; None: no clear change, or not known

    @property
    def is_confirmed(self) -> bool:
        """Whether the platform's motion is known, and no impact says otherwise."""
        return self.segment.motion is not None and not self.off.impacts


class Pace(NamedTuple):
    """The real-time factor that was asked for, and the one reached."""

    asked: str  # in words
    reached: float  # between reports of a running simulator; nan: there are no two


class RealTime(NamedTuple):
    """How the simulator kept time, from its reports once a second."""

    reports: int
    paces: tuple[Pace, ...]  # for each factor that was asked for
    lateness: tuple[float, float, float]  # median of p50, largest p99, largest of all, s
    behind: float  # most, s
    skipped: int
    refused: int
    residual: float  # of the energy balance, largest


@dataclass(frozen=True)
class Report:
    """A run; figures show segment `shown` (its place in `segments`)."""

    record: RunRecord
    source: Source
    rows: Rows  # all, in the order of their index
    spans: Spans
    segments: tuple[SegmentReport, ...]
    shown: int
    restitution: Estimate
    friction: Estimate
    ledger: LedgerCheck | None
    real_time: RealTime | None

    @property
    def begin(self) -> float:
        """The first instant recorded, simulated s."""
        return self.spans.begin

    @property
    def end(self) -> float:
        """Just behind the last instant recorded, simulated s."""
        return self.spans.end

    @property
    def lost(self) -> int:
        """Rows between the first and the last one that the record lacks."""
        return lost_rows(self.rows)

    @property
    def chosen(self) -> SegmentReport | None:
        """The segment of the figures; None: nothing was recorded."""
        return self.segments[self.shown] if self.segments else None

    @property
    def decimals(self) -> int:
        """Decimal places of simulated times, s."""
        return time_decimals(self.end - self.begin)

    @property
    def shown_rows(self) -> Rows:
        """The impacts of the segment of the figures."""
        return self.chosen.segment.of(self.rows) if self.chosen else self.rows[:0]


def report_of(record: RunRecord, source: Source, choice: str = LONGEST) -> Report:
    """Work out a report. `choice`: longest (the most impacts), last, or a number from 1.

    Raises InputError for a choice that is none, and for impacts whose times fall.
    """
    rows = record.rows
    if len(rows) and np.any(np.diff(rows["index"]) < 0.0):
        rows = rows[np.argsort(rows["index"], kind="stable")]
    checked_times(rows)
    record.chunks[:] = [rows]  # not twice in memory
    spans = spans_of(record, rows)
    segments = spans.segments
    counts = [len(segment.of(rows)) for segment in segments]
    worked = set(np.argsort(counts, kind="stable")[-MOST_SEGMENTS:].tolist())
    shown, speeds = _chosen(counts, choice), Speeds(record, spans)
    reports = []
    for place, (before, segment) in enumerate(zip([None, *segments], segments, strict=False)):
        part = _segment(speeds, segment, rows, place in worked or place == shown, record.offsets)
        if part.transient is not None and before is not None and _leads(spans, before, segment):
            part = part._replace(rise=speeds.rise(before, segment, rows))
        reports.append(part)
    restitution, friction = _estimates(rows, reports, shown, record.offsets)
    return Report(
        record, source, rows, spans, tuple(reports), shown, restitution, friction,
        check_ledger(rows, record.health, spans),
        _real_time(record.health, record.clock_set, spans),
    )  # fmt: skip


def _leads(spans: Spans, before: Segment, segment: Segment) -> bool:
    """Whether one segment leads to the next as far as all inputs between say: without a reset."""
    is_known = spans.knows_inputs(before.begin, segment.end)
    return is_known and not spans.reset_within(before.begin, segment.begin)


def _chosen(counts: list[int], choice: str) -> int:
    if choice == LAST or not counts:
        return max(0, len(counts) - 1)
    if choice == LONGEST:
        return max(range(len(counts)), key=lambda place: (counts[place], place))
    if choice.isdecimal() and 1 <= int(choice) <= len(counts):
        return int(choice) - 1
    raise InputError("segment", choice, f"{LONGEST}, {LAST}, or a number from 1 to {len(counts)}")


def _segment(
    speeds: Speeds, segment: Segment, rows: Rows, worked: bool, offsets: Offsets
) -> SegmentReport:
    own = segment.of(rows)
    times, rotor = speeds.of(segment, own)
    disk = segment.disk if known(segment.disk) else None
    off = off_platform(segment.surely(rows), segment.motion, offsets)
    motion = None if off.impacts else segment.motion
    transient = transient_of(times, rotor) if worked else None
    orbit = orbit_of(own, motion=motion, disk=disk) if worked else None
    settled = speeds.settled(segment, own, orbit, tail_begin(segment, transient))
    if orbit and orbit.kind is OrbitKind.UNRESOLVED and speeds.stays_in_contact(segment, own):
        orbit = orbit._replace(kind=_contact_kind(segment, settled.value))
    impacts = int(np.sum(own["count"], dtype=np.int64))
    return SegmentReport(segment, len(own), impacts, orbit, transient, lost_rows(own), settled, off)


def _contact_kind(segment: Segment, speed: float) -> OrbitKind:
    """What to call contact that lasts, with this rotor speed (rad/s) at the end."""
    motion = segment.motion
    moves = motion is not None and (motion.axial_amplitude or motion.angular_amplitude)
    return OrbitKind.CONTACT if moves or not abs(speed) < STILL else OrbitKind.REST


def _estimates(
    rows: Rows, reports: Sequence[SegmentReport], shown: int, offsets: Offsets
) -> tuple[Estimate, Estimate]:
    """ε and μ from all impacts of the disk that the segment shown has."""
    nothing = Estimate(math.nan, 0.0, math.inf, 0, "not identifiable: no impacts")
    if not reports or not len(rows):
        return nothing, nothing
    disk = reports[shown].segment.disk
    parts = [part for part in reports if _alike(part.segment.disk, disk)]
    taken = [part.segment.surely(rows) for part in parts]
    own = join_rows(taken)[-MOST_ESTIMATED:]
    unknown = nothing._replace(note="not identifiable: the disk's parameters are not known")
    friction = friction_of(own, disk) if known(disk) else unknown
    if off := _all_off(parts):
        return nothing._replace(note=f"not identifiable: {off}"), friction
    velocities = np.concatenate(
        [
            np.full(len(some), math.nan)
            if part.segment.motion is None
            else platform_velocities(some, part.segment.motion)
            for part, some in zip(parts, taken, strict=True)
        ]
    )[-MOST_ESTIMATED:]
    offset = axial_offset(own["time"], offsets, 1)
    if np.any(np.isfinite(velocities + offset)):
        found = _restitution(own, velocities, offset)
    elif known(disk):
        found = restitution_of(own, mass=disk.mass)
    else:
        moved = bool(np.any(np.isfinite(velocities)))
        found = nothing._replace(note=f"not identifiable: {_OFFSET_UNKNOWN}") if moved else unknown
    return found, friction


def _all_off(parts: Sequence[SegmentReport]) -> OffPlatform | None:
    """The impacts of some segments that are off their platforms; None: there are none."""
    some = [part.off for part in parts if part.off.impacts]
    if not some:
        return None
    impacts, of = sum(one.impacts for one in some), sum(part.off.of for part in parts)
    return OffPlatform(impacts, of, float(np.fmax.reduce([one.farthest for one in some])))


_OFFSET_UNKNOWN = "the platform's offset trajectories (disk/inputs) are not in this bag"


def _restitution(own: Rows, velocities: Column, offset: Column) -> Estimate:
    """ε by velocities of the sinusoid and of its offset, with what was left out for the offset."""
    clear = np.isfinite(offset)
    found = restitution_of(own[clear], (velocities + offset)[clear])
    left = int(np.sum(np.isfinite(velocities[~clear])))
    if not left:
        return found
    why = "where the platform's offset is not known or its velocity jumps"
    notes = [*([found.note] if found.note else []), f"left out {counted(left, 'row')} {why}"]
    return found._replace(note="; ".join(notes))


def _alike(first: Disk, second: Disk) -> bool:
    return first == second or not (known(first) or known(second))


def _real_time(health: list[Health], clock_set: Sequence[float], spans: Spans) -> RealTime | None:
    if not health:
        return None
    return RealTime(
        len(health),
        tuple(_paces(health, np.sort(np.array(clock_set)), spans)),
        (
            float(np.median([report.lateness_p50 for report in health])),
            max(report.lateness_p99 for report in health),
            max(report.lateness_max for report in health),
        ),
        max(report.behind for report in health),
        max(report.skipped for report in health),
        max(report.refused for report in health),
        max(report.residual for report in health),
    )


def _paces(health: list[Health], clock_set: Column, spans: Spans) -> Iterator[Pace]:
    """Each real-time factor that was asked for, over the reports between which it stayed.

    That nothing paused the run between two of them only its inputs tell.
    """
    for asked in dict.fromkeys(report.asked for report in health):
        passed = took = 0.0
        for before, after in pairwise(health):
            running = before.running and after.running and before.asked == after.asked == asked
            first = np.searchsorted(clock_set, before.simulated)
            last = np.searchsorted(clock_set, after.simulated, side="right")
            is_known = spans.knows_inputs(before.simulated, after.simulated)
            if running and first == last and is_known:
                passed += after.simulated - before.simulated
                took += after.stamp - before.stamp
        yield Pace(asked, passed / took if took > 0.0 else math.nan)

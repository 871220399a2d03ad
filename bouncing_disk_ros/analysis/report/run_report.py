"""Report on a recorded run: segments, orbits, transients, estimates, energy, real time."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.period_one import separation_phase
from bouncing_disk_ros.analysis.recorded.estimate import (
    Estimate,
    friction_of,
    platform_velocities,
    restitution_of,
)
from bouncing_disk_ros.analysis.recorded.impact_energy import LedgerCheck, check_ledger
from bouncing_disk_ros.analysis.recorded.orbit import Orbit, OrbitKind, orbit_of
from bouncing_disk_ros.analysis.recorded.record_validation import checked_times
from bouncing_disk_ros.analysis.recorded.recorded_offset import Offsets, axial_offset
from bouncing_disk_ros.analysis.recorded.rise_time import RiseTime, rise_time_of
from bouncing_disk_ros.analysis.recorded.run_record import Health, RunRecord
from bouncing_disk_ros.analysis.recorded.segments import Segment, known, segments_of, time_decimals
from bouncing_disk_ros.analysis.recorded.steady_tail import mean_in_flight, tail_begin
from bouncing_disk_ros.analysis.recorded.transient import LEAST, Transient, transient_of
from bouncing_disk_ros.core.model import Disk, ImpactKind, join_rows
from bouncing_disk_ros.errors import InputError, counted

ABSENT = "not in this bag"
MOST_SEGMENTS = 50
"""Of so many segments, those with the most impacts, orbit and transient are worked out."""
STILL = 1e-9
"""A rotor slower than this (rad/s) is at rest."""
MOST_ESTIMATED = 200_000
"""Restitution and friction are estimated from at most so many rows, the last ones."""
LONGEST, LAST = "longest", "last"

Rows = NDArray[np.void]
Column = NDArray[np.float64]


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
    notes: Mapping[str, str] | None = None  # of the recorder
    remarks: tuple[str, ...] = ()  # damage
    limits: tuple[str, ...] = ()  # what was left out or downsampled on reading
    is_cut: bool = False  # only the times asked for were read
    is_cut_off: bool = False  # of these, the run goes on after the last one

    def absence(self, *topics: str) -> str:
        """Why nothing of these topics (if named) is there, in words that follow "is"."""
        if self.is_cut and not (topics and {*topics} <= {*self.missing}):
            return "no messages within these times"
        return ABSENT


class SegmentReport(NamedTuple):
    """What one segment shows; `orbit` and `transient` are None where not worked out."""

    segment: Segment
    rows: int
    impacts: int  # those summed in a row included
    orbit: Orbit | None
    transient: Transient | None
    settled: float  # mean rotor speed in its steady tail, rad/s
    tail: float  # length of that, s: at most SETTLED_SECONDS
    rise: RiseTime | None = None  # from the speed before it; None: no clear change, or not known


class RealTime(NamedTuple):
    """How the simulator kept time, from its reports once a second."""

    reports: int
    asked: str  # real-time factor, in words
    reached: float  # between reports of a running simulator
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
    begin: float  # simulated s
    end: float
    segments: tuple[SegmentReport, ...]
    shown: int
    restitution: Estimate
    friction: Estimate
    ledger: LedgerCheck | None
    real_time: RealTime | None

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
    begin, end = _span(record, rows)
    segments = segments_of(begin, end, record.motions, record.changes, record.disks)
    counts = [len(segment.of(rows)) for segment in segments]
    worked = set(np.argsort(counts, kind="stable")[-MOST_SEGMENTS:].tolist())
    shown, speeds = _chosen(counts, choice), Speeds(record)
    reports = tuple(
        _segment(speeds, segment, rows, place in worked or place == shown, before)
        for place, (before, segment) in enumerate(zip([None, *segments], segments, strict=False))
    )
    restitution, friction = _estimates(rows, segments, shown, record.offsets)
    return Report(
        record, source, rows, begin, end, reports, shown, restitution, friction,
        check_ledger(rows, record.health, record.changes, record.disks),
        _real_time(record.health),
    )  # fmt: skip


def _span(record: RunRecord, rows: Rows) -> tuple[float, float]:
    """The first and the last instant known, simulated s; the end lies just behind it."""
    times = [float(rows["time"][place]) for place in (0, -1) if len(rows)]
    for series in (record.states, record.speeds):
        times += [float(series[place][0]) for place in (0, -1) if series]
    times += [report.simulated for report in record.health]
    if not times:
        return 0.0, 0.0
    return min(times), math.nextafter(max(times), math.inf)


def _chosen(counts: list[int], choice: str) -> int:
    if choice == LAST or not counts:
        return max(0, len(counts) - 1)
    if choice == LONGEST:
        return max(range(len(counts)), key=lambda place: (counts[place], place))
    if choice.isdecimal() and 1 <= int(choice) <= len(counts):
        return int(choice) - 1
    raise InputError("segment", choice, f"{LONGEST}, {LAST}, or a number from 1 to {len(counts)}")


def _segment(
    speeds: Speeds, segment: Segment, rows: Rows, worked: bool, before: Segment | None
) -> SegmentReport:
    own = segment.of(rows)
    times, rotor = speeds.of(segment, own)
    disk = segment.disk if known(segment.disk) else None
    transient = transient_of(times, rotor) if worked else None
    tail = tail_begin(segment, transient)
    settled = speeds.settled(segment, own, tail)
    orbit = orbit_of(own, motion=segment.motion, disk=disk) if worked else None
    if orbit and orbit.kind is OrbitKind.UNRESOLVED and speeds.stays_in_contact(segment, own):
        orbit = orbit._replace(kind=_contact_kind(segment, settled))
    return SegmentReport(
        segment,
        len(own),
        int(np.sum(own["count"], dtype=np.int64)),
        orbit,
        transient,
        settled,
        segment.end - tail,
        rise_time_of(*speeds.since(before, segment, rows), before.end)
        if worked and before is not None and not segment.began_by.startswith("reset")
        else None,
    )


def _contact_kind(segment: Segment, speed: float) -> OrbitKind:
    """What to call contact that lasts, with this rotor speed (rad/s) at the end."""
    motion = segment.motion
    moves = motion is not None and (motion.axial_amplitude or motion.angular_amplitude)
    return OrbitKind.CONTACT if moves or not abs(speed) < STILL else OrbitKind.REST


def _estimates(
    rows: Rows, segments: list[Segment], shown: int, offsets: Offsets
) -> tuple[Estimate, Estimate]:
    """ε and μ from all impacts of the disk that the segment shown has."""
    nothing = Estimate(math.nan, 0.0, math.inf, 0, "not identifiable: no impacts")
    if not segments or not len(rows):
        return nothing, nothing
    disk = segments[shown].disk
    parts = [segment for segment in segments if _alike(segment.disk, disk)]
    taken = [(segment, segment.of(rows)) for segment in parts]
    own = join_rows(part for _, part in taken)[-MOST_ESTIMATED:]
    velocities = np.concatenate(
        [
            np.full(len(part), math.nan)
            if segment.motion is None
            else platform_velocities(part, segment.motion)
            for segment, part in taken
        ]
    )[-MOST_ESTIMATED:]
    unknown = nothing._replace(note="not identifiable: the disk's parameters are not in this bag")
    offset = axial_offset(own["time"], offsets, 1)
    if np.any(np.isfinite(velocities + offset)):
        found = _restitution(own, velocities, offset)
    elif known(disk):
        found = restitution_of(own, mass=disk.mass)
    else:
        moved = bool(np.any(np.isfinite(velocities)))
        found = nothing._replace(note=f"not identifiable: {_OFFSET_UNKNOWN}") if moved else unknown
    return found, friction_of(own, disk) if known(disk) else unknown


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


def _real_time(health: list[Health]) -> RealTime | None:
    if not health:
        return None
    pairs = [
        (after.simulated - before.simulated, after.stamp - before.stamp)
        for before, after in pairwise(health)
        if before.running and after.running and after.simulated >= before.simulated
    ]
    passed, took = (sum(column) for column in zip(*pairs, strict=True)) if pairs else (0.0, 0.0)
    return RealTime(
        len(health),
        health[-1].asked,
        passed / took if took > 0.0 else math.nan,
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


LEAST_GAPS = 2
"""So many samples in contact show that contact lasts ..."""
TOUCHING = 1e-12
"""... and in contact the disk is less than this above the platform, m: rounding."""
MOST_POINTS = 5000
"""A transient is fitted to at most so many points, evenly taken."""


class Speeds:
    """The rotor speeds received from a run, in the order of their times."""

    def __init__(self, record: RunRecord) -> None:
        states = [(state.time, state.angular_velocity) for state in record.states]
        self._states, self._means = _sorted(states), _sorted(record.speeds)
        gaps = [(one.time, one.disk_position - one.platform_position) for one in record.states]
        self._gaps = _sorted(gaps)

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

    def since(self, before: Segment, segment: Segment, rows: Rows) -> tuple[Column, Column]:
        """Times (s) and rotor speeds (rad/s) from the segment `before` to the end of this one.

        Samples, with what the platform's cross-fade in between did; impacts where there are none.
        """
        if len(self._states):
            first, last = np.searchsorted(self._states[:, 0], (before.begin, segment.end))
            times, speeds = self._states[int(first) : int(last)].T
            return times, speeds
        whole = before._replace(end=segment.end).of(rows)
        return whole["time"], whole["angular_velocity"]

    def stays_in_contact(self, segment: Segment, own: Rows) -> bool:
        """Whether the disk lies on a platform that cannot throw it, at the end of a segment.

        Γ is at most 1/π, and a chatter has ended in contact or no sample since is off the platform.
        """
        motion, disk = segment.motion, segment.disk
        if motion is None or not known(disk) or separation_phase(motion, disk) is not None:
            return False
        if not len(own):
            since = segment.begin
        elif own["kind"][-1] == ImpactKind.CHATTER_TAIL:
            return True
        else:
            since = float(own["time"][-1])
        gaps = _between(self._gaps, since, segment.end)
        return len(gaps) >= LEAST_GAPS and bool(np.all(np.abs(gaps) < TOUCHING))

    def settled(self, segment: Segment, own: Rows, begin: float) -> float:
        """Mean rotor speed in time from `begin` to the end of a segment, rad/s; nan: unknown.

        From disk/rotor_speed, which is the angle turned over time; else from the impacts, where the
        disk only flies between them and its loads are known; else from joint_states.
        """
        means = _between(self._means, begin, segment.end)
        if len(means) > 1:
            return float(np.mean(means[1:]))  # the first is over a time that may begin before
        last = own[own["time"] >= begin]
        flown = mean_in_flight(last, segment.disk) if known(segment.disk) else math.nan
        if not math.isnan(flown):
            return flown
        states = _between(self._states, begin, segment.end)
        if len(states):
            return float(np.mean(states))
        return mean_in_flight(last, segment.disk)


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

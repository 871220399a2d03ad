"""The report on a recorded run: segments, orbits, speeds, transients, estimates, energy, real time.

`report_of` makes a `Report` of a `RunRecord`. The rotor speeds (transients, rise times, means) are
those of `rotor_speed`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, join_rows
from bouncing_disk_ros.core.offset import Offset
from bouncing_disk_ros.errors import InputError, counted
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
from bouncing_disk_ros.report.rise_time import RiseTime
from bouncing_disk_ros.report.rotor_speed import Speeds
from bouncing_disk_ros.report.run_record import HealthReport, RecordSource, RunRecord
from bouncing_disk_ros.report.spans import (
    Segment,
    Spans,
    known,
    lost_rows,
    spans_of,
    time_decimals,
)
from bouncing_disk_ros.report.steady_speed import Mean, tail_begin
from bouncing_disk_ros.report.transient import Transient, transient_of
from bouncing_disk_ros.units import NS

Rows = NDArray[np.void]
Column = NDArray[np.float64]

MOST_SEGMENTS = 50
"""Of so many segments, those with the most impacts, orbit and transient are worked out."""
STILL = 1e-9
"""A rotor slower than this (rad/s) is at rest."""
MOST_ESTIMATED = 200_000
"""Restitution and friction are estimated from at most so many rows, the last ones."""
LONGEST, LAST = "longest", "last"


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
    trajectories: int  # offsets accepted in it, known or not
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
    source: RecordSource
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


def report_of(record: RunRecord, source: RecordSource, choice: str = LONGEST) -> Report:
    """Work out a report. `choice`: longest (the most impacts), last, or a number from 1.

    Raises InputError for a choice that is none, and for impacts whose times fall.
    """
    rows = checked_times(record.rows)
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
    moved = _trajectories(segment, offsets)
    motion = None if off.impacts or moved else segment.motion  # a loop holds unstable orbits too
    transient = transient_of(times, rotor) if worked else None
    orbit = orbit_of(own, motion=motion, disk=disk) if worked else None
    settled = speeds.settled(segment, own, orbit, tail_begin(segment, transient))
    if orbit and orbit.kind is OrbitKind.UNRESOLVED and speeds.stays_in_contact(segment, own):
        orbit = orbit._replace(kind=_contact_kind(segment, settled.value))
    impacts = int(np.sum(own["count"], dtype=np.int64))
    lost = lost_rows(own)
    return SegmentReport(segment, len(own), impacts, orbit, transient, lost, settled, off, moved)


def _trajectories(segment: Segment, offsets: Offsets) -> int:
    begin, end = segment.begin * NS, segment.end * NS
    return sum(begin <= at < end and one != Offset() for at, one in offsets)


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


def _real_time(
    health: list[HealthReport], clock_set: Sequence[float], spans: Spans
) -> RealTime | None:
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


def _paces(health: list[HealthReport], clock_set: Column, spans: Spans) -> Iterator[Pace]:
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

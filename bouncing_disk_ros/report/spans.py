"""The spans of a recorded run: what is known of it, from when to when.

A run is recorded between two instants. Its inputs are known over some parts of that time, and a
segment is a part with one platform motion and one set of disk parameters, without an impulse or a
reset within. All that a report says is about one of these spans.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.report.run_record import UNKNOWN_DISK, Change, RunRecord
from bouncing_disk_ros.units import NS

Rows = NDArray[np.void]
INSTANT = 1.5e-9
"""An input acts at a whole nanosecond: which of it and an impact so near (s) was first, no time
tells."""
FIRST = "start of the record"
RESET = "reset"
CHANGE = "change of motion"
UNKNOWN = "records of inputs missing"


class Segment(NamedTuple):
    """One stretch; times are simulated seconds."""

    begin: float
    end: float
    began_by: str  # in words
    motion: Motion | None  # None: not known
    disk: Disk
    by_input: tuple[bool, bool] = (False, False)  # whether an input acts where it begins, ends

    def of(self, rows: Rows) -> Rows:
        """Those of some rows with a rising `time` that lie within: a view."""
        first, last = np.searchsorted(rows["time"], (self.begin, self.end))
        return rows[int(first) : int(last)]

    def surely(self, rows: Rows) -> Rows:
        """Those of some rows that surely came after what began the segment and before its end."""
        own = self.of(rows)
        low, high = (
            _instant(time) if sharp else 0.0
            for time, sharp in zip((self.begin, self.end), self.by_input, strict=True)
        )
        first, last = np.searchsorted(own["time"], (self.begin + low, self.end - high))
        return own[int(first) : int(last)]


@dataclass(frozen=True)
class Spans:
    """The spans of a run, simulated s; the end lies just behind the last instant recorded."""

    begin: float
    end: float
    segments: tuple[Segment, ...]
    known: tuple[tuple[float, float], ...]  # all inputs are
    changes: tuple[Change, ...]  # those known, by their times

    def knows_inputs(self, begin: float, end: float) -> bool:
        """Whether all inputs from one instant to another are known."""
        return any(low <= begin and end <= high for low, high in self.known)

    def reset_within(self, begin: float, end: float) -> bool:
        """Whether a reset is known later than `begin`, up to `end`."""
        return begin < self._last(end, RESET) <= end

    def unchanged_since(self, time: float) -> float:
        """Since when disk and energy ledger have stayed as at `time`; inf: not known."""
        since = next((low for low, high in self.known if low <= time <= high), math.inf)
        return max(since, self._last(time, RESET), self._last(time, "parameters"))

    def origin(self, time: float) -> float | None:
        """The start (0) or reset from which the ledger counts at `time`; None: not known."""
        since = next((low for low, high in self.known if low <= time <= high), math.inf)
        origin = max(self._last(time, RESET), 0.0)
        return origin if origin >= since else None

    def _last(self, time: float, what: str) -> float:
        times = [one.time for one in self.changes if one.what == what and one.time <= time]
        return max(times, default=-math.inf)


def spans_of(record: RunRecord, rows: Rows) -> Spans:
    """The spans of a run, with its rows (IMPACT_DTYPE) in the order of their index."""
    begin, end = _recorded(record, rows)
    changes = sorted(record.changes, key=lambda change: change.time)
    return Spans(begin, end, tuple(segments_of(record, begin, end)), tuple(record.known),
                 tuple(changes))  # fmt: skip


def _recorded(record: RunRecord, rows: Rows) -> tuple[float, float]:
    """The first and the last instant known, simulated s; the end lies just behind it."""
    times = [float(rows["time"][place]) for place in (0, -1) if len(rows)]
    for series in (record.states, record.speeds):
        times += [float(series[place][0]) for place in (0, -1) if series]
    times += [report.simulated for report in record.health]
    if not times:
        return 0.0, 0.0
    return min(times), math.nextafter(max(times), math.inf)


class _Stretch(NamedTuple):
    begin: float
    end: float
    motion: Motion | None


def segments_of(record: RunRecord, begin: float, end: float) -> list[Segment]:
    """The segments of a run between two times (s), in order; those without a duration left out.

    Without disk/inputs motions are those of platform/motion, where each leads to the next; the
    disk is unknown, and what else drove it too.
    """
    segments = []
    cuts = _cuts(record)
    since = [time for time, _ in record.disks]
    latest = math.nextafter(end, -math.inf)
    edges = sorted({*cuts, *(edge for span in record.known for edge in span)})
    for start, stop, motion in _steady(record, begin, end):
        inner = edges[bisect_right(edges, start) : bisect_left(edges, stop)]
        for first, last in pairwise([start, *inner, stop]):
            if not last > first or (first > begin and first >= latest):
                continue
            is_known = not record.known or any(low <= first < high for low, high in record.known)
            place = bisect_right(since, first) - 1
            disk = record.disks[place][1] if is_known and place >= 0 else UNKNOWN_DISK
            words = cuts.get(first) or (CHANGE if first == start else UNKNOWN)
            segments.append(Segment(first, last, FIRST if first == begin else words,
                                    motion if is_known else None, disk,
                                    (first in cuts, last in cuts)))  # fmt: skip
    return segments


def _cuts(record: RunRecord) -> dict[float, str]:
    """What acted at which time, in words."""
    cuts = _resets(record)
    for change in sorted(record.changes, key=lambda change: change.time):
        words = f"{change.what} ({change.detail})" if change.detail else change.what
        cuts[change.time] = f"{cuts[change.time]}; {words}" if change.time in cuts else words
    return cuts


def _resets(record: RunRecord) -> dict[float, str]:
    """What may be a reset where platform/motion alone tells, in words.

    A steady motion ends a cross-fade or follows a reset; nothing but a reset ends a cross-fade
    before its time.
    """
    found: dict[float, str] = {}
    ordered = [] if record.known else sorted(record.motions, key=lambda motion: motion.begin_ns)
    for before, now in pairwise([None, *ordered]):
        assert now is not None
        if now.begin_ns < now.end_ns or now.begin_ns == 0:
            continue
        if before is not None and now.begin_ns < before.end_ns:
            found[now.begin_ns / NS] = RESET
        elif before is None or (before.end_ns, before.target) != (now.begin_ns, now.target):
            found[now.begin_ns / NS] = f"{CHANGE} or {RESET}"
    return found


def _steady(record: RunRecord, begin: float, end: float) -> Iterator[_Stretch]:
    """Each stretch without a cross-fade, within two times."""
    ordered = sorted(record.motions, key=lambda motion: motion.begin_ns)
    first = ordered[0].begin_ns / NS if ordered else math.inf
    found = [_Stretch(-math.inf, first, None)]
    for place, now in enumerate(ordered):
        later = ordered[place + 1] if place + 1 < len(ordered) else None
        # a message of platform/motion is missing where the next one begins with another motion
        leads_on = later is None or bool(record.known) or later.start == now.target
        until = math.inf if later is None else later.begin_ns / NS
        found.append(_Stretch(now.end_ns / NS, until, now.target if leads_on else None))
    for start, stop, motion in found:
        if min(stop, end) > max(start, begin):
            yield _Stretch(max(start, begin), min(stop, end), motion)


def _instant(time: float) -> float:
    return max(INSTANT, 4.0 * math.ulp(time)) if math.isfinite(time) else 0.0


def lost_rows(rows: Rows) -> int:
    """Rows between the first and the last one whose index is not there."""
    return int(rows["index"][-1] - rows["index"][0]) + 1 - len(rows) if len(rows) else 0


def time_decimals(length: float) -> int:
    """Decimal places of simulated times (s) of a run so long: more than three where it is short."""
    return 3 if length >= 1.0 or length <= 0.0 else min(9, 4 - math.floor(math.log10(length)))


def known(disk: Disk) -> bool:
    """Whether the parameters of a disk are known."""
    return not math.isnan(disk.mass)

"""A run in segments: stretches of time in which nothing drives the disk on otherwise.

A segment has one steady platform motion and one set of disk parameters, and holds no impulse or
reset.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.recorded.run_record import UNKNOWN_DISK, Change
from bouncing_disk_ros.core.model import Disk, Motion, MotionInForce
from bouncing_disk_ros.units import NS


class Segment(NamedTuple):
    """One stretch; times are simulated seconds."""

    begin: float
    end: float
    began_by: str  # in words
    motion: Motion | None  # None: not known
    disk: Disk

    def of(self, rows: NDArray[np.void]) -> NDArray[np.void]:
        """Those of some rows with a rising `time` that lie within: a view."""
        first, last = np.searchsorted(rows["time"], (self.begin, self.end))
        return rows[int(first) : int(last)]


def segments_of(
    begin: float,
    end: float,
    motions: Sequence[MotionInForce],
    changes: Sequence[Change],
    disks: Sequence[tuple[float, Disk]],
) -> list[Segment]:
    """The segments of a run between two times (s), in order; those without a duration left out.

    Without `motions` the platform's motion counts as unknown and unchanged. What did not arrive of
    before its first mention counts as it was then.
    """
    segments = []
    ordered = sorted(changes, key=lambda change: change.time)
    times = [change.time for change in ordered]
    since = [time for time, _ in disks]
    for start, stop, why, motion in _steady(begin, end, motions):
        within = ordered[bisect_right(times, start) : bisect_left(times, stop)]
        cuts = [(start, why), *((change.time, _words(change)) for change in within)]
        stops = [time for time, _ in cuts[1:]] + [stop]
        for (first, words), last in zip(cuts, stops, strict=True):
            if last > first:
                disk = disks[max(0, bisect_right(since, first) - 1)][1] if disks else UNKNOWN_DISK
                segments.append(Segment(first, last, words, motion, disk))
    return segments


def _steady(
    begin: float, end: float, motions: Sequence[MotionInForce]
) -> list[tuple[float, float, str, Motion | None]]:
    """Begin, end, why it began, motion of each stretch without a cross-fade."""
    if not motions:
        return [(begin, end, "start", None)]
    stretches: list[tuple[float, float, str, Motion | None]] = []
    ordered = sorted(motions, key=lambda motion: motion.begin_ns)
    for place, motion in enumerate(ordered):
        later = [after.begin_ns / NS for after in ordered[place + 1 : place + 2]]
        start, stop = max(motion.end_ns / NS, begin), min([*later, end])
        joins = stretches and stretches[-1][1] == start and stretches[-1][3] == motion.target
        if joins:
            stretches[-1] = (stretches[-1][0], stop, *stretches[-1][2:])
        elif stop > start:
            why = "change of motion" if start > begin else "start"
            stretches.append((start, stop, why, motion.target))
    return stretches


def _words(change: Change) -> str:
    return f"{change.what} ({change.detail})" if change.detail else change.what


def time_decimals(length: float) -> int:
    """Decimal places of simulated times (s) of a run so long: more than three where it is short."""
    return 3 if length >= 1.0 or length <= 0.0 else min(9, 4 - math.floor(math.log10(length)))


def known(disk: Disk) -> bool:
    """Whether the parameters of a disk are known."""
    return not math.isnan(disk.mass)

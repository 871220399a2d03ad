"""Heights of disk and platform over the last periods of a segment, as a panel."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.recorded.recorded_offset import Offsets, axial_offset
from bouncing_disk_ros.analysis.recorded.spans import Segment, known
from bouncing_disk_ros.analysis.recorded.steady_tail import flown
from bouncing_disk_ros.analysis.report.panel import Panel, Series, SeriesStyle, series
from bouncing_disk_ros.analysis.report.run_report import Report
from bouncing_disk_ros.analysis.scales import acceleration
from bouncing_disk_ros.core.model import Disk, Motion

PERIODS = 6
"""Periods of the platform that are shown."""
LEAST_SAMPLES = 12
"""Samples of a period, on average: with fewer a curve would mislead."""
_POINTS = 600
"""Of each curve that is drawn from the impacts."""

Column = NDArray[np.float64]


def height_panel(report: Report, time_label: str) -> Panel:
    """X of the disk and s of the platform in the last periods of the segment shown.

    From samples; where these are too few, from the impacts: sine and parabolas; else points.
    """
    title = f"Height, last {PERIODS} periods"
    drawn: list[Series] = []
    note = ""
    part = report.chosen
    if part is not None and part.segment.motion is not None and part.is_confirmed:
        drawn, note = _series(report, part.segment, part.segment.motion)
    topics = ("joint_states", "platform/motion")
    return Panel(title, time_label, "height x, s (mm)", drawn, note, topics=topics)


def _series(report: Report, segment: Segment, motion: Motion) -> tuple[list[Series], str]:
    end = segment.end
    begin = max(segment.begin, end - PERIODS / motion.frequency)
    states = [state for state in report.record.states if begin <= state.time <= end]
    enough = len(states) >= LEAST_SAMPLES * (end - begin) * motion.frequency
    rows = segment.of(report.rows)
    if not enough and known(segment.disk):
        before = rows[rows["time"] < begin][-1:]
        flights = rows[int(np.searchsorted(rows["time"], begin)) - len(before) :]
        if len(flights) and np.all(flown(flights, segment.disk)):
            times = np.linspace(max(begin, float(flights["time"][0])), end, _POINTS)
            return _from_impacts(flights, times, motion, segment.disk, report.record.offsets), (
                "Curves: sine and parabolas from the impacts. "
            )
    if not states:
        return [], ""
    look = SeriesStyle.LINE if enough else SeriesStyle.POINTS
    rows = rows[rows["time"] >= begin]
    corners = np.stack((rows["time"], rows["axial_position"]), axis=1)
    heights = [(state.time, state.disk_position, state.platform_position) for state in states]
    samples = np.array(heights).reshape(-1, 3)
    path = np.concatenate((samples[:, :2], corners))  # samples miss the corners
    path = path[np.argsort(path[:, 0], kind="stable")]
    drawn = [
        series("platform s", samples[:, 0], 1e3 * samples[:, 2], look, 3),
        series("disk x", path[:, 0], 1e3 * path[:, 1], look, 0),
    ]
    return [*drawn, *_impacts(rows)], "" if enough else "Points: too few samples for curves. "


def _impacts(rows: NDArray[np.void]) -> list[Series]:
    if not len(rows):
        return []
    return [series("impact", rows["time"], 1e3 * rows["axial_position"], colour=1)]


def _from_impacts(
    rows: NDArray[np.void], times: Column, motion: Motion, disk: Disk, offsets: Offsets
) -> list[Series]:
    """Heights at some times, each counted from the impact before it."""
    shown = rows[rows["time"] >= times[0]]
    times = np.sort(np.concatenate((times, rows["time"][rows["time"] > times[0]])))
    last = rows[np.searchsorted(rows["time"], times, side="right") - 1]
    since = times - last["time"]
    phase = last["forcing_phase"] + math.tau * motion.frequency * since
    platform = motion.axial_amplitude * np.sin(phase) + axial_offset(times, offsets)
    flight = last["axial_velocity"] * since - 0.5 * acceleration(disk) * since**2
    height = last["axial_position"] + flight
    below = np.flatnonzero((times > rows["time"][-1]) & ~(height > platform))
    if len(below):  # no impact is recorded there: what follows the flight is not known
        times, platform, height = (part[: below[0]] for part in (times, platform, height))
    return [
        series("platform s", times, 1e3 * platform, SeriesStyle.LINE, 3),
        series("disk x", times, 1e3 * height, SeriesStyle.LINE, 0),
        *_impacts(shown),
    ]

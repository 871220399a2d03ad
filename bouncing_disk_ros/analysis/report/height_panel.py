"""Heights of disk and platform over the last periods of a segment, as a panel."""

from __future__ import annotations

import numpy as np

from bouncing_disk_ros.analysis.report.panel import Panel, Series, SeriesStyle, series
from bouncing_disk_ros.analysis.report.run_report import Report
from bouncing_disk_ros.core.model import Motion

PERIODS = 6
"""Periods of the platform that are shown."""
LEAST_SAMPLES = 12
"""Samples of a period, on average: with fewer a curve would mislead, and points are drawn."""


def height_panel(report: Report, time_label: str) -> Panel:
    """X of the disk and s of the platform in the last periods of the segment shown."""
    title = f"Height, last {PERIODS} periods"
    drawn: list[Series] = []
    part = report.chosen
    if part is not None and part.segment.motion is not None and report.record.states:
        drawn = _series(report, part.segment.begin, part.segment.end, part.segment.motion)
    return Panel(title, time_label, "height x, s (mm)", drawn)


def _series(report: Report, begin: float, end: float, motion: Motion) -> list[Series]:
    begin = max(begin, end - PERIODS / motion.frequency)
    states = [state for state in report.record.states if begin <= state.time <= end]
    enough = len(states) >= LEAST_SAMPLES * (end - begin) * motion.frequency
    look = SeriesStyle.LINE if enough else SeriesStyle.POINTS
    rows = report.rows
    rows = rows[(rows["time"] >= begin) & (rows["time"] <= end)]
    corners = np.stack((rows["time"], rows["axial_position"]), axis=1)
    heights = [(state.time, state.disk_position, state.platform_position) for state in states]
    samples = np.array(heights).reshape(-1, 3)
    path = np.concatenate((samples[:, :2], corners))  # samples miss the corners
    path = path[np.argsort(path[:, 0], kind="stable")]
    drawn = [
        series("platform s", samples[:, 0], 1e3 * samples[:, 2], look, 3),
        series("disk x", path[:, 0], 1e3 * path[:, 1], look, 0),
    ]
    if len(corners):
        drawn.append(series("impact", corners[:, 0], 1e3 * corners[:, 1], colour=1))
    return drawn

"""Two runs over each other: heights where they part, rotor speed, next-collision section."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bouncing_disk_ros.report.orbit import orbit_of
from bouncing_disk_ros.report.panel import Panel, Series, SeriesStyle, series
from bouncing_disk_ros.report.panel_page import panels_figure
from bouncing_disk_ros.report.report_panels import (
    HEIGHT,
    PHASE,
    SPEED,
    TIME,
    VELOCITY,
    with_corners,
)
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from bouncing_disk_ros.run.what_if import Trace, TwoRuns

    Traces = Mapping[str, Trace]
    """The recorded run and the changed one, by their labels."""

LINES = SeriesStyle.LINE, SeriesStyle.DASHED
"""How curves of the two are drawn; their colours are 0 and 1."""


def two_runs_picture(runs: TwoRuns, label: str, title: str) -> Figure:
    """Three panels of the recorded run and of the one that `label` names."""
    parted = [] if runs.divergence_time_ns is None else [runs.divergence_time_ns / NS]
    traces = {"recorded": runs.first, label: runs.second}
    ends = ", ".join(f"{name} {orbit_of(one.steady_rows).name}" for name, one in traces.items())
    figure, _ = panels_figure(
        f"{title}\norbit at the end: {ends}", (11.0, 8.5),
        {("heights", "heights"): 0.9, ("speeds", "section"): 1.1},
        {"heights": _heights(traces, parted), "speeds": _speeds(traces, parted),
         "section": _section(traces)},
    )  # fmt: skip
    return figure


def _heights(traces: Traces, parted: list[float]) -> Panel:
    """Heights of disk and platform, near the parting or over the whole run."""
    detail = all(len(trace.detail) > 1 for trace in traces.values())
    disks: list[Series] = []
    platforms: list[Series] = []
    for number, (label, trace) in enumerate(traces.items()):
        samples = _near(trace) if detail else trace.samples
        time, height, platform = (
            samples[name] for name in ("time_ns", "axial_position", "platform_position")
        )
        inside = trace.rows[trace.rows["time"] >= time[0] / NS] if len(time) else trace.rows[:0]
        inside = inside[inside["time"] <= time[-1] / NS] if len(time) else inside
        x, y = with_corners(time / NS, height, inside)
        disks.append(series(f"disk x, {label}", x, 1e3 * y, LINES[number], number))
        name = f"platform s, {label}" if platforms else "platform s"
        platforms.append(series(name, time / NS, 1e3 * platform, LINES[number], 3))
    if np.array_equal(platforms[0].y, platforms[1].y):
        platforms.pop()
    span = (float(platforms[0].x[0]), float(platforms[0].x[-1])) if detail else None
    where = "where the two part (grey line)" if parted else "the two never part"
    return Panel(f"Heights, {where}", TIME, HEIGHT, [*platforms, *disks], lines=parted,
                 x_range=span)  # fmt: skip


def _near(trace: Trace) -> NDArray[np.void]:
    """The fine samples, and the even ones from a little before: there the two are one."""
    begin, end = (int(trace.detail["time_ns"][place]) for place in (0, -1))
    even = trace.samples[trace.samples["time_ns"] < begin]
    return np.concatenate([even[even["time_ns"] >= begin - (end - begin) // 8], trace.detail])


def _speeds(traces: Traces, parted: list[float]) -> Panel:
    """Rotor speed of both over the whole run."""
    drawn = [
        series(
            label, trace.samples["time_ns"] / NS, trace.samples["angular_velocity"], look, number
        )
        for number, ((label, trace), look) in enumerate(zip(traces.items(), LINES, strict=True))
    ]
    times = drawn[-1].x
    span = (float(times[0]), float(times[-1])) if len(times) > 1 else None
    return Panel("Rotor speed", TIME, SPEED, drawn, lines=parted, x_range=span)


def _section(traces: Traces) -> Panel:
    """Impacts of both: where they are the same, the second are rings around the first."""
    looks = SeriesStyle.POINTS, SeriesStyle.RINGS
    drawn, kept = [], ""
    for number, ((label, trace), look) in enumerate(zip(traces.items(), looks, strict=True)):
        rows = trace.rows
        if int(rows["count"].sum(dtype=np.int64)) < trace.impacts:
            kept = f", the newest {len(rows)} rows"
        drawn.append(series(label, rows["forcing_phase"], rows["y"], look, number))
    return Panel(f"Next-collision section{kept}", PHASE, VELOCITY, drawn, x_is_phase=True)

"""Two runs over each other: heights where they part, rotor speed, next-collision section."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bouncing_disk_ros.colours import DISK, GREY, PLATFORM, VERMILION
from bouncing_disk_ros.matplotlib_figures import mark_in_pi, new_figure, typeset
from bouncing_disk_ros.report.orbit import orbit_of
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from bouncing_disk_ros.run.what_if import Trace, TwoRuns

    Traces = Mapping[str, Trace]
    """The recorded run and the changed one, by their labels."""

SETTINGS = {"fontsize": 11}
STYLES = (
    {"color": DISK, "ls": "-", "marker": "o"},
    {"color": VERMILION, "ls": "--", "marker": "x"},
)


def two_runs_picture(runs: TwoRuns, label: str, title: str) -> Figure:
    """Three panels of the recorded run and of the one that `label` names."""
    diverged = None if runs.divergence_time_ns is None else runs.divergence_time_ns / NS
    traces = {"recorded": runs.first, label: runs.second}
    figure = new_figure(11.0, 8.5)
    heights, speeds, section = figure.subplot_mosaic(
        [["heights", "heights"], ["speeds", "section"]], height_ratios=[0.9, 1.1]
    ).values()
    _heights(heights, traces, diverged)
    _speeds(speeds, traces)
    _section(section, traces)
    for axes in (heights, speeds):
        if diverged is not None:
            axes.axvline(diverged, color=GREY, lw=1.0, ls=":", zorder=1)
    for axes in (heights, speeds, section):
        axes.grid(visible=True, color="#dddddd", linewidth=0.6)
        axes.set_axisbelow(True)
    ends = ", ".join(f"{name} {orbit_of(one.steady_rows).name}" for name, one in traces.items())
    figure.suptitle(f"{title}\norbit at the end: {ends}", fontsize=13)
    return figure


def _line(style: dict[str, str]) -> dict[str, Any]:
    return {"color": style["color"], "ls": style["ls"], "lw": 1.6}


def _heights(axes: Any, traces: Traces, diverged: float | None) -> None:
    """Heights of disk and platform, near the parting or over the whole run."""
    detail = all(len(trace.detail) > 1 for trace in traces.values())
    platforms = []
    for (label, trace), style in zip(traces.items(), STYLES, strict=True):
        samples = _near(trace) if detail else trace.samples
        time = samples["time_ns"] / NS
        platforms.append((time, samples["platform_position"], style))
        x, y = _with_corners(time, samples["axial_position"], trace.rows)
        axes.plot(x, 1e3 * y, label=f"disk x, {label}", **_line(style))
    same = len(platforms[0][1]) == len(platforms[1][1]) and np.array_equal(
        platforms[0][1], platforms[1][1]
    )
    for time, position, style in platforms[:1] if same else platforms:
        axes.plot(time, 1e3 * position, style["ls"], color=PLATFORM, lw=1.0, zorder=1,
                  label="platform s" if style is STYLES[0] else None)  # fmt: skip
    if detail:
        axes.set_xlim(platforms[0][0][0], platforms[0][0][-1])
    where = "where the two part (dotted)" if diverged is not None else "the two never part"
    axes.set_title(f"Heights, {where}", **SETTINGS)
    axes.set_xlabel("simulated time t (s)")
    axes.set_ylabel("height x, s (mm)")
    axes.legend(loc="upper right", fontsize=9, ncols=3)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.18 * (high - low))  # room for the legend


def _near(trace: Trace) -> NDArray[np.void]:
    """The fine samples, and the even ones from a little before: there the two are one."""
    begin, end = (int(trace.detail["time_ns"][place]) for place in (0, -1))
    even = trace.samples[trace.samples["time_ns"] < begin]
    return np.concatenate([even[even["time_ns"] >= begin - (end - begin) // 8], trace.detail])


def _with_corners(
    time: NDArray[np.float64], height: NDArray[np.float64], rows: NDArray[np.void]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Samples and impacts in the order of time: the samples alone miss the corners."""
    if not len(time):
        return time, height
    inside = rows[(rows["time"] >= time[0]) & (rows["time"] <= time[-1])]
    x = np.concatenate([time, inside["time"]])
    order = np.argsort(x, kind="stable")
    return x[order], np.concatenate([height, inside["axial_position"]])[order]


def _speeds(axes: Any, traces: Traces) -> None:
    """Rotor speed of both over the whole run."""
    for (label, trace), style in zip(traces.items(), STYLES, strict=True):
        time = trace.samples["time_ns"] / NS
        axes.plot(time, trace.samples["angular_velocity"], label=label, **_line(style))
    if len(time) > 1:
        axes.set_xlim(time[0], time[-1])
    axes.set_title("Rotor speed", **SETTINGS)
    axes.set_xlabel("simulated time t (s)")
    axes.set_ylabel("angular velocity α̇ (rad/s)")
    axes.legend(loc="best", fontsize=9)


def _section(axes: Any, traces: Traces) -> None:
    """Impacts of both; the marks shrink where there are many."""
    newest = False
    for (label, trace), style in zip(traces.items(), STYLES, strict=True):
        rows = trace.rows
        newest |= int(rows["count"].sum(dtype=np.int64)) < trace.impacts
        size = 5.0 if len(rows) < 500 else 2.0
        axes.plot(rows["x"], rows["y"], style["marker"], color=style["color"], ms=size,
                  mfc="none", label=label, rasterized=len(rows) > 2000)  # fmt: skip
    axes.set_xlim(0.0, 1.0)
    axes.margins(y=0.12)
    kept = f", the newest {len(rows)} rows" if newest else ""
    axes.set_title(f"Next-collision section{kept}", **SETTINGS)
    mark_in_pi(axes.xaxis, 0.5, 0.5)
    axes.set_xlabel("forcing phase at impact τ (rad)")
    axes.set_ylabel(typeset("impact velocity w_A / (πg/ω)"))
    axes.legend(loc="best", fontsize=9)

"""The picture of a run: heights, rotor speed, next-collision section and phases of impact."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bouncing_disk_ros.colours import BLUE, DISK, GREY, PLATFORM, THEORY, VERMILION
from bouncing_disk_ros.core.model import Motion
from bouncing_disk_ros.figure_style import mark_in_pi, new_figure, typeset
from bouncing_disk_ros.maps.scales import axial_forcing_of, period_one, velocity_scale
from bouncing_disk_ros.report.panel import with_gaps
from bouncing_disk_ros.report.run_record import RunRecord
from bouncing_disk_ros.report.run_summary import last_orbit
from bouncing_disk_ros.units import NS

SETTINGS = {"fontsize": 11}
TOSS_SECONDS = (0.7, 3.3)
"""What the first panel shows before and after the first toss."""
_GAP = 5.0
"""Of the usual time between two samples: beyond, some were not received."""
NUMBERED = 6
"""Impacts with their number in the section."""


def run_picture(record: RunRecord, title: str) -> Figure:
    """Figure of a run in four panels, with the theory of the period-1 orbit of its last motion.

    >>> run_picture(read_run("run_1"), "run 1")
    """
    figure = new_figure(11.0, 10.0)
    heights, speeds, section, phases = figure.subplot_mosaic(
        [["heights", "heights"], ["speeds", "speeds"], ["section", "phases"]],
        height_ratios=[1.0, 0.8, 1.25],
    ).values()
    motion = record.motion or (record.motions[-1].target if record.motions else None)
    _heights(heights, record)
    _speeds(speeds, record, motion)
    _section(section, record, motion)
    _phases(phases, record, motion)
    for axes in (heights, speeds, section, phases):
        axes.grid(visible=True, color="#dddddd", linewidth=0.6)
        axes.set_axisbelow(True)
    subtitle = _subtitle(record, motion)
    figure.suptitle(f"{title}\n{subtitle}" if subtitle else title, fontsize=13)
    return figure


def _subtitle(record: RunRecord, motion: Motion | None) -> str:
    if motion is None:
        return ""
    axial_forcing = axial_forcing_of(motion, record.disk)
    return typeset(
        f"at the end: axial forcing Γ = {axial_forcing:.3f}, "
        f"restitution ε = {record.disk.restitution:g}, "
        f"phase lag θ = {motion.phase_lag:.3f} rad, orbit found: {last_orbit(record).name}"
    )


def _longest_step(record: RunRecord) -> float:
    """Time between samples, s, from which on some were not received: no line is drawn there."""
    times = np.array([state.time for state in record.states])
    return _GAP * float(np.median(np.diff(times))) if len(times) > 1 else 0.0


def _span(record: RunRecord) -> tuple[float, float] | None:
    """Times of the first and the last sample or impact, s; None: there is no time between them."""
    times = [*(state.time for state in record.states), *record.rows["time"].tolist()]
    return (min(times), max(times)) if times and min(times) < max(times) else None


def _first_toss(record: RunRecord) -> float:
    """When the platform began to move, s; the start of the record when it moved from the start."""
    for motion in record.motions:
        if motion.target.axial_amplitude > 0.0 == motion.start.axial_amplitude:
            return motion.end_ns / NS
    return record.states[0].time + TOSS_SECONDS[0] if record.states else 0.0


def _heights(axes: Any, record: RunRecord) -> None:
    """Height of disk and platform around the first toss."""
    before, after = TOSS_SECONDS
    begin = _first_toss(record) - before
    end = begin + before + after
    rows = record.rows
    rows = rows[(rows["time"] >= begin) & (rows["time"] <= end)]
    states = [state for state in record.states if begin <= state.time <= end]
    platform = [(state.time, state.platform_position) for state in states]
    disk = [(state.time, state.disk_position) for state in states]
    disk += zip(rows["time"], rows["axial_position"], strict=True)  # the samples miss the corners
    for points, color, label in ((platform, PLATFORM, "platform s"), (disk, DISK, "disk x")):
        places, values = np.array(sorted(points)).reshape(-1, 2).T
        x, y = with_gaps(places, values, _longest_step(record))
        axes.plot(x, 1e3 * y, color=color, lw=1.6, label=label)
    axes.plot(rows["time"], 1e3 * rows["axial_position"], "o", color=VERMILION, ms=5,
              label="impact")  # fmt: skip
    for motion in record.motions:
        if motion.begin_ns < motion.end_ns and begin <= motion.end_ns / NS <= end:
            axes.axvspan(motion.begin_ns / NS, motion.end_ns / NS, color=GREY, alpha=0.18, lw=0)
    axes.plot([], [], color=GREY, alpha=0.4, lw=8, label="platform changes its motion")
    axes.set_xlim(begin, end)
    axes.set_title("The first toss and the change of motion", **SETTINGS)
    axes.set_xlabel("simulated time t (s)")
    axes.set_ylabel("height x, s (mm)")
    axes.legend(loc="upper left", ncols=4, fontsize=9)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.22 * (high - low))


def _speeds(axes: Any, record: RunRecord, motion: Motion | None) -> None:
    """Rotor speed over the whole run, with eq. 4."""
    states = np.array(record.states)
    if len(states):
        line = with_gaps(states[:, 0], states[:, 3], _longest_step(record))
        axes.plot(*line, color=DISK, lw=1.6, label="disk α̇")
        axes.set_xlim(_span(record))
    orbit = period_one(motion, record.disk) if motion else None
    if orbit is not None:
        label = f"ωΦ cos(τ_imp + θ) = {orbit.angular_velocity:.2f} rad/s (eq. 4)"
        axes.axhline(orbit.angular_velocity, color=THEORY, ls="--", lw=1.4, label=typeset(label))
        low, high = axes.get_ylim()
        level = orbit.angular_velocity
        axes.set_ylim(min(low, 0.88 * level), max(high, 1.12 * level))
    axes.set_title("Rotor speed", **SETTINGS)
    axes.set_xlabel("simulated time t (s)")
    axes.set_ylabel("angular velocity α̇ (rad/s)")
    if axes.lines:
        axes.legend(loc="lower right", fontsize=9)


def _section(axes: Any, record: RunRecord, motion: Motion | None) -> None:
    """Next-collision section; the first impacts have their number."""
    rows = record.rows
    x, y = rows["x"].astype(float), rows["y"].astype(float)
    for i in range(len(rows) - 1):  # by the shortest angular distance
        step = (x[i + 1] - x[i] + 0.5) % 1.0 - 0.5
        for begin, end in ((x[i], x[i] + step), (x[i + 1] - step, x[i + 1])):
            axes.plot((begin, end), y[i : i + 2], color=GREY, lw=0.7, zorder=2)
    axes.plot(x, y, "o", color=BLUE, ms=5, zorder=3, label="impact")
    for i in range(min(NUMBERED, len(rows))):
        axes.annotate(str(i + 1), (x[i], y[i]), (5, 4), textcoords="offset points", fontsize=9)
    orbit = period_one(motion, record.disk) if motion else None
    if motion is not None and orbit is not None:
        scale = velocity_scale(motion, record.disk)
        point = (orbit.forcing_phase / math.tau, orbit.axial_impact_velocity / scale)
        cross = {"color": THEORY, "ms": 22, "mew": 2, "zorder": 4}
        axes.plot(*point, "+", label="period-1 orbit, theory", **cross)
        axes.legend(loc="upper right", fontsize=9, markerscale=0.5)
    axes.set_xlim(0.0, 1.0)
    axes.margins(y=0.12)
    axes.set_title("Next-collision section, one point for each impact", **SETTINGS)
    mark_in_pi(axes.xaxis, 0.5, 0.5)
    axes.set_xlabel("forcing phase at impact τ (rad)")
    axes.set_ylabel(typeset("impact velocity w_A / (πg/ω)"))


def _phases(axes: Any, record: RunRecord, motion: Motion | None) -> None:
    """Phase of each impact over time."""
    rows = record.rows
    axes.plot(rows["time"], rows["forcing_phase"], "o", color=BLUE, ms=4, label="impact")
    orbit = period_one(motion, record.disk) if motion else None
    if orbit is not None:
        label = f"τ_imp = {orbit.forcing_phase:.4f} rad (period 1)"
        axes.axhline(orbit.forcing_phase, color=THEORY, ls="--", lw=1.4, label=typeset(label))
        axes.legend(loc="upper right", fontsize=9)
    axes.set_ylim(0.0, math.tau)
    mark_in_pi(axes.yaxis, 0.5, math.pi)
    axes.set_xlim(_span(record))
    axes.set_title("Forcing phase of each impact", **SETTINGS)
    axes.set_xlabel("simulated time t (s)")
    axes.set_ylabel("forcing phase τ (rad)")

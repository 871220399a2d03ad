"""The picture of a run: heights, rotor speed, next-collision section and phases of impact."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.figure import Figure

from bouncing_disk_ros.angles import wrap_to_pi
from bouncing_disk_ros.core.model import Motion
from bouncing_disk_ros.maps.period_one import PeriodOne, period_one
from bouncing_disk_ros.maps.scales import axial_forcing_of, velocity_scale
from bouncing_disk_ros.matplotlib_figures import typeset
from bouncing_disk_ros.report.panel import Panel, SeriesStyle, series, with_gaps
from bouncing_disk_ros.report.panel_page import panels_figure
from bouncing_disk_ros.report.report_panels import (
    HEIGHT,
    PHASE,
    SPEED,
    TIME,
    VELOCITY,
    sampled_heights,
)
from bouncing_disk_ros.report.run_record import RunRecord
from bouncing_disk_ros.report.run_summary import last_orbit
from bouncing_disk_ros.units import NS

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
    motion = record.motion or (record.motions[-1].target if record.motions else None)
    orbit = period_one(motion, record.disk) if motion else None
    panels = {
        "heights": _heights(record),
        "speeds": _speeds(record, orbit),
        "section": _section(record, motion, orbit),
        "phases": _phases(record, orbit),
    }
    subtitle = _subtitle(record, motion)
    figure, axes = panels_figure(
        f"{title}\n{subtitle}" if subtitle else title, (11.0, 10.5),
        {("heights",) * 2: 1.0, ("speeds",) * 2: 0.8, ("section", "phases"): 1.25},
        panels,
    )  # fmt: skip
    axes["section"].margins(y=0.12)
    for number, row in enumerate(record.rows[:NUMBERED], 1):
        place = (row["forcing_phase"], row["y"])
        axes["section"].annotate(str(number), place, (5, 4), textcoords="offset points", fontsize=9)
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


def _heights(record: RunRecord) -> Panel:
    """Height of disk and platform around the first toss."""
    before, after = TOSS_SECONDS
    begin, end = _first_toss(record) - before, _first_toss(record) + after
    rows = record.rows
    rows = rows[(rows["time"] >= begin) & (rows["time"] <= end)]
    states = [state for state in record.states if begin <= state.time <= end]
    changes = [
        (motion.begin_ns / NS, motion.end_ns / NS)
        for motion in record.motions
        if motion.begin_ns < motion.end_ns and begin <= motion.end_ns / NS <= end
    ]
    return Panel(
        "The first toss and the change of motion (grey)", TIME, HEIGHT,
        sampled_heights(states, rows, SeriesStyle.LINE, _longest_step(record)),
        spans=changes, x_range=(begin, end),
    )  # fmt: skip


def _speeds(record: RunRecord, orbit: PeriodOne | None) -> Panel:
    """Rotor speed over the whole run, with eq. 4."""
    span, drawn = _span(record), []
    if record.states:
        states = np.array(record.states)
        line = with_gaps(states[:, 0], states[:, 3], _longest_step(record))
        drawn.append(series("disk α̇", *line, SeriesStyle.LINE))
    if orbit is not None and span is not None:
        name = f"ωΦ cos(τ_imp + θ) = {orbit.angular_velocity:.2f} rad/s (eq. 4)"
        drawn.append(series(name, span, [orbit.angular_velocity] * 2, SeriesStyle.DASHED, 1))
    return Panel("Rotor speed", TIME, SPEED, drawn, x_range=span)


def _section(record: RunRecord, motion: Motion | None, orbit: PeriodOne | None) -> Panel:
    """Next-collision section; lines join successive impacts by the shortest angular distance."""
    x, y = record.rows["forcing_phase"], record.rows["y"].astype(float)
    step = wrap_to_pi(np.diff(x))
    gap = np.full(len(step), np.nan)
    again = np.where(np.abs(np.diff(x)) > math.pi, 0.0, np.nan)  # over the edge: from both sides
    ends = np.stack((x[:-1], x[:-1] + step, gap, x[1:] - step + again, x[1:], gap), axis=1)
    levels = np.stack((y[:-1], y[1:], gap) * 2, axis=1)
    drawn = [
        series("to the next one", ends.ravel(), levels.ravel(), SeriesStyle.LINE, 4),
        series("impact", x, y),
    ]
    if motion is not None and orbit is not None:
        level = orbit.axial_impact_velocity / velocity_scale(motion, record.disk)
        place = ([orbit.forcing_phase], [level])
        drawn.append(series("period-1 orbit, theory", *place, SeriesStyle.CROSSES, 1))
    return Panel("Next-collision section", PHASE, VELOCITY, drawn, x_is_phase=True)


def _phases(record: RunRecord, orbit: PeriodOne | None) -> Panel:
    """Phase of each impact over time."""
    span = _span(record)
    drawn = [series("impact", record.rows["time"], record.rows["forcing_phase"])]
    if orbit is not None and span is not None:
        name = f"τ_imp = {orbit.forcing_phase:.4f} rad (period 1)"
        drawn.append(series(name, span, [orbit.forcing_phase] * 2, SeriesStyle.DASHED, 1))
    return Panel("Forcing phase of the impacts", TIME, PHASE, drawn, x_range=span, y_is_phase=True)

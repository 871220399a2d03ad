"""The figures of a report as panels: series with labels, downsampled where too long."""

from __future__ import annotations

import math

import numpy as np

from bouncing_disk_ros.analysis.motor_curves import mean_speed
from bouncing_disk_ros.analysis.period_one import PeriodOne, period_one
from bouncing_disk_ros.analysis.recorded.run_record import UNKNOWN_DISK
from bouncing_disk_ros.analysis.recorded.section import return_map_of, section_of, single_impacts
from bouncing_disk_ros.analysis.recorded.spans import known
from bouncing_disk_ros.analysis.recorded.transient import Transient, TransientKind
from bouncing_disk_ros.analysis.report.energy_panel import energy_panel, time_range
from bouncing_disk_ros.analysis.report.height_panel import height_panel
from bouncing_disk_ros.analysis.report.panel import (
    Column,
    Panel,
    Series,
    SeriesStyle,
    envelope,
    series,
    spread,
    with_gaps,
)
from bouncing_disk_ros.analysis.report.rotor_speeds import Speeds
from bouncing_disk_ros.analysis.report.run_report import Report
from bouncing_disk_ros.analysis.scales import velocity_scale
from bouncing_disk_ros.core.model import LARGEST_FLOAT32, Motion

TIME = "simulated time t (s)"
PHASE = "forcing phase at impact τ_imp (rad)"
VELOCITY = "impact velocity w_A/(πg/ω)"
ZOOMED = 0.5 * math.pi
"""A return map whose phases lie within this (rad) shows their part of the plane alone ..."""
LEAST_MARGIN = 0.05
"""... with so much (rad) around them at least: an orbit of one phase is a point."""
_ANY_MOTION = Motion(0.0, 0.0, 1.0, 0.0)


def panels(report: Report, most: int) -> list[Panel]:
    """All panels; a series has at most `most` points, and the notes say what was left out."""
    spans, marks = _times(report)
    return [
        _speed(report, most, spans, marks),
        _phases(report, most, spans, marks),
        _section(report, most),
        _return_map(report, most),
        energy_panel(report, most),
        _lateness(report, most),
        height_panel(report, TIME),
    ]


def downsample(shown: int, count: int, how: str) -> str:
    """What a note says of thinning; '' without."""
    return f"{shown} of {count} {how}. " if shown < count else ""


def _times(report: Report) -> tuple[list[tuple[float, float]], list[float]]:
    """Where no segment is (cross-fades), and where one segment follows another at once."""
    spans, marks, at = [], [], report.begin
    for part in report.segments:
        if part.segment.begin > at:
            spans.append((at, part.segment.begin))
        elif part.segment.begin > report.begin:
            marks.append(part.segment.begin)
        at = part.segment.end
    return spans, marks


def _theory(report: Report) -> PeriodOne | None:
    part = report.chosen
    if part is None or part.segment.motion is None or not known(part.segment.disk):
        return None
    if not part.is_confirmed:
        return None
    return period_one(part.segment.motion, part.segment.disk)


# --- over time ------------------------------------------------------------------------------------
def _speed(
    report: Report, most: int, spans: list[tuple[float, float]], marks: list[float]
) -> Panel:
    drawn, note = [], ""
    record, part = report.record, report.chosen
    if record.states or record.speeds:
        if record.states:
            name = "samples"
            data = np.array([(state.time, state.angular_velocity) for state in record.states])
        else:
            name, data = "means", np.array(record.speeds)
        keep = envelope(data[:, 1], most)
        note = downsample(len(keep), len(data), "samples: least and greatest of each group")
        usual = float(np.median(np.diff(data[keep, 0]))) if len(keep) > 1 else 0.0
        line = with_gaps(data[keep, 0], data[keep, 1], 20.0 * usual)
        drawn.append(series(f"disk α̇, {name}", *line, SeriesStyle.LINE))
    elif len(report.rows):
        keep = envelope(report.rows["angular_velocity"], most)
        note = downsample(len(keep), len(report.rows), "impacts: least and greatest of each group")
        rows = report.rows[keep]
        drawn.append(series("disk α̇ after impacts", rows["time"], rows["angular_velocity"]))
    if part and part.transient:
        first = Speeds(record, report.spans).of(part.segment, report.shown_rows)[0][:1]
        drawn += _fitted(part.transient, float(first[0]), part.segment.end) if len(first) else []
    theory = _theory(report)
    if part and part.segment.motion and theory and part.orbit and part.orbit.is_period_one:
        ends = np.array([part.segment.begin, part.segment.end])
        level = np.full(2, mean_speed(part.segment.motion, part.segment.disk))
        drawn.append(series("eq. 4, period 1", ends, level, SeriesStyle.DASHED, 1))
    return Panel("Rotor speed", TIME, "angular velocity α̇ (rad/s)", drawn, note, spans, marks,
                 x_range=time_range(report),
                 topics=("joint_states", "disk/rotor_speed", "disk/impacts"))  # fmt: skip


def _fitted(transient: Transient, first: float, end: float) -> list[Series]:
    """The fitted transient from its first point to the end of its segment, if it is known."""
    if not transient.is_known:
        return []
    if transient.kind is TransientKind.EXPONENTIAL:
        constant = transient.time_constant.value
        times = np.concatenate((np.linspace(first, min(end, first + 6.0 * constant), 200), [end]))
        away = transient.initial - transient.final
        curve = transient.final + away * np.exp(-(times - first) / constant)
        return [
            series(f"exponential fit, T = {constant:.4g} s", times, curve, SeriesStyle.DASHED, 2)
        ]
    if transient.kind is TransientKind.LINEAR:
        last = end if math.isnan(transient.end) else transient.end
        times = np.array([first, last, end])
        curve = transient.initial + transient.rate.value * (np.minimum(times, last) - first)
        return [series("linear fit", times, curve, SeriesStyle.DASHED, 2)]
    return []


def _phases(
    report: Report, most: int, spans: list[tuple[float, float]], marks: list[float]
) -> Panel:
    rows, drawn, note = report.rows, [], ""
    single = single_impacts(rows)
    for name, part, colour in (("impact", rows[single], 0), ("chatter", rows[~single], 1)):
        keep = spread(len(part), most)
        note += downsample(len(keep), len(part), f"{name} rows, chosen at random")
        if len(part):
            drawn.append(series(name, part["time"][keep], part["forcing_phase"][keep],
                                colour=colour))  # fmt: skip
    return Panel("Forcing phase of the impacts", TIME, PHASE, drawn, note, spans, marks,
                 x_range=time_range(report), y_is_phase=True, topics=("disk/impacts",))  # fmt: skip


# --- of the segment shown -------------------------------------------------------------------------
def _where(report: Report) -> str:
    return f", segment {report.shown + 1}" if len(report.segments) > 1 else ""


def _points(report: Report) -> tuple[Column, Column, float]:
    """τ_imp and w_A/(πg/ω) of the single impacts shown, and the unit of w_A (nan: not known)."""
    rows, part = report.shown_rows, report.chosen
    if part is None or part.segment.motion is None or not known(part.segment.disk):
        rows = rows[single_impacts(rows) & (np.abs(rows["y"]) < LARGEST_FLOAT32)]  # none at its end
        return rows["forcing_phase"], rows["y"].astype(float), math.nan
    section = section_of(rows, part.segment.motion, part.segment.disk)
    scale = velocity_scale(part.segment.motion, part.segment.disk)
    return section.forcing_phase.values, section.axial_impact_velocity.values, scale


def _section(report: Report, most: int) -> Panel:
    x, y, scale = _points(report)
    keep = spread(len(x), most)
    note = downsample(len(keep), len(x), "impacts, chosen at random")
    drawn = [series("impact", x[keep], y[keep])] if len(x) else []
    part, theory = report.chosen, _theory(report)
    if part and part.orbit and 0 < part.orbit.impacts <= 64 and not math.isnan(scale):
        found = np.array(part.orbit.axial_impact_velocities) / scale
        name = f"orbit found: {part.orbit.name}"
        drawn.append(series(name, part.orbit.forcing_phases, found, SeriesStyle.RINGS, 1))
    if theory and len(x):
        point = ([theory.forcing_phase], [theory.axial_impact_velocity / scale])
        stable = "stable" if theory.stable else "unstable"
        drawn.append(series(f"period-1 orbit, theory ({stable})", *point, SeriesStyle.CROSSES, 3))
    return Panel(f"Next-collision section{_where(report)}", PHASE, VELOCITY, drawn, note,
                 x_is_phase=True, topics=("disk/impacts",))  # fmt: skip


def _return_map(report: Report, most: int) -> Panel:
    rows = report.shown_rows
    # phases do not depend on the units of velocity, which may not be known
    pairs = return_map_of(rows, _ANY_MOTION, UNKNOWN_DISK)
    x, y = pairs.forcing_phase.values, pairs.next_forcing_phase.values
    keep = spread(len(x), most)
    note = downsample(len(keep), len(x), "pairs, chosen at random")
    drawn, zoomed = [], False
    if len(x):
        ends = [0.0, math.tau]
        low, high = float(min(x.min(), y.min())), float(max(x.max(), y.max()))
        zoomed = high - low < ZOOMED
        if zoomed:
            margin = max(0.1 * (high - low), LEAST_MARGIN)
            ends = [low - margin, high + margin]
        drawn = [
            series("τ_(n+1) = τ_n", ends, ends, SeriesStyle.DASHED, 4),
            series("impact", x[keep], y[keep]),
        ]
    return Panel(f"Return map{_where(report)}", "forcing phase τ_n (rad)",
                 "next forcing phase τ_(n+1) (rad)", drawn, note, x_is_phase=not zoomed,
                 y_is_phase=not zoomed, topics=("disk/impacts",))  # fmt: skip


# --- of the machine -------------------------------------------------------------------------------
def _lateness(report: Report, most: int) -> Panel:
    health = report.record.health
    drawn, note = [], ""
    if health:
        times = np.array([row.stamp - health[0].stamp for row in health])
        for name, colour in (("max", 1), ("p99", 3), ("p50", 0)):
            values = 1e3 * np.array([getattr(row, f"lateness_{name}") for row in health])
            keep = envelope(values, most)
            note = downsample(len(keep), len(values), "reports: least and greatest of each group")
            keep = keep[values[keep] > 0.0]
            drawn.append(
                series(f"lateness {name}", times[keep], values[keep], SeriesStyle.LINE, colour)
            )
    return Panel("Real time: lateness of the simulator's ticks", "wall time since the first "
                 "report (s)", "lateness (ms)", drawn, note, y_is_log=True,
                 topics=("/diagnostics",))  # fmt: skip

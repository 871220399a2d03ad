"""The panels of a report's figures: energy ledger, heights, speeds, phases, sections, lateness.

A panel is a list of series with labels; series that are too long are downsampled.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import LARGEST_FLOAT32, Disk, Energy, Motion
from bouncing_disk_ros.maps.motor_curves import mean_speed
from bouncing_disk_ros.maps.period_one import PeriodOne, period_one
from bouncing_disk_ros.maps.scales import acceleration, axial_forcing_of, velocity_scale
from bouncing_disk_ros.report.impact_energy import impact_energy
from bouncing_disk_ros.report.panel import (
    Column,
    Panel,
    Series,
    SeriesStyle,
    broken,
    envelope,
    series,
    spread,
    with_gaps,
)
from bouncing_disk_ros.report.recorded_offset import Offsets, axial_offset
from bouncing_disk_ros.report.rotor_speed import Speeds
from bouncing_disk_ros.report.run_record import HealthReport, State
from bouncing_disk_ros.report.run_report import Report
from bouncing_disk_ros.report.section import section_velocity, single_impacts, successive_impacts
from bouncing_disk_ros.report.spans import RESET, Segment, known
from bouncing_disk_ros.report.steady_speed import flown
from bouncing_disk_ros.report.transient import Transient, TransientKind

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_ON_PAGE = 50_000
"""Points of a series on a page."""
TIME, HEIGHT, SPEED = "simulated time t (s)", "height x, s (mm)", "angular velocity α̇ (rad/s)"
PERIODS = 6
"""Periods of the platform whose heights are shown."""
LEAST_SAMPLES = 12
"""Samples of a period, on average: with fewer a curve of heights would mislead."""
_POINTS = 600
"""Points of each curve of heights that is drawn from the impacts."""
PHASE = "forcing phase at impact τ_imp (rad)"
VELOCITY = "impact velocity w_A/(πg/ω)"
ZOOMED = 0.5 * math.pi
"""A return map whose phases lie within this (rad) shows their part of the plane alone ..."""
LEAST_MARGIN = 0.05
"""... with so much (rad) around them at least: an orbit of one phase is a point."""
_LEDGER = (
    ("work, axial", "work_axial", 0),
    ("work, angular", "work_angular", 5),
    ("loss in impacts, axial", "loss_impact_axial", 1),
    ("loss in impacts, friction", "loss_impact_friction", 3),
    ("loss in sliding", "loss_sliding", 2),
    ("taken by the brake", "loss_brake", 4),
)
_LOSSES = [name for name in Energy._fields if name.startswith("loss")]
_RINGS = 40
"""Recomputed points in the panel of the ledger."""


def absent(report: Report, panel: Panel) -> str:
    """Why a panel is empty, in words."""
    return f"{', '.join(panel.topics)}: {report.source.absence(*panel.topics)}"


def headline(report: Report) -> tuple[str, str]:
    """The title of a report and a line under it."""
    source = report.source
    name = Path(source.name).name + ("" if source.namespace == "/" else f", {source.namespace}")
    name += f", run {source.run} of {source.runs}" if source.runs > 1 else ""
    part = report.chosen
    if part is None:
        return name, "nothing recorded"
    words = [f"segment {report.shown + 1} of {len(report.segments)}"]
    segment = part.segment
    if segment.motion and part.is_confirmed and known(segment.disk):
        axial_forcing = axial_forcing_of(segment.motion, segment.disk)
        words.append(f"axial forcing Γ = {axial_forcing:.4f}")
        words.append(f"restitution ε = {segment.disk.restitution:g}")
        words.append(f"θ = {segment.motion.phase_lag:.3f} rad")
    words.append(f"orbit found: {part.orbit.name if part.orbit else 'none'}")
    return name, ", ".join(words)


# ------------------------------------------------------------------------------------------------
# The panel of the energy ledger: as the simulator reports them, and as the impacts give them.


def time_range(report: Report) -> tuple[float, float]:
    """What axes of simulated time show, s: the run and a little more."""
    margin = 0.02 * (report.end - report.begin)
    return report.begin - margin, report.end + margin


def rows_before(rows: NDArray[np.void], health: HealthReport) -> int:
    """How many of some rows came before a report: by its count of them, else by its time."""
    if health.rows >= 0:
        return int(np.searchsorted(rows["index"], health.rows))
    return int(np.searchsorted(rows["time"], health.simulated, side="right"))


def _resets_before(report: Report, health: list[HealthReport]) -> NDArray[np.intp]:
    """How many resets each report comes after: those known, and those that a falling loss shows."""
    times = np.array([row.simulated for row in health])
    resets = [change.time for change in report.spans.changes if change.what == RESET]
    losses = np.array([[getattr(row.energy, name) for name in _LOSSES] for row in health])
    losses = losses.reshape(len(health), len(_LOSSES))
    falls = np.any(np.diff(losses, axis=0) < 0.0, axis=1)
    found: NDArray[np.intp] = np.searchsorted(resets, times, side="right")
    found[1:] += np.cumsum(falls)
    return found


def energy_panel(report: Report, most: int) -> Panel:
    """The ledger over time, broken at resets; rings are the losses recomputed from the impacts."""
    health = [row for row in report.record.health if row.energy is not None]
    drawn, note = [], ""
    times = np.array([row.simulated for row in health])
    since = _resets_before(report, health)
    for name, field, colour in _LEDGER if health else ():
        values = np.array([getattr(row.energy, field) for row in health])
        keep = envelope(values, most)
        if len(keep) < len(values):
            note = f"{len(keep)} of {len(values)} reports. "
        look = SeriesStyle.WIDE if name.startswith("work") else SeriesStyle.LINE
        resets = np.flatnonzero(np.diff(since[keep])) + 1
        drawn.append(series(name, *broken(times[keep], values[keep], resets), look, colour))
    check = report.ledger
    if check is not None:
        first, last = np.searchsorted(report.rows["index"], (check.first, check.last))
        rows = report.rows[int(first) : int(last)]
        losses = impact_energy(rows, check.disk)
        within = [row for row in health if check.begin <= row.simulated <= check.end]
        some = np.linspace(0, len(within) - 1, min(len(within), _RINGS)).astype(int)
        shown = [within[place] for place in np.unique(some)]
        until = [rows_before(rows, one) for one in shown]
        axial = np.where(losses.summed, 0.0, losses.axial)
        for name, each, start, colour in (
            ("axial", axial, check.start_axial, 1),
            ("friction", losses.friction, check.start_friction, 3),
        ):
            summed = np.concatenate(([0.0], np.cumsum(each)))
            drawn.append(
                series(
                    f"{name}, from the impacts",
                    np.array([one.simulated for one in shown]),
                    start + summed[until],
                    SeriesStyle.RINGS,
                    colour,
                )
            )
        note += "Rings: losses recomputed from the impacts. "
    return Panel("Energy ledger", TIME, "energy E (J)", drawn, note,
                 x_range=time_range(report), topics=("/diagnostics",))  # fmt: skip


# ------------------------------------------------------------------------------------------------
# Heights of disk and platform over the last periods of a segment, as a panel.


def height_panel(report: Report) -> Panel:
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
    return Panel(title, TIME, HEIGHT, drawn, note, topics=topics)


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
    drawn = sampled_heights(states, rows[rows["time"] >= begin], look)
    return drawn, "" if enough else "Points: too few samples for curves. "


def sampled_heights(
    states: Sequence[State], rows: NDArray[np.void], look: SeriesStyle, longest: float = math.inf
) -> list[Series]:
    """Heights by samples and impacts; lines have gaps where samples are `longest` (s) apart."""
    heights = [(state.time, state.platform_position, state.disk_position) for state in states]
    samples = np.array(heights).reshape(-1, 3)
    time, height = with_corners(samples[:, 0], samples[:, 2], rows)
    platform = with_gaps(samples[:, 0], 1e3 * samples[:, 1], longest)
    disk = with_gaps(time, 1e3 * height, longest)
    return [
        series("platform s", *platform, look, 3),
        series("disk x", *disk, look, 0),
        *_impacts(rows),
    ]


def with_corners(time: Column, height: Column, rows: NDArray[np.void]) -> tuple[Column, Column]:
    """Samples and impacts in the order of time: the samples alone miss the corners."""
    times = np.concatenate((time, rows["time"]))
    order = np.argsort(times, kind="stable")
    return times[order], np.concatenate((height, rows["axial_position"]))[order]


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


# ------------------------------------------------------------------------------------------------
# The figures of a report as panels: series with labels, downsampled where too long.


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
        height_panel(report),
    ]


def report_page(report: Report) -> Figure:
    """All panels of a report as a page, which `panel_page.save_page` writes."""
    from bouncing_disk_ros.report.panel_page import panels_page

    drawn = [(panel, absent(report, panel)) for panel in panels(report, MOST_ON_PAGE)]
    return panels_page(*headline(report), drawn)


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
    return Panel("Rotor speed", TIME, SPEED, drawn, note, spans, marks,
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
    rows, given = rows[single_impacts(rows)], (part.segment.motion, part.segment.disk)
    return rows["forcing_phase"], section_velocity(rows, *given), velocity_scale(*given)


def _section(report: Report, most: int) -> Panel:
    x, y, scale = _points(report)
    keep = spread(len(x), most)
    note = downsample(len(keep), len(x), "impacts, chosen at random")
    drawn = [series("impact", x[keep], y[keep])] if len(x) else []
    part, theory = report.chosen, _theory(report)
    if part and part.orbit and 0 < part.orbit.impacts <= 64 and not math.isnan(scale):
        found = np.array(part.orbit.axial_impact_velocities) / scale
        name = f"orbit found: {part.orbit.name}"
        drawn.append(series(name, part.orbit.forcing_phases, found, SeriesStyle.RINGS, 2))
    if theory and len(x):
        point = ([theory.forcing_phase], [theory.axial_impact_velocity / scale])
        stable = "stable" if theory.stable else "unstable"
        drawn.append(series(f"period-1 orbit, theory ({stable})", *point, SeriesStyle.CROSSES, 1))
    return Panel(f"Next-collision section{_where(report)}", PHASE, VELOCITY, drawn, note,
                 x_is_phase=True, topics=("disk/impacts",))  # fmt: skip


def _return_map(report: Report, most: int) -> Panel:
    x, y = (rows["forcing_phase"] for rows in successive_impacts(report.shown_rows))
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

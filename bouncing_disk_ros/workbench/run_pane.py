"""The pane of the run: puts frames of a `RunView` into its figures, as fast as the page draws."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any, NamedTuple, cast

import numpy as np
from bokeh.layouts import column, row
from bokeh.models import ColumnDataSource, DataRange1d, Div, FixedTicker, Range1d, Span
from bokeh.plotting import figure
from numpy.typing import NDArray

from bouncing_disk_ros.colours import DISK, PLATFORM, SKY, THEORY
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.maps.period_one import period_one
from bouncing_disk_ros.maps.scales import axial_forcing_of, velocity_scale
from bouncing_disk_ros.side_window import SideWindow, side_window
from bouncing_disk_ros.units import in_pi, number_text, shown_unit
from bouncing_disk_ros.workbench.page_style import one_column
from bouncing_disk_ros.workbench.run_history import RunHistory, numbers
from bouncing_disk_ros.workbench.run_view import (
    PATH_SECONDS,
    SPEED_SECONDS,
    FlowControl,
    Frame,
    RunView,
)
from bouncing_disk_ros.workbench.strobe import shown_motion, text_of

Rows = Mapping[str, NDArray[np.float64]]
SLICES = (SKY, DISK) * 4
MARKS = 12
SIDE_WIDTH, SIDE_HEIGHT, LOWER = 230, 225, 195
"""Sizes of the frames of the side view and of the lower figures, pixels."""
KEPT_PATH, KEPT_SPEEDS, KEPT_POINTS = 2000, 1000, 5000
"""Rows that a figure holds in the browser."""
WINDOW_SECONDS = 1.0
"""The window of heights is looked at again this often, in seconds of the wall clock."""
_ASPECT = SIDE_HEIGHT / SIDE_WIDTH


class RunFigures(NamedTuple):
    """The figures with the sources of their data."""

    side: Any
    path: Any
    top: Any
    speed: Any
    section: Any
    heights: Range1d  # of side view and path
    side_rows: ColumnDataSource
    path_rows: ColumnDataSource
    slices: ColumnDataSource
    marks: ColumnDataSource
    speed_rows: ColumnDataSource
    points: ColumnDataSource
    theory: ColumnDataSource  # the period-1 orbit on the section
    predicted: Span
    caption: Div


def _quiet(plot: Any) -> Any:
    """A figure without a logo, small titles."""
    plot.toolbar.logo = None
    plot.toolbar.autohide = True
    plot.title.text_font_size = "12px"
    return plot


def run_figures() -> RunFigures:
    """New figures for one page."""
    heights = Range1d(-0.1, 0.3)
    side_rows = ColumnDataSource(
        {"left": [], "right": [], "bottom": [], "top": [], "color": []}, name="side"
    )
    side = _quiet(
        figure(
            width=SIDE_WIDTH + 80, height=SIDE_HEIGHT + 75, title="side view", y_range=heights,
            min_border_left=55, x_range=Range1d(-0.2, 0.2), tools="save", output_backend="canvas",
        )
    )  # fmt: skip
    side.quad("left", "right", "top", "bottom", source=side_rows, color="color", line_color=None)
    side.grid.grid_line_alpha = 0.4
    side.xaxis.ticker.desired_num_ticks = 4
    path_rows = ColumnDataSource({"time": [], "disk": [], "platform": []}, name="path")
    path = _quiet(
        figure(
            height=SIDE_HEIGHT + 75, sizing_mode="stretch_width", title="path", y_range=heights,
            tools="save", x_axis_label="simulated time (s)",
            x_range=DataRange1d(
                follow="end", follow_interval=4.0, range_padding=0.0, name="shown_time"
            ),
        )
    )  # fmt: skip
    path.line("time", "platform", source=path_rows, color=PLATFORM, line_width=2,
              legend_label="platform s")  # fmt: skip
    path.line("time", "disk", source=path_rows, color=DISK, line_width=2, legend_label="disk x")
    path.legend[0].update(  # below the lines, in the room that the window leaves there
        location="bottom_left", orientation="horizontal", label_text_font_size="11px",
        background_fill_alpha=0.6, border_line_color=None, padding=1, margin=2,
    )  # fmt: skip
    speed_rows = ColumnDataSource({"time": [], "speed": []}, name="speed")
    speed = _quiet(
        figure(
            height=LOWER + 70, sizing_mode="stretch_width", title="", tools="save",
            x_axis_label="simulated time (s)", y_axis_label="rotor speed α̇ (rad/s)",
            x_range=DataRange1d(follow="end", follow_interval=30.0, range_padding=0.0),
            y_range=Range1d(0.0, 1.0),
        )
    )  # fmt: skip
    speed.title.text_font_size = "11px"  # the whole of it beside two figures on 1366 pixels
    speed.line("time", "speed", source=speed_rows, color=DISK, line_width=2)
    predicted = Span(dimension="width", line_color=THEORY, line_dash="dashed", line_width=2,
                     visible=False)  # fmt: skip
    speed.add_layout(predicted)
    top, slices, marks = _top_view()
    section, points, theory = _section()
    caption = Div(text="", styles={"font-size": "12px", "color": "#555"})
    return RunFigures(
        side, path, top, speed, section, heights, side_rows, path_rows, slices, marks, speed_rows,
        points, theory, predicted, caption,
    )  # fmt: skip


def _top_view() -> tuple[Any, ColumnDataSource, ColumnDataSource]:
    top = _quiet(
        figure(
            width=LOWER + 80, height=LOWER + 70, title="top view", tools="save",
            x_range=Range1d(-1.55, 1.55), y_range=Range1d(-1.55, 1.55),
            min_border_left=40, min_border_right=40, outline_line_color=None,
        )
    )  # fmt: skip
    top.axis.visible = False
    top.grid.visible = False
    slices = ColumnDataSource({"start": [], "end": [], "color": []}, name="slices")
    marks = ColumnDataSource({"x0": [], "y0": [], "x1": [], "y1": [], "width": []}, name="marks")
    top.circle(0, 0, radius=1.4, fill_color=PLATFORM, fill_alpha=0.25, line_color=PLATFORM)
    top.segment("x0", "y0", "x1", "y1", source=marks, line_width="width", color=PLATFORM)
    top.wedge(0, 0, radius=1.0, start_angle="start", end_angle="end", source=slices,
              fill_color="color", line_color="white")  # fmt: skip
    return top, slices, marks


def _section() -> tuple[Any, ColumnDataSource, ColumnDataSource]:
    section = _quiet(
        figure(
            width=LOWER + 165, height=LOWER + 70, title="section: each impact a point",
            tools="save", x_range=Range1d(0.0, 2.0),
            y_range=Range1d(-2.0, -0.6),
            x_axis_label="phase of the forcing τ (rad)", y_axis_label="impact velocity w_A (πg/ω)",
        )
    )  # fmt: skip
    section.xaxis.ticker = FixedTicker(ticks=[0, 0.5, 1, 1.5, 2])
    section.xaxis.major_label_overrides = {0.5 * k: in_pi(0.5 * k) for k in range(5)}
    points = ColumnDataSource({"phase": [], "velocity": []}, name="section")
    theory = ColumnDataSource({"phase": [], "velocity": []}, name="theory")
    section.scatter("phase", "velocity", source=theory, marker="cross", size=16, color=THEORY,
                    line_width=2)  # fmt: skip
    section.scatter("phase", "velocity", source=points, size=4, color=DISK, alpha=0.7)
    return section, points, theory


def fitted(low: float, high: float, least: float, start: float, end: float) -> tuple[float, float]:
    """A range for values from `low` to `high`, at least `least` wide.

    It is the one from `start` to `end` where that fits still: so it does not tremble.
    """
    span = max(high - low, least, 1e-9 * abs(high), 1e-12)
    if start <= low and high <= end and span >= 0.4 * (end - start):
        return start, end
    middle = 0.5 * (low + high)
    return middle - 0.65 * span, middle + 0.65 * span


class RunPane:
    """Figures of a run for one page; `update` draws what is new."""

    def __init__(self, history: RunHistory) -> None:
        self.flow = FlowControl()
        self._history = history
        self._view = RunView(history)
        self._figures = run_figures()
        self._window: SideWindow | None = None
        self._looked = -math.inf
        self._size = 1.0
        self._values: dict[str, float] = {}
        self._scale = 1.0
        self._least_speed, self._predicted = 0.0, cast("float | None", None)
        self._factor = 1.0
        figures = self._figures
        figures.path.x_range.on_change("end", self._on_drawn)
        self.layout = column(
            row(
                figures.side, figures.path, sizing_mode="stretch_width", stylesheets=[one_column()]
            ),
            figures.caption,
            row(
                figures.top,
                figures.section,
                figures.speed,
                sizing_mode="stretch_width",
                stylesheets=[one_column()],
            ),
            sizing_mode="stretch_width",
        )

    def _on_drawn(self, _name: str, _old: Any, new: Any) -> None:
        if isinstance(new, (int, float)):
            self.flow.note_drawn(float(new))

    def update(self, until: float = math.inf) -> Frame | None:
        """Draw what is new; None where nothing is, or the page is not done with the last frames."""
        now = time.monotonic()
        if not self.flow.may_send(now):
            return None
        frame = self._view.frame(until)
        self._take_values(numbers(frame.values))
        if frame.is_empty or frame.pose is None:
            return frame
        if frame.clear:
            self.flow.restart()
            self._looked = -math.inf
        if now - self._looked > WINDOW_SECONDS or self._is_outside(frame.pose):
            self._looked = now
            if self._look(frame.time):
                frame = self._anew(until)
            self._look_at_speeds(frame.time)
        self._draw(frame)
        if len(frame.samples) and self._history.phase != "paused":
            self.flow.note_sent(now, float(frame.samples["time"][-1]))
        else:
            self.flow.sent += 1
        return frame

    def _anew(self, until: float) -> Frame:
        """The frame with all rows: heights are in another unit."""
        self._view.restart()
        return self._view.frame(until)

    # --- what is in force
    def _take_values(self, values: Mapping[str, float]) -> None:
        if values == self._values:
            return
        self._values = dict(values)
        motion, disk = Motion.of(values), Disk.of(values)
        figures = self._figures
        self._scale = velocity_scale(motion, disk) or 1.0
        factor = values["real_time_factor"]
        self._factor = min(1.0, factor) if factor > 0.0 else 1.0
        self._view.path_seconds = PATH_SECONDS * self._factor
        figures.path.x_range.follow_interval = PATH_SECONDS * self._factor
        figures.speed.x_range.follow_interval = SPEED_SECONDS * self._factor
        self._least_speed = 0.2 * math.tau * motion.frequency * motion.angular_amplitude or 1.0
        orbit = period_one(motion, disk)
        forcing = axial_forcing_of(motion, disk)
        if orbit is None:
            figures.theory.data = {"phase": [], "velocity": []}
            figures.predicted.visible = False
            figures.speed.title.text = f"Γ = {number_text(forcing, 3)}: no period 1"
        else:
            figures.theory.data = {
                "phase": [orbit.forcing_phase / math.pi],
                "velocity": [orbit.axial_impact_velocity / self._scale],
            }
            figures.predicted.location = orbit.angular_velocity
            figures.predicted.visible = True
            kind = "stable" if orbit.stable else "unstable"
            figures.speed.title.text = (
                f"dashed: eq. 4, {number_text(orbit.angular_velocity)} rad/s ({kind})"
            )
        self._predicted = None if orbit is None else orbit.angular_velocity
        self._looked = -math.inf
        self._caption()

    def _caption(self) -> None:
        values, window = self._values, self._window
        parts = []
        if window is not None:
            parts.append(
                "side view to scale"
                if window.magnification == 1.0
                else f"side view: heights × {window.magnification:,.0f} of the scale of widths"
            )
        shown = shown_motion(values["frequency"], values["state_rate"], values["real_time_factor"])
        if text := text_of(shown, values["frequency"]):
            parts.append(text)
        self._figures.caption.text = "; ".join(parts)

    # --- the window of heights
    def _diameter(self) -> float:
        return 2.0 * math.sqrt(2.0) * self._values["gyration_radius"]

    def _is_outside(self, pose: Any) -> bool:
        heights = self._figures.heights
        return not heights.start <= float(pose["disk_position"]) / self._size <= heights.end

    def _look(self, now: float) -> bool:
        """Fit the window to the path; whether the unit of heights is another one than before."""
        amplitude = self._values["axial_amplitude"]
        with self._history.lock:
            since = now - self._view.path_seconds
            path = self._history.samples.between(since, now, KEPT_PATH)
        disk, platform = path["disk_position"], path["platform_position"]
        low = min([-amplitude, *([platform.min(), disk.min()] if len(disk) else [])])
        high = max([amplitude, *([disk.max()] if len(disk) else [])])
        window = side_window(self._diameter(), float(low), float(high), _ASPECT)
        held = self._window
        if held is not None and held.low <= low and high <= held.high:
            share = (high - low) / (held.high - held.low)
            if share > 0.25 or window == held:  # it still fits
                return False
        self._window = window
        size, unit = shown_unit("m", 0.4 * (window.high - window.low))
        figures, changed = self._figures, size != self._size
        self._size = size
        figures.heights.update(start=window.low / size, end=window.high / size)
        figures.side.yaxis.axis_label = f"height ({unit})"
        wide, name = shown_unit("m", 0.8 * window.half_width)
        figures.side.x_range.update(start=-window.half_width / wide, end=window.half_width / wide)
        figures.side.xaxis.axis_label = f"width ({name})"
        self._caption()
        return changed

    def _look_at_speeds(self, now: float) -> None:
        """Fit the range of speeds to what is shown."""
        with self._history.lock:
            since = now - SPEED_SECONDS * self._factor
            shown = self._history.speeds.between(since, now, KEPT_SPEEDS)
        found = [*shown["speed"], *([] if self._predicted is None else [self._predicted])]
        if not found:
            return
        _fit(self._figures.speed.y_range, min(found), max(found), self._least_speed)

    # --- drawing
    def _draw(self, frame: Frame) -> None:
        figures, size = self._figures, self._size
        samples, points, speeds = frame.samples, frame.points, frame.speeds
        path = {
            "time": samples["time"],
            "disk": samples["disk_position"] / size,
            "platform": samples["platform_position"] / size,
        }
        _put(figures.path_rows, _broken(path, frame.sample_gaps), frame.clear, KEPT_PATH)
        speed = {"time": speeds["time"], "speed": speeds["speed"]}
        _put(figures.speed_rows, _broken(speed, frame.speed_gaps), frame.clear, KEPT_SPEEDS)
        section = {
            "phase": points["forcing_phase"] / math.pi,
            "velocity": points["velocity"] / self._scale,
        }
        _put(figures.points, section, frame.clear_section, KEPT_POINTS)
        shown = np.append(figures.points.data["velocity"], figures.theory.data["velocity"])
        if len(section["velocity"]):
            _fit(figures.section.y_range, shown.min(), shown.max(), 1.0)
        assert frame.pose is not None
        self._draw_pose(frame.pose)

    def _draw_pose(self, pose: np.void) -> None:
        window, size = self._window, self._size
        assert window is not None
        wide, _ = shown_unit("m", 0.8 * window.half_width)
        height = window.high - window.low
        radius, half = 0.5 * self._diameter() / wide, 0.92 * window.half_width / wide
        disk, platform = pose["disk_position"] / size, pose["platform_position"] / size
        self._figures.side_rows.data = {
            "left": [-half, -radius],
            "right": [half, radius],
            "bottom": [platform - 0.05 * height / size, disk],
            "top": [platform, disk + 0.03 * height / size],
            "color": [PLATFORM, DISK],
        }
        angle, turned = float(pose["disk_angle"]), float(pose["platform_angle"])
        step = math.tau / len(SLICES)
        starts = [math.remainder(angle, math.tau) + k * step for k in range(len(SLICES))]
        self._figures.slices.data = {
            "start": starts,
            "end": [start + step for start in starts],
            "color": list(SLICES),
        }
        self._figures.marks.data = marks_at(turned)


def marks_at(angle: float) -> dict[str, list[float]]:
    """The marks on the platform's rim, turned by an angle in rad; the first is the bold one."""
    directions = [angle + k * math.tau / MARKS for k in range(MARKS)]
    inner = [1.05] + [1.25] * (MARKS - 1)
    return {
        "x0": [r * math.cos(a) for r, a in zip(inner, directions, strict=True)],
        "y0": [r * math.sin(a) for r, a in zip(inner, directions, strict=True)],
        "x1": [1.4 * math.cos(a) for a in directions],
        "y1": [1.4 * math.sin(a) for a in directions],
        "width": [6.0] + [2.0] * (MARKS - 1),
    }


def _fit(axis: Any, low: float, high: float, least: float) -> None:
    """Let an axis show values from `low` to `high`, where it does not yet."""
    start, end = fitted(float(low), float(high), least, axis.start, axis.end)
    if (start, end) != (axis.start, axis.end):
        axis.update(start=start, end=end)


def _broken(rows: Rows, gaps: NDArray[np.intp]) -> Rows:
    """Rows of a line with nan before those that come after a gap: no line is drawn across it."""
    return {
        name: np.insert(column, gaps, column[gaps] if name == "time" else math.nan)
        for name, column in rows.items()
    }


def _put(source: Any, rows: Rows, clear: bool, keep: int) -> None:
    """Add rows to a source, or let it begin anew with them."""
    count = len(next(iter(rows.values())))
    if clear:
        source.data = dict(rows)
    elif count:
        source.stream(dict(rows), rollover=keep)

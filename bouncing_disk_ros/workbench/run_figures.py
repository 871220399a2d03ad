"""The figures of a run, empty: side view, path, top view, rotor speed, section."""

from __future__ import annotations

from typing import Any, NamedTuple

from bokeh.models import ColumnDataSource, DataRange1d, Div, FixedTicker, Range1d, Span
from bokeh.plotting import figure

DISK, PLATFORM, THEORY, QUIET = "#D55E00", "#0072B2", "#009E73", "#999999"
"""Okabe and Ito's colours, as in the figures of the studies."""
SLICES = ("#E69F00", "#D55E00") * 4
MARKS = 12
SIDE_WIDTH, SIDE_HEIGHT, LOWER = 230, 270, 230
"""Sizes of the frames of the side view and of the lower figures, pixels."""


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
    path.legend.location = "bottom_left"
    path.legend.orientation = "horizontal"
    path.legend.label_text_font_size = "11px"
    path.legend.background_fill_alpha = 0.6
    speed_rows = ColumnDataSource({"time": [], "speed": []}, name="speed")
    speed = _quiet(
        figure(
            height=LOWER + 70, sizing_mode="stretch_width", title="rotor speed", tools="save",
            x_axis_label="simulated time (s)", y_axis_label="α̇ (rad/s)",
            x_range=DataRange1d(follow="end", follow_interval=30.0, range_padding=0.0),
            y_range=Range1d(0.0, 1.0),
        )
    )  # fmt: skip
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
            width=LOWER + 160, height=LOWER + 70, title="section: each impact a point",
            tools="save", x_range=Range1d(0.0, 2.0),
            y_range=Range1d(-2.0, -0.6),
            x_axis_label="phase of the forcing τ (rad)", y_axis_label="w_A / (πg/ω)",
        )
    )  # fmt: skip
    section.xaxis.ticker = FixedTicker(ticks=[0, 0.5, 1, 1.5, 2])
    section.xaxis.major_label_overrides = {0: "0", 0.5: "π/2", 1: "π", 1.5: "3π/2", 2: "2π"}
    points = ColumnDataSource({"phase": [], "velocity": []}, name="section")
    theory = ColumnDataSource({"phase": [], "velocity": []}, name="theory")
    section.scatter("phase", "velocity", source=theory, marker="cross", size=16, color=THEORY,
                    line_width=2)  # fmt: skip
    section.scatter("phase", "velocity", source=points, size=4, color=DISK, alpha=0.7)
    return section, points, theory

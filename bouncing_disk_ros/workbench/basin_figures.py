"""The figures of the basin pane: a map with attractors and an orbit on it, and the orbit's path."""

from __future__ import annotations

import html
import math
from typing import Any

import numpy as np
from bokeh.models import (
    BasicTicker,
    ColumnDataSource,
    FixedTicker,
    HoverTool,
    LinearColorMapper,
    Range1d,
)
from bokeh.plotting import figure

from bouncing_disk_ros.maps.attractors import AttractorKind
from bouncing_disk_ros.report.style import BLACK, BLUE, UNRESOLVED, VERMILION, YELLOW, in_pi
from bouncing_disk_ros.study.basins.picture import colors_of
from bouncing_disk_ros.workbench.start_orbit import Orbit
from bouncing_disk_ros.workbench.start_plane import View, Window, described, points_of, whole_window

FINEST = 2e-13
"""Least width of a window: there a browser's own arithmetic ends too."""
WIDEST_PHASE, FASTEST = 4.0 * math.pi, 100.0
"""Bounds of what can be shown: forcing phase to both sides of 0, and w_A."""
WIDE: dict[str, Any] = {"sizing_mode": "stretch_width", "min_width": 400, "max_width": 760}
"""How figures and texts take the room that the page has."""
NUMBERED = 4
"""Impacts of an orbit after its start that show their number."""
_LONG_LABELS = 1e-4
"""In a window narrower than this part of π the numbers at its ticks are long."""
_POINTS = ("x", "y", "name", "fill", "size")
_CLOUD = 100
"""An attractor of more points is drawn by small ones."""


class MapFigure:
    """The plane of starts: labels as colours, points of the attractors, one orbit.

    Attribute: `figure`, whose ranges are the window.
    """

    def __init__(self) -> None:
        whole = whole_window()
        self.figure = figure(
            height=520, **WIDE, tools="pan,wheel_zoom,box_zoom,reset",
            active_scroll="wheel_zoom", toolbar_location="right",
            x_range=Range1d(*whole[:2], bounds=(-WIDEST_PHASE, WIDEST_PHASE), min_interval=FINEST),
            y_range=Range1d(*whole[2:], bounds=(-FASTEST, 0.0), min_interval=FINEST),
            x_axis_label="forcing phase at the first impact τ (rad)",
            y_axis_label="relative velocity before it w_A (πg/ω)",
        )  # fmt: skip
        self.figure.toolbar.logo = None
        self.figure.background_fill_color = UNRESOLVED
        self.figure.grid.visible = False
        self._labels = ColumnDataSource(data={"image": [], "x": [], "y": [], "dw": [], "dh": []})
        self._mapper = LinearColorMapper(palette=[UNRESOLVED], low=-0.5, high=0.5)
        self._points = ColumnDataSource(data={name: [] for name in _POINTS})
        self._names = ColumnDataSource(data={"x": [], "y": [], "text": []})
        self._impacts = ColumnDataSource(data={"x": [], "y": []})
        self._numbers = ColumnDataSource(data={"x": [], "y": [], "text": []})
        self._start = ColumnDataSource(data={"x": [], "y": []})
        self._draw()
        self.set_ticks(whole)

    def _draw(self) -> None:
        at = self.figure
        at.image("image", "x", "y", "dw", "dh", source=self._labels, color_mapper=self._mapper,
                 level="image")  # fmt: skip
        points = at.scatter("x", "y", size="size", fill_color="fill", line_color=BLACK,
                            line_width=0.6, source=self._points)  # fmt: skip
        at.add_tools(HoverTool(renderers=[points], tooltips=[("attractor", "@name")]))
        words = {
            "text_font_size": "11px", "background_fill_color": "white",
            "background_fill_alpha": 0.75, "padding": 1, "x_offset": 8,
        }  # fmt: skip
        at.scatter("x", "y", size=7, fill_color=YELLOW, line_color=BLACK, line_width=0.8,
                   source=self._impacts)  # fmt: skip
        at.text("x", "y", "text", source=self._numbers, y_offset=6, **words)
        at.text("x", "y", "text", source=self._names, y_offset=-4, text_font_style="bold", **words)
        at.scatter("x", "y", size=18, marker="cross", color=BLACK, line_width=4, source=self._start)
        at.scatter("x", "y", size=15, marker="cross", color=YELLOW, line_width=2,
                   source=self._start)  # fmt: skip

    @property
    def window(self) -> Window:
        """What is shown."""
        across, up = self.figure.x_range, self.figure.y_range
        return Window(across.start, across.end, up.start, min(up.end, 0.0))

    def show(self, view: View) -> None:
        """Draw the labels of a window and the attractors in it."""
        window = view.window
        self._mapper.update(
            palette=[UNRESOLVED, *colors_of(list(view.names))], low=-0.5,
            high=len(view.names) + 0.5,
        )  # fmt: skip
        self._labels.data = {
            "image": [(view.labels + 1).astype(np.uint8)],
            "x": [window.phase_begin], "y": [window.velocity_begin],
            "dw": [window.phase_end - window.phase_begin],
            "dh": [window.velocity_end - window.velocity_begin],
        }  # fmt: skip
        self._show_points(view)

    def hide(self) -> None:
        """Take labels and attractors away."""
        for source in (self._labels, self._points, self._names):
            source.data = {name: [] for name in source.data}

    def _show_points(self, view: View) -> None:
        columns: dict[str, list[object]] = {name: [] for name in self._points.data}
        names: dict[str, list[object]] = {name: [] for name in self._names.data}
        for one, name in zip(view.attractors, view.names, strict=True):
            points = points_of(one)
            if not len(points):
                continue
            phases = into(points[:, 0], view.window)
            contact = one.kind is AttractorKind.CHATTERING
            small = len(points) > _CLOUD
            columns["x"] += phases.tolist()
            columns["y"] += points[:, 1].tolist()
            columns["name"] += [described(one, name)] * len(points)
            columns["fill"] += [VERMILION if contact else "white"] * len(points)
            columns["size"] += [2 if small else 5 if contact else 9] * len(points)
            if one.kind is AttractorKind.PERIODIC:
                names["x"].append(phases[0])
                names["y"].append(points[0, 1])
                names["text"].append(name)
        self._points.data = columns
        self._names.data = names

    def show_orbit(self, orbit: Orbit | None) -> None:
        """Draw the impacts of an orbit; None: take them away."""
        empty = np.empty(0)
        phases = into(orbit.forcing_phase, self.window) if orbit else empty
        speeds = orbit.velocity if orbit else empty
        # the start has a mark of its own
        self._start.data = {"x": phases[:1], "y": speeds[:1]}
        self._impacts.data = {"x": phases[1:], "y": speeds[1:]}
        few = slice(1, 1 + NUMBERED)
        numbers = [str(k) for k in range(1, len(phases))][:NUMBERED]
        self._numbers.data = {"x": phases[few], "y": speeds[few], "text": numbers}

    def set_ticks(self, window: Window) -> None:
        """Parts of π where a window is wide, decimals where it is not."""
        axis = self.figure.xaxis[0]
        low, high = window.phase_begin / math.pi, window.phase_end / math.pi
        if high - low < 1.0:
            count = 5 if high - low > _LONG_LABELS else 2
            axis.update(ticker=BasicTicker(desired_num_ticks=count), major_label_overrides={})
            return
        step = 0.5 if high - low <= 4.0 else 1.0
        ticks = [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]
        axis.update(
            ticker=FixedTicker(ticks=[math.pi * tick for tick in ticks]),
            major_label_overrides={math.pi * tick: in_pi(tick) for tick in ticks},
        )


class PathFigure:
    """Height of the disk and of the platform over the first periods of an orbit."""

    def __init__(self) -> None:
        self.figure = figure(
            height=280, **WIDE, tools="xpan,xwheel_zoom,reset", active_scroll="xwheel_zoom",
            x_axis_label="time from the first impact (s)", y_axis_label="height (m)",
            x_range=Range1d(0.0, 1.0), y_range=Range1d(0.0, 1.0), title="Path of an orbit",
        )  # fmt: skip
        self.figure.toolbar.logo = None
        self._path = ColumnDataSource(data={"time": [], "height": [], "platform": []})
        self.figure.line("time", "platform", color=BLACK, source=self._path,
                         legend_label="platform")  # fmt: skip
        self.figure.line("time", "height", color=BLUE, line_width=2, source=self._path,
                         legend_label="disk")  # fmt: skip
        legend = self.figure.legend[0]
        legend.update(orientation="horizontal", background_fill_alpha=0.6, padding=2, margin=4,
                      label_text_font_size="11px")  # fmt: skip

    def show(self, orbit: Orbit | None) -> None:
        """Draw a path; None: take it away."""
        if orbit is None:
            self._path.data = {name: [] for name in self._path.data}
            return
        self._path.data = {
            "time": orbit.time, "height": orbit.height, "platform": orbit.platform,
        }  # fmt: skip
        low, high = float(orbit.platform.min()), float(orbit.height.max())
        span = max(high - low, 1e-12)
        end = float(orbit.time[-1])
        for axis, first, last in (
            (self.figure.x_range, 0.0, end),
            (self.figure.y_range, low - 0.05 * span, high + 0.2 * span),  # room for the legend
        ):
            axis.update(start=first, end=last, reset_start=first, reset_end=last)


def into(phases: np.ndarray, window: Window) -> np.ndarray:
    """Forcing phases moved by whole periods to the first place in a window."""
    return window.phase_begin + np.mod(phases - window.phase_begin, math.tau)


def legend(view: View) -> str:
    """The colours with what they stand for and their share of the window, as HTML."""
    names = [*map(described, view.attractors, view.names), "unresolved"]
    colors = [*colors_of(list(view.names)), UNRESOLVED]
    rows = []
    for name, color, share in zip(names, colors, view.shares, strict=True):
        if name == "unresolved" and share == 0.0:
            continue
        square = (
            f'<span style="display:inline-block;width:12px;height:12px;border:1px solid {BLACK};'
            f'background:{color}"></span>'
        )
        rows.append(f"{square} {html.escape(name)}: {100.0 * share:.2f} %")
    return "<br>".join(rows)

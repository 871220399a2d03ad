"""Basins of the map in the page: what is in view, its figures, and the pane."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from typing import Any

import numpy as np
from bokeh.events import MouseMove, Tap
from bokeh.layouts import column, row
from bokeh.models import (
    BasicTicker,
    Button,
    ColumnDataSource,
    Div,
    FixedTicker,
    HoverTool,
    LinearColorMapper,
    Range1d,
)
from bokeh.plotting import figure

from bouncing_disk_ros.colours import (
    BLACK,
    DISK,
    PLATFORM,
    UNRESOLVED_AREA,
    VERMILION,
    YELLOW,
    attractor_colours,
)
from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.maps.absorbing_region import AbsorbingRegion, absorbing_regions
from bouncing_disk_ros.maps.attractor_search import window_attractors
from bouncing_disk_ros.maps.attractors import AttractorKind, Attractors, numbered
from bouncing_disk_ros.maps.basin_labels import LabelRule, label_starts
from bouncing_disk_ros.maps.basin_measures import centres
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.window_basins import label_plane
from bouncing_disk_ros.parameters import DEFAULTS
from bouncing_disk_ros.study.basins.options import DEFINITION as BASINS
from bouncing_disk_ros.units import in_pi, number_text, shown_unit
from bouncing_disk_ros.workbench.latest_work import IsObsolete, LatestWork
from bouncing_disk_ros.workbench.page_style import one_column
from bouncing_disk_ros.workbench.start_plane import (
    NOT_DECIDED,
    Orbit,
    Start,
    View,
    Window,
    described,
    is_distinct,
    orbit_of,
    pixel_centre,
    place_of,
    points_of,
    section_of,
    start_at,
    whole_window,
)
from bouncing_disk_ros.workbench.tab import TabPane, placed

COARSE, FULL = 128, 512
"""Pixels along each side of a view: what is shown at first, and in the end."""
_ROWS = 128
"""Rows labelled between two questions whether the view is still wanted: 20 to 150 ms."""
_KEPT = 12
"""Sections whose attractors are kept: a chaotic one has 1 MB."""


def view(
    section: NextCollisionMap,
    window: Window,
    side: int,
    is_obsolete: Callable[[], bool] = lambda: False,
) -> View | None:
    """Labels of side × side starts of a window; None if it becomes obsolete meanwhile.

    The labels are those of the study `basins` over this window where that finds the same
    attractors: here they are looked for once for each section, over the whole window, so that a
    label means the same in every zoom. Raises InputError.
    """
    known = attractors_of(section)
    # looking for them takes longer than a coarse view
    regions = _regions(section) if side > COARSE else {}
    speeds, phases = centres(*window[2:], side), centres(*window[:2], side)
    labels = np.empty((side, side), np.int32)
    for first in range(0, side, _ROWS):
        if is_obsolete():
            return None
        rows = slice(first, first + _ROWS)
        labels[rows] = label_plane(known, section, phases, speeds[rows], _rule(), regions).label
    names = tuple(numbered([one.name for one in known.found]))
    return View(window, labels, known.found, names, is_distinct(window, side))


def label_of(section: NextCollisionMap, phase: float, velocity: float) -> str:
    """Name of the attractor that one start goes to."""
    known = attractors_of(section)
    start = np.array([phase % math.tau]), np.array([velocity])
    label = int(label_starts(known, section, *start, _rule()).label[0])
    return numbered([one.name for one in known.found])[label] if label >= 0 else NOT_DECIDED


def _rule() -> LabelRule:
    """That of the study by default."""
    return LabelRule(float(BASINS.options["tolerance"].default))


@lru_cache(maxsize=_KEPT)
def attractors_of(section: NextCollisionMap) -> Attractors:
    """The attractors in the order of labels, looked for once for all sessions and zooms.

    They are those that the study `basins` finds by default. Raises InputError.
    """
    whole = whole_window()
    width, height = (int(BASINS.options[name].default) for name in ("width", "height"))
    return window_attractors(section, centres(*whole[:2], width), centres(*whole[2:], height))


@lru_cache(maxsize=_KEPT // 4)
def _regions(section: NextCollisionMap) -> dict[int, AbsorbingRegion]:
    return absorbing_regions(section, attractors_of(section))


# ------------------------------------------------------------------------------------------------
# The figures of the basin pane: a map with attractors and an orbit on it, and the orbit's path.


FINEST = 2e-13
"""Least width of a window: there a browser's own arithmetic ends too."""
WIDEST_PHASE, FASTEST = 4.0 * math.pi, 100.0
"""Bounds of what can be shown: forcing phase to both sides of 0, and w_A."""
WIDE: dict[str, Any] = {"sizing_mode": "stretch_width", "min_width": 300, "max_width": 760}
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
        self.figure.background_fill_color = UNRESOLVED_AREA
        self.figure.grid.visible = False
        self._labels = ColumnDataSource(data={"image": [], "x": [], "y": [], "dw": [], "dh": []})
        self._mapper = LinearColorMapper(palette=[UNRESOLVED_AREA], low=-0.5, high=0.5)
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
            palette=[UNRESOLVED_AREA, *attractor_colours(view.names)], low=-0.5,
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
            small = len(points) > _CLOUD
            columns["x"] += phases.tolist()
            columns["y"] += points[:, 1].tolist()
            columns["name"] += [described(one, name)] * len(points)
            columns["fill"] += [VERMILION if one.chatters else "white"] * len(points)
            columns["size"] += [2 if small else 5 if one.chatters else 9] * len(points)
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
            x_range=Range1d(0.0, 1.0), y_range=Range1d(0.0, 1.0), title="Path of an orbit",
        )  # fmt: skip
        self.figure.toolbar.logo = None
        self._path = ColumnDataSource(data={"time": [], "height": [], "platform": []})
        self.figure.line("time", "platform", color=PLATFORM, source=self._path,
                         legend_label="platform")  # fmt: skip
        self.figure.line("time", "height", color=DISK, line_width=2, source=self._path,
                         legend_label="disk")  # fmt: skip
        legend = self.figure.legend[0]
        legend.update(orientation="horizontal", background_fill_alpha=0.6, padding=2, margin=4,
                      label_text_font_size="11px")  # fmt: skip

    def show(self, orbit: Orbit | None) -> None:
        """Draw a path; None: take it away."""
        if orbit is None:
            self._path.data = {name: [] for name in self._path.data}
            return
        low, high = float(orbit.platform.min()), float(orbit.height.max())
        span = max(high - low, 1e-12)
        end = float(orbit.time[-1])
        (second, seconds), (metre, metres) = shown_unit("s", 0.4 * end), shown_unit("m", 0.4 * span)
        self._path.data = {
            "time": orbit.time / second,
            "height": orbit.height / metre,
            "platform": orbit.platform / metre,
        }
        self.figure.xaxis.axis_label = f"time from the first impact ({seconds})"
        self.figure.yaxis.axis_label = f"height ({metres})"
        room = (low - 0.05 * span) / metre, (high + 0.2 * span) / metre  # for the legend
        for axis, first, last in (
            (self.figure.x_range, 0.0, end / second),
            (self.figure.y_range, *room),
        ):
            axis.update(start=first, end=last, reset_start=first, reset_end=last)


def into(phases: np.ndarray, window: Window) -> np.ndarray:
    """Forcing phases moved by whole periods to the first place in a window."""
    return window.phase_begin + np.mod(phases - window.phase_begin, math.tau)


def legend(view: View) -> str:
    """The colours with what they stand for and their share of the window, as HTML."""
    names = [*map(described, view.attractors, view.names), "unresolved"]
    colors = [*attractor_colours(view.names), UNRESOLVED_AREA]
    rows = []
    for name, color, share in zip(names, colors, view.shares, strict=True):
        if name == "unresolved" and share == 0.0:
            continue
        square = (
            f'<span style="display:inline-block;width:12px;height:12px;border:1px solid {BLACK};'
            f'background:{color}"></span>'
        )
        rows.append(f"{square} {html.escape(name)}: {share_text(share)} in this window")
    return "<br>".join(rows)


def share_text(share: float) -> str:
    """A share in percent: one that is not 0 is not written as 0."""
    if share == 0.0:
        return "none"
    return f"{100.0 * share:.2f} %" if share >= 5e-5 else "less than 0.01 %"


# ------------------------------------------------------------------------------------------------
# The basin pane of the workbench: zoom into the plane of starts, click a start, send the disk.


SAME_START = 0.012
"""A click so near the one before, as a part of the window, is on the same start."""
_HINT = "Click a start to see its orbit; click it again to send the disk there."
_PLANE = (
    "The basins depend on the axial forcing Γ and the restitution ε alone: phase lag, friction, "
    "loads and brake turn the disk, they do not lift it."
)
_PRECISE = "Double precision ends here: several pixels are one and the same start."

Values = Callable[[], Mapping[str, float]]


class BasinPane(TabPane):
    """Basins at the parameters in force, refined as one zooms; a click shows a start's orbit.

    `values()` gives the parameters in force by the node's names; `send_start` gets parameters of
    the node (initial state, and the motion that a reset goes back to) to be set together before
    `~/reset`; InputError and FailedError that it raises are shown. Attribute: `layout`, which
    begins to compute once a browser shows it. All methods are for the thread of its document.
    """

    def __init__(self, values: Values, send_start: Callable[[Mapping[str, Any]], None]) -> None:
        self._values, self._send = values, send_start
        self._map, self._path = MapFigure(), PathFigure()
        self._legend, self._status, self._under, self._message = (
            Div(text=text, **WIDE) for text in ("", "", "&nbsp;", _HINT)
        )
        self._button = Button(label="Send the disk there", disabled=True, width=180)
        self._views, self._orbits = LatestWork(), LatestWork()
        super().__init__(self._views, self._orbits)
        self._section: NextCollisionMap | None = None
        self._shown: View | None = None
        self._wanted: tuple[NextCollisionMap, Window] | None = None  # what was asked for last
        self._orbit: Orbit | None = None
        self._connect()
        left = column(self._map.figure, self._under, self._status, **WIDE)
        right = column(self._legend, self._path.figure, self._message, self._button,
                       Div(text=_PLANE, **WIDE), **WIDE)  # fmt: skip
        self.layout = row(left, right, sizing_mode="stretch_width", stylesheets=[one_column()])

    def _connect(self) -> None:
        plot = self._map.figure
        self._watch(plot)
        plot.on_event(Tap, self._on_tap)
        plot.on_event(MouseMove, self._on_move)
        self._button.on_click(self._send_start)

    @property
    def start(self) -> Start | None:
        """The start whose orbit is shown."""
        return None if self._orbit is None else self._orbit.start

    def _ask(self) -> None:
        """Have the window in view computed at the parameters in force."""
        try:
            section = section_of(self._values())
        except InputError as error:
            self._refuse(error)
            return
        if self._section is None or section != self._section:
            self._change_section(section)
        window = self._map.window
        self._map.set_ticks(window)
        if self._orbit is not None:
            self._map.show_orbit(self._orbit)
        if _is_open(window) and (section, window) != self._wanted:
            self._wanted = section, window
            self._views.ask(lambda is_obsolete: self._compute(section, window, is_obsolete))

    def _change_section(self, section: NextCollisionMap) -> None:
        first = self._section is None
        self._section, self._shown = section, None
        self._map.figure.title.text = (
            f"axial forcing Γ = {number_text(section.axial_forcing, 6)}, "
            f"restitution ε = {number_text(section.restitution, 6)}"
        )
        self._status.text = "Looking for the attractors."
        self._forget_orbit()
        if first:  # what is compiled is loaded now, so that the first click is as fast as others
            self._orbits.ask(lambda _: _load())

    def _refuse(self, error: Exception) -> None:
        """Say in one line why there is no map."""
        self._section = self._shown = self._wanted = None
        self._forget_orbit()
        self._map.hide()
        self._legend.text = ""
        self._status.text = _line(f"No basins here: {error}")

    def _compute(self, section: NextCollisionMap, window: Window, is_obsolete: IsObsolete) -> None:
        """In the thread of the views."""
        try:
            self._refine(
                (COARSE, FULL), lambda side: view(section, window, side, is_obsolete),
                partial(self._show, section),
            )  # fmt: skip
        except InputError as error:
            self._deliver(partial(self._refuse, error))

    def _show(self, section: NextCollisionMap, found: View, spent: float) -> None:
        if section != self._section:
            return  # of parameters that are no longer in force
        before = self._shown
        if before and before.window == found.window and len(before.labels) > len(found.labels):
            return
        self._shown = found
        self._map.show(found)
        self._legend.text = legend(found)
        side = len(found.labels)
        text = f"{side} × {side} starts in {spent:.2f} s"
        if side < FULL:
            text += ", being refined"
        if not found.distinct:
            text += f". {_PRECISE}"
        self._status.text = _line(f"{_described(found.window)}; {text}")

    def _on_move(self, event: MouseMove) -> None:
        """Say which start is under the pointer, and where it goes."""
        text = " "
        if (shown := self._shown) is not None and _holds(shown.window, event.x, event.y):
            w, side = shown.window, len(shown.labels)
            row, column = place_of(*w[2:], side, event.y), place_of(*w[:2], side, event.x)
            label = int(shown.labels[row, column])
            name = shown.names[label] if label >= 0 else "unresolved"
            phase = placed(event.x, 0.5 * (w.phase_end - w.phase_begin))
            velocity = placed(event.y, 0.5 * (w.velocity_end - w.velocity_begin))
            text = f"τ = {phase} rad, w_A = {velocity} πg/ω: {name}"
        self._under.text = _line(text)

    def _on_tap(self, event: Tap) -> None:
        """Show the orbit of a start, or send the disk there if it is shown."""
        window = self._map.window
        if self._section is None or not _holds(window, event.x, event.y):
            return
        phase, velocity = pixel_centre(window, FULL, event.x, event.y)
        if self._orbit is not None and _is_near(self._orbit.start, window, phase, velocity):
            self._send_start()
            return
        values, section = dict(self._values()), self._section
        self._orbits.ask(lambda _: self._follow(values, section, phase, velocity))

    def _follow(
        self, values: Mapping[str, float], section: NextCollisionMap, phase: float, velocity: float
    ) -> None:
        """In the thread of the orbits."""
        try:
            orbit = orbit_of(values, start_at(values, phase, velocity))
            name = label_of(section, *orbit.start[:2])
        except (InputError, FailedError) as error:
            text = _line(str(error))
            self._deliver(lambda: self._message.update(text=text))
            return
        self._deliver(lambda: self._show_orbit(section, orbit, name))

    def _show_orbit(self, section: NextCollisionMap, orbit: Orbit, name: str) -> None:
        if section != self._section:
            return
        self._orbit = orbit
        self._map.show_orbit(orbit)
        self._path.show(orbit)
        start = orbit.start
        self._message.text = _line(
            f"From τ = {start.forcing_phase!r} rad, w_A = {start.velocity!r} πg/ω it goes to: "
            f"{name}. Click it again to send the disk there."
        )
        self._button.disabled = False

    def _forget_orbit(self) -> None:
        self._orbit = None
        self._map.show_orbit(None)
        self._path.show(None)
        self._message.text = _HINT
        self._button.disabled = True

    def _send_start(self) -> None:
        if self._orbit is None:
            return
        start = self._orbit.start
        try:
            self._send(dict(start.parameters))
        except (InputError, FailedError) as error:
            self._message.text = _line(str(error))
            return
        self._message.text = _line(
            f"Sent to τ = {start.forcing_phase!r} rad, w_A = {start.velocity!r} πg/ω."
        )


def _load() -> None:
    """Load the kernels with the defaults: the values in force may have no orbit from there."""
    values = {name: value for name, value in DEFAULTS.items() if isinstance(value, float)}
    orbit_of(values, start_at(values, 1.0, -1.0))


def _is_open(window: Window) -> bool:
    return window.phase_begin < window.phase_end and window.velocity_begin < window.velocity_end


def _holds(window: Window, phase: float, velocity: float) -> bool:
    return (
        window.phase_begin <= phase <= window.phase_end
        and window.velocity_begin <= velocity <= window.velocity_end
    )


def _is_near(start: Start, window: Window, phase: float, velocity: float) -> bool:
    apart = abs(math.remainder(phase - start.forcing_phase, math.tau))
    across = apart / (window.phase_end - window.phase_begin)
    up = abs(velocity - start.velocity) / (window.velocity_end - window.velocity_begin)
    return max(across, up) <= SAME_START


def _described(window: Window) -> str:
    """Where a window lies: its centre, and how far it goes to each side."""
    parts = []
    for name, begin, end, unit in (("τ", *window[:2], "rad"), ("w_A", *window[2:], "πg/ω")):
        half = 0.5 * (end - begin)
        parts.append(
            f"{name} = {placed(0.5 * (begin + end), half)} ± {number_text(half, 3)} {unit}"
        )
    return ", ".join(parts)


def _line(text: str) -> str:
    """A line for a Div, which takes HTML."""
    return html.escape(text) if text.strip() else "&nbsp;"

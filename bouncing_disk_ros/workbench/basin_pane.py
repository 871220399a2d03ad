"""The basin pane of the workbench: zoom into the plane of starts, click a start, send the disk."""

from __future__ import annotations

import html
import math
import time
from collections.abc import Callable, Mapping
from typing import Any

from bokeh.events import MouseMove, Tap
from bokeh.layouts import column, row
from bokeh.models import Button, Div

from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.workbench.basin_figures import WIDE, MapFigure, PathFigure, legend
from bouncing_disk_ros.workbench.basin_view import COARSE, FULL, label_of, view
from bouncing_disk_ros.workbench.computed_pane import ComputedPane, IsObsolete, LatestWork
from bouncing_disk_ros.workbench.start_orbit import Orbit, Start, orbit_of, start_at
from bouncing_disk_ros.workbench.start_plane import Section, View, Window, pixel_centre, section_of

SAME_START = 0.012
"""A click so near the one before, as a part of the window, is on the same start."""
_HINT = "Click a start to see its orbit; click it again to send the disk there."
_PLANE = (
    "The basins depend on Γ and ε alone: phase lag, friction, loads and brake turn the disk, they "
    "do not lift it."
)
_PRECISE = "Double precision ends here: several pixels are one and the same start."

Values = Callable[[], Mapping[str, float]]


class BasinPane(ComputedPane):
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
        self._section: Section | None = None
        self._shown: View | None = None
        self._wanted: tuple[Section, Window] | None = None  # what was asked for last
        self._orbit: Orbit | None = None
        self._connect()
        left = column(self._map.figure, self._under, self._status, **WIDE)
        right = column(self._legend, self._path.figure, self._message, self._button,
                       Div(text=_PLANE, **WIDE), **WIDE)  # fmt: skip
        self.layout = row(left, right, sizing_mode="stretch_width")

    def _connect(self) -> None:
        plot = self._map.figure
        self._watch(plot)
        plot.on_event(Tap, self._on_tap)
        plot.on_event(MouseMove, self._on_move)
        self._button.on_click(self._send_start)

    @property
    def plot(self) -> Any:
        """The Bokeh figure of the map, whose ranges are the window."""
        return self._map.figure

    @property
    def start(self) -> Start | None:
        """The start whose orbit is shown."""
        return None if self._orbit is None else self._orbit.start

    def _ask(self) -> None:
        """Have the window in view computed at the parameters in force."""
        values = dict(self._values())
        try:
            section = section_of(values)
        except InputError as error:
            self._refuse(error)
            return
        if self._section is None or section != self._section:
            self._change_section(section, values)
        window = self._map.window
        self._map.set_ticks(window)
        if self._orbit is not None:
            self._map.show_orbit(self._orbit)
        if _is_open(window) and (section, window) != self._wanted:
            self._wanted = section, window
            self._views.ask(lambda is_obsolete: self._compute(section, window, is_obsolete))

    def _change_section(self, section: Section, values: Mapping[str, float]) -> None:
        first = self._section is None
        self._section, self._shown = section, None
        self._map.figure.title.text = (
            f"Basins of attraction at axial forcing Γ = {section.axial_forcing:.6g}, "
            f"restitution ε = {section.restitution:g}"
        )
        self._status.text = "Looking for the attractors."
        self._forget_orbit()
        if first:  # what is compiled is loaded now, so that the first click is as fast as others
            self._orbits.ask(lambda _: _load(values))

    def _refuse(self, error: Exception) -> None:
        """Say in one line why there is no map."""
        self._section = self._shown = self._wanted = None
        self._forget_orbit()
        self._map.hide()
        self._legend.text = ""
        self._status.text = _line(f"No basins here: {error}")

    def _compute(self, section: Section, window: Window, is_obsolete: IsObsolete) -> None:
        """In the thread of the views: a coarse view first."""
        at = section.axial_forcing, section.restitution
        begin = time.perf_counter()
        for side in (COARSE, FULL):
            try:
                found = view(*at, window, side, is_obsolete)
            except InputError as error:
                self._deliver(lambda error=error: self._refuse(error))  # type: ignore[misc]
                return
            if found is None:
                return
            spent = time.perf_counter() - begin
            self._deliver(
                lambda found=found, spent=spent: self._show(section, found, spent)  # type: ignore[misc]
            )

    def _show(self, section: Section, found: View, spent: float) -> None:
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
            side = len(shown.labels)
            w = shown.window
            across = min(int((event.x - w.phase_begin) / (w.phase_end - w.phase_begin) * side),
                         side - 1)  # fmt: skip
            up = min(int((event.y - w.velocity_begin) / (w.velocity_end - w.velocity_begin)
                         * side), side - 1)  # fmt: skip
            label = int(shown.labels[up, across])
            name = shown.names[label] if label >= 0 else "unresolved"
            text = f"τ = {event.x:.6g} rad, w_A = {event.y:.6g} πg/ω: {name}"
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
        self, values: Mapping[str, float], section: Section, phase: float, velocity: float
    ) -> None:
        """In the thread of the orbits."""
        try:
            orbit = orbit_of(values, start_at(values, phase, velocity))
            name = label_of(section.axial_forcing, section.restitution, *orbit.start[:2])
        except (InputError, FailedError) as error:
            text = _line(str(error))
            self._deliver(lambda: self._message.update(text=text))
            return
        self._deliver(lambda: self._show_orbit(section, orbit, name))

    def _show_orbit(self, section: Section, orbit: Orbit, name: str) -> None:
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


def _load(values: Mapping[str, float]) -> None:
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
        digits = max(3, 3 - math.floor(math.log10(half)))
        parts.append(f"{name} = {0.5 * (begin + end):.{digits}f} ± {half:.3g} {unit}")
    return ", ".join(parts)


def _line(text: str) -> str:
    """A line for a Div, which takes HTML."""
    return html.escape(text) if text.strip() else "&nbsp;"

"""The bifurcation diagram in the page: what is in view, and the pane."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from bokeh.events import Tap
from bokeh.layouts import column
from bokeh.models import (
    BoxAnnotation,
    ColumnDataSource,
    Div,
    FixedTicker,
    LinearColorMapper,
    Range1d,
    Slider,
    Span,
)
from bokeh.plotting import figure
from matplotlib.colors import Colormap, to_hex
from numpy.typing import NDArray

from bouncing_disk_ros.colours import BLACK, GREEN, REST_AREA
from bouncing_disk_ros.errors import FailedError, InputError
from bouncing_disk_ros.maps.attractors import Attractor, numbered
from bouncing_disk_ros.maps.basin_measures import centres
from bouncing_disk_ros.maps.bifurcation_diagram import Branch, from_starts
from bouncing_disk_ros.maps.next_collision import NextCollisionMap, spread_starts
from bouncing_disk_ros.parameters import AXIAL_FORCING, TABLE, amplitude_of
from bouncing_disk_ros.study.bifurcation.options import DEFINITION as BIFURCATION
from bouncing_disk_ros.study.bifurcation.picture import CONTACT_INK, INK, density
from bouncing_disk_ros.units import in_pi, number_text, with_prefix
from bouncing_disk_ros.workbench.basin_pane import attractors_of
from bouncing_disk_ros.workbench.latest_work import IsObsolete, LatestWork
from bouncing_disk_ros.workbench.start_plane import described, section_of
from bouncing_disk_ros.workbench.tab import TabPane, placed

COARSE, FULL = 160, 800
"""Values of Γ in a view: what is shown at first, and in the end."""
STARTS, SETTLING, KEPT = 16, 500, 128
"""Starts at each value, impacts of each that are left out, and shown."""
ROWS = 320
"""Cells of τ, fewer than a picture has pixels: else some would be lost."""
BEGIN, END = 0.3, 0.7
LEAST, MOST = 1e-3, 1e3
"""Range of Γ that can be shown."""
_TOGETHER = 80
"""Values computed between two questions whether it is still wanted: some 50 ms."""
_REMEMBERED = 12
"""Pieces of diagrams of _TOGETHER values that are kept, about a fine view: 1.3 MB each."""

Image = NDArray[np.float32]


class Diagram(NamedTuple):
    """Impacts on the attractors at n values of Γ, spread evenly from begin to end."""

    restitution: float
    begin: float
    end: float
    branches: tuple[Branch, ...]  # one after the other, rising Γ

    @property
    def columns(self) -> int:
        """Values of Γ, n."""
        return sum(len(branch.values) for branch in self.branches)


def diagram(
    restitution: float,
    begin: float,
    end: float,
    count: int,
    is_obsolete: Callable[[], bool] = lambda: False,
) -> Diagram | None:
    """The attractors that spread starts reach at `count` values; None if obsolete meanwhile.

    The values are the centres of `count` columns from begin to end. Raises InputError.
    """
    values = centres(begin, end, count)
    branches = []
    for first in range(0, count, _TOGETHER):
        if is_obsolete():
            return None
        branches.append(_branch(restitution, tuple(values[first : first + _TOGETHER].tolist())))
    return Diagram(restitution, begin, end, tuple(branches))


@lru_cache(maxsize=_REMEMBERED)
def _branch(restitution: float, values: tuple[float, ...]) -> Branch:
    """What `images` needs, kept for another look at it and for other sessions."""
    section = NextCollisionMap(values[0], restitution)
    starts = spread_starts(STARTS, float(BIFURCATION.options["velocity_begin"].default))
    counts = {"settling": SETTLING, "measured": KEPT, "kept": KEPT}
    found = from_starts(section, "axial_forcing", np.array(values), starts, **counts)
    nothing = np.empty(0)
    return found._replace(
        axial_impact_velocity=nothing, angular_velocity=nothing, ends=nothing,
        contact=np.empty(0, bool),
    )  # fmt: skip


def images(shown: Diagram, low: float, high: float) -> tuple[Image, Image]:
    """Shares (ROWS, n) of the impacts of each column in cells of τ from low to high, as log10.

    The first of starts that stay without contact, the second of those with; nan: none is there.
    """
    found: list[list[NDArray[np.float64]]] = [[], []]
    for branch in shown.branches:
        contact = (branch.contacts > 0.0)[..., None]
        for parts, mine in zip(found, (~contact, contact), strict=True):
            phases = np.where(mine, branch.forcing_phase, math.nan)
            parts.append(density(branch._replace(forcing_phase=phases), low, high, ROWS))
    with np.errstate(divide="ignore"):
        first, second = (np.log10(np.concatenate(parts, axis=1)) for parts in found)
    first[np.isinf(first)] = second[np.isinf(second)] = math.nan
    return first.astype(np.float32), second.astype(np.float32)


# ------------------------------------------------------------------------------------------------
# The bifurcation pane of the workbench: the diagram over Γ with a cursor that the run follows.


REST_FORCING = 1.0 / math.pi
"""Up to this Γ the disk comes to rest on the platform."""
SEND_MS = 100
"""The run is sent at most one value in so many milliseconds."""
_WIDE: dict[str, Any] = {"sizing_mode": "stretch_width", "min_width": 300, "max_width": 1200}
_SHADES = 64
_ABOUT = (
    "Phases of the impacts on all attractors that were found, darker where they are denser; "
    "<b style='border-bottom:3px solid #0072B2'>blue</b>: without contact, "
    "<b style='border-bottom:3px solid #D55E00'>orange</b>: with contact. They depend on the axial "
    "forcing Γ and the restitution ε alone. "
    "Click, or drag the green cursor: the platform of the run is set to its Γ. "
    "The dashed line is Γ of the run."
)

Values = Callable[[], Mapping[str, float]]
Drawn = tuple[Diagram, tuple[Image, Image]]


class BifurcationPane(TabPane):
    """The diagram at the restitution in force; a cursor sets the axial amplitude of the run.

    `values()` gives the parameters in force by the node's names; `set_values` gets the axial
    amplitude to set, while the cursor moves at most once in SEND_MS; InputError and FailedError
    that it raises are shown. Attribute: `layout`, which begins to compute once a browser shows it.
    All methods are for the thread of its document.
    """

    def __init__(self, values: Values, set_values: Callable[[Mapping[str, Any]], None]) -> None:
        self._values, self._set = values, set_values
        self._section: NextCollisionMap | None = None
        self._shown: tuple[tuple[float, ...], int] | None = None  # what, of how many columns
        self._wanted: tuple[float, ...] | None = None  # what was asked for last
        self._diagrams, self._attractors = LatestWork(), LatestWork()
        super().__init__(self._diagrams, self._attractors)
        self._moved = self._placing = False
        self._status, self._about = Div(text="&nbsp;", **_WIDE), Div(text=_ABOUT, **_WIDE)
        self._at_cursor = Div(text="&nbsp;", **_WIDE)
        self._images = [
            ColumnDataSource(data={"image": [], "x": [], "y": [], "dw": [], "dh": []})
            for _ in range(2)
        ]
        self._figure = self._drawn()
        self._slider = Slider(
            start=BEGIN, end=END, value=BEGIN, step=1e-4, format="0.0000", **_WIDE,
            title="Γ of the cursor", html_attributes={"title": AXIAL_FORCING.spelled},
        )  # fmt: skip
        self._connect()
        self.layout = column(
            self._about, self._figure, self._slider, self._at_cursor, self._status, **_WIDE
        )

    def _drawn(self) -> figure:
        plot = figure(
            height=430, **_WIDE, tools="pan,wheel_zoom,box_zoom,reset",
            active_scroll="wheel_zoom", toolbar_location="above",
            x_range=Range1d(BEGIN, END, bounds=(LEAST, MOST), min_interval=1e-12),
            y_range=Range1d(0.0, math.tau, bounds=(0.0, math.tau), min_interval=1e-9),
            x_axis_label="axial forcing Γ", y_axis_label="forcing phase at impact τ (rad)",
        )  # fmt: skip
        plot.toolbar.logo = None
        plot.yaxis[0].update(
            ticker=FixedTicker(ticks=[0.25 * math.pi * k for k in range(9)]),
            major_label_overrides={0.25 * math.pi * k: in_pi(0.25 * k) for k in range(9)},
        )
        plot.add_layout(BoxAnnotation(right=REST_FORCING, fill_color=REST_AREA, level="image"))
        for source, ink in zip(self._images, (INK, CONTACT_INK), strict=True):
            mapper = LinearColorMapper(
                palette=_palette(ink), low=-3.0, high=0.0, nan_color="rgba(0, 0, 0, 0)"
            )
            plot.image("image", "x", "y", "dw", "dh", source=source, color_mapper=mapper)
        self._in_force = Span(dimension="height", line_color=BLACK, line_dash="dashed")
        self._cursor = Span(
            dimension="height", line_color=GREEN, line_width=3, editable=True, level="overlay"
        )
        plot.add_layout(self._in_force)
        plot.add_layout(self._cursor)
        return plot

    def _connect(self) -> None:
        self._watch(self._figure)
        self._figure.on_event(Tap, lambda event: self._move_cursor(float(event.x)))
        self._cursor.on_change("location", self._on_cursor)
        self._slider.on_change("value", self._on_cursor)

    def _on_cursor(self, _name: str, _old: object, new: float) -> None:
        if not self._placing:
            self._move_cursor(float(new))

    def _ask(self) -> None:
        """Have the range in view computed at the parameters in force."""
        try:
            section = section_of(self._values())
        except InputError as error:
            self._refuse(error)
            return
        before, self._section = self._section, section
        self._in_force.location = section.axial_forcing
        self._figure.title.text = (
            f"Bifurcation diagram at restitution ε = {number_text(section.restitution, 6)}"
        )
        if before is None:
            self._begin(section.axial_forcing)
        elif before.restitution != section.restitution:
            self._describe_cursor()
        across, up = self._figure.x_range, self._figure.y_range
        self._place_cursor(float(self._cursor.location))
        window = (across.start, across.end, up.start, up.end)
        given = section.restitution, *window
        if window[0] < window[1] and window[2] < window[3] and given != self._wanted:
            self._wanted = given
            self._diagrams.ask(lambda is_obsolete: self._compute(*given, is_obsolete))

    def _begin(self, axial_forcing: float) -> None:
        """Put the cursor at the run, within the range shown."""
        across = self._figure.x_range
        low, high = across.start, across.end
        if not self._is_placed:
            low, high = max(min(low, 0.9 * axial_forcing), LEAST), max(high, 1.1 * axial_forcing)
            across.update(start=low, end=high, reset_start=low, reset_end=high)
        self._place_cursor(min(max(axial_forcing, low), high))
        self._describe_cursor()

    def _place_cursor(self, value: float) -> None:
        """Show the cursor at a value; the slider's range is that of the figure and holds it."""
        across = self._figure.x_range
        self._placing = True  # it is not the user who moves them
        try:
            self._cursor.location = value
            self._slider.update(
                start=min(across.start, value), end=max(across.end, value), value=value,
                step=max((across.end - across.start) / 2000.0, 1e-12),
            )  # fmt: skip
        finally:
            self._placing = False

    def _refuse(self, error: Exception) -> None:
        self._section = self._shown = self._wanted = None
        for source in self._images:
            source.data = {name: [] for name in source.data}
        self._status.text = html.escape(f"No diagram here: {error}")

    def _compute(
        self, restitution: float, begin: float, end: float, low: float, high: float,
        is_obsolete: IsObsolete,
    ) -> None:  # fmt: skip
        """In the thread of the diagrams."""

        def drawn(count: int) -> Drawn | None:
            found = diagram(restitution, begin, end, count, is_obsolete)
            return None if found is None else (found, images(found, low, high))

        self._refine((COARSE, FULL), drawn, partial(self._show, (low, high)))

    def _show(self, phases: tuple[float, float], drawn: Drawn, spent: float) -> None:
        found, both = drawn
        if self._section is None or found.restitution != self._section.restitution:
            return  # of parameters that are no longer in force
        place, before = (*found[:3], *phases), self._shown
        if before and before[0] == place and before[1] > found.columns:
            return
        self._shown = place, found.columns
        low, high = phases
        for source, image in zip(self._images, both, strict=True):
            source.data = {
                "image": [image], "x": [found.begin], "y": [low], "dw": [found.end - found.begin],
                "dh": [high - low],
            }  # fmt: skip
        refined = "" if found.columns == FULL else ", being refined"
        self._status.text = (
            f"{found.columns} values of Γ, {STARTS} starts at each, {KEPT} impacts of each, in "
            f"{spent:.2f} s{refined}"
        )

    def _move_cursor(self, axial_forcing: float) -> None:
        """The cursor was put somewhere: move all that shows it, and send it to the run soon."""
        if self._section is None:
            return
        self._place_cursor(min(max(axial_forcing, LEAST), MOST))
        document = self.layout.document
        if document is not None and not self._moved:
            self._moved = True
            document.add_timeout_callback(self._send_cursor, SEND_MS)

    def _send_cursor(self) -> None:
        self._moved = False
        if self._section is None:
            return
        self._describe_cursor()
        try:
            amplitude = amplitude_of(self._cursor.location, self._values())
            self._set({"axial_amplitude": TABLE["axial_amplitude"].checked(amplitude)})
        except (InputError, FailedError) as error:
            self._at_cursor.text = html.escape(str(error))

    def _describe_cursor(self) -> None:
        """Say where the cursor is; what is there is found in a thread."""
        if self._section is None:
            return
        forcing, restitution = float(self._cursor.location), self._section.restitution
        across = self._figure.x_range
        place = placed(forcing, 0.5 * (across.end - across.start))
        amplitude = with_prefix(amplitude_of(forcing, self._values()), "m")
        text = f"Cursor: Γ = {place}, A = {amplitude}"
        self._at_cursor.text = html.escape(text)

        def find(is_obsolete: IsObsolete) -> None:
            found = attractors_of(NextCollisionMap(forcing, restitution)).found
            if not is_obsolete():
                self._deliver(lambda: self._tell(f"{text}. There: {_listed(found)}"))

        self._attractors.ask(find)

    def _tell(self, text: str) -> None:
        self._at_cursor.text = html.escape(text)


def _listed(found: tuple[Attractor, ...]) -> str:
    names = numbered([one.name for one in found])
    return "; ".join(map(described, found, names)) or "no attractor was found"


def _palette(ink: Colormap) -> list[str]:
    return [to_hex(ink(k / (_SHADES - 1))) for k in range(_SHADES)]

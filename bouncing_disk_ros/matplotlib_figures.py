"""What matplotlib figures share: an empty figure, its file, the frame of a map, ticks and labels.

The colours are in `colours`, the texts of numbers, angles and units in `units`.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, MultipleLocator
from numpy.typing import NDArray

from bouncing_disk_ros.colours import GREY, GRID
from bouncing_disk_ros.regular_file import replaced
from bouncing_disk_ros.units import INDEXED, decimal_in_pi, in_pi, number_text, shown_unit

FEWEST_TICKS = 3
_MOST_TICKS = 9
MOST_PIXELS = 1500
"""Along one side of a drawn map, or less than twice as many."""


class NotebookFigure(Figure):
    """A figure that a notebook shows as it is, without an import of pyplot."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=100)
        return buffer.getvalue()


class Figures(dict[str, Figure]):
    """Figures by name. A notebook shows each of them where a cell ends with them."""

    def _ipython_display_(self) -> None:
        from IPython.display import display

        for figure in self.values():
            display(figure)  # type: ignore[no-untyped-call]


def new_figure(width: float, height: float, dpi: float = 100.0) -> Figure:
    """An empty figure (inches) that needs no screen; dpi: of images within a vector figure."""
    figure = NotebookFigure(figsize=(width, height), layout="constrained", dpi=dpi)
    FigureCanvasAgg(figure)
    return figure


def light_grid(axes: Axes) -> None:
    """Thin lines at the ticks, behind all that is drawn."""
    axes.grid(visible=True, color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)


def save_picture(figure: Figure, path: Path) -> None:
    """File with a figure, written to `path`; its ending decides the kind.

    A file in its place is replaced. Raises InputError, FailedError; ValueError for another ending.

    >>> save_picture(run_picture(read_run("run_1"), "run 1"), Path("run_1.pdf"))
    """
    replaced(path, lambda passing: figure.savefig(passing, dpi=110), "--figure")


def about_zero(values: NDArray[np.float64]) -> dict[str, Any]:
    """A scale of colours with 0 in its middle: arguments of imshow."""
    known = np.isfinite(values)
    top = (float(np.abs(values[known]).max()) if known.any() else 0.0) or 1.0
    return {"vmin": -top, "vmax": top}


def cell_ends(values: NDArray[np.float64]) -> tuple[float, float]:
    """Where the cells begin and end whose centres are these evenly spaced values.

    The cell of a single value is narrow, so that it does not seem to be a range.
    """
    first, last = float(values[0]), float(values[-1])
    half = 0.5 * (last - first) / (len(values) - 1) if len(values) > 1 else 0.05 * abs(first) or 0.5
    return first - half, last + half


def edges_of(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Borders (n + 1,) of the cells about rising values (n,)."""
    if len(values) == 1:
        return np.array(cell_ends(values))
    middles = 0.5 * (values[1:] + values[:-1])
    first, last = 2.0 * values[0] - middles[0], 2.0 * values[-1] - middles[-1]
    return np.concatenate([[first], middles, [last]])


def cut_at_zero(axes: Any, across: NDArray[np.float64], up: NDArray[np.float64]) -> None:
    """Let axes over pixels with these centres begin at 0 where only a pixel's edge is below."""
    if min(across[0], across[-1]) >= 0.0 > axes.get_xlim()[0]:
        axes.set_xlim(left=0.0)
    if min(up[0], up[-1]) >= 0.0 > axes.get_ylim()[0]:
        axes.set_ylim(bottom=0.0)


def pixel_frame(across: NDArray[np.float64], up: NDArray[np.float64]) -> dict[str, Any]:
    """How a map is drawn whose pixels have these centres: arguments of imshow."""
    return {
        "extent": [*cell_ends(across), *cell_ends(up)], "origin": "lower", "aspect": "auto",
        "interpolation": "nearest",
        "rasterized": True,
    }  # fmt: skip


def map_frame(field: Any) -> dict[str, Any]:
    """How an array of a study over two axes is drawn: arguments of imshow."""
    up, across = field.dims
    return pixel_frame(field[across].values, field[up].values)


def typeset(text: str) -> str:
    """A text as it is printed: indices of symbols below the line, and minus signs."""
    indexed = INDEXED.sub(lambda m: f"${m[1]}_{{\\mathrm{{{m[2] or m[3]}}}}}$", text)
    return _HYPHEN.sub("−", indexed)


def name_lines(axes: Any, ends: Sequence[tuple[float, float, str]]) -> None:
    """Write the names of lines beside the axes, each joined to the line's end (x, y, name).

    Names keep a line's height between them, and cover neither lines nor each other.
    """
    axes.update_datalim([(x, y) for x, y, _ in ends])
    axes.autoscale_view()
    low, high = axes.get_ylim()
    tall = axes.get_window_extent().height * 72.0 / axes.figure.dpi  # points
    least = (high - low) * 1.7 * _NAME_SIZE / tall
    names = sorted(ends, key=lambda end: end[1])
    places = [y for _, y, _ in names]
    for i in range(1, len(places)):
        places[i] = max(places[i], places[i - 1] + least)
    over = max(0.0, places[-1] - high) if places else 0.0
    for i in reversed(range(len(places))):
        top = places[i + 1] - least if i + 1 < len(places) else high if over else math.inf
        places[i] = min(places[i], top)
    for (x, y, name), place in zip(names, places, strict=True):
        axes.annotate(
            name, (x, y), xytext=(1.03, (place - low) / (high - low)), fontsize=_NAME_SIZE,
            textcoords="axes fraction", va="center", annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": GREY, "lw": 0.5, "shrinkA": 0, "shrinkB": 2},
        )  # fmt: skip


_NAME_SIZE = 8
_HYPHEN = re.compile(r"(?<![\w)])-(?=[\d.]*\d)")
"""A hyphen before a number, where it means a minus; in period-1 it does not."""


def say_instead(axes: Any, text: str) -> None:
    """Say in the middle of axes in which nothing is drawn what there is none of."""
    axes.text(
        0.5, 0.5, text, ha="center", va="center", transform=axes.transAxes, backgroundcolor="white"
    )  # fmt: skip


def mark_in_pi(axis: Any, step: float = 0.5, half_turn: float = 1.0) -> None:
    """Ticks of an axis as parts of π: in steps of that many, coarser or finer where that fits.

    `half_turn`: π in the unit of the axis; 0.5 where that is a turn.
    """
    low, high = (end / half_turn for end in sorted(axis.get_view_interval()))
    while high - low > _MOST_TICKS * step:
        step *= 2.0
    text: Callable[[float], str] = in_pi
    if math.floor(high / step) - math.ceil(low / step) < FEWEST_TICKS - 1:
        ticks = MaxNLocator(6, steps=[1, 2, 2.5, 5, 10], min_n_ticks=FEWEST_TICKS)
        step, text = float(np.diff(ticks.tick_values(low, high))[0]), decimal_in_pi
    axis.set_major_locator(MultipleLocator(step * half_turn))
    axis.set_major_formatter(FuncFormatter(lambda value, _: text(value / half_turn)))


def name_axis(axis: Any, about: Mapping[str, Any], name: str = "") -> None:
    """Label an axis with the range that it has: its name, symbol, and the unit that fits it.

    `about` has long_name, symbol and units (SI). Ticks are in the unit: mN·m, or parts of π where
    the axis is a phase.
    """
    name = name or " ".join(filter(None, (about["long_name"], str(about.get("symbol", "")))))
    unit = "" if about["units"] == "1" else str(about["units"])
    if unit == "rad" and "phase" in name:
        mark_in_pi(axis, 0.25, math.pi)
    elif unit:
        largest = float(np.abs(axis.get_view_interval()).max())
        size, unit = shown_unit(unit, largest)
        axis.set_major_formatter(FuncFormatter(lambda value, _: number_text(value / size, 10)))
    axis.set_label_text(typeset(f"{name} ({unit})" if unit else name))

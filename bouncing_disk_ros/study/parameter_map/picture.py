"""The picture of a plane of parameters: period of the attractor, and its Lyapunov exponent."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from bouncing_disk_ros.colours import (
    BLACK,
    BLUE,
    CONTACT_AREA,
    GREEN,
    ORANGE,
    PURPLE,
    REST_AREA,
    SIGNED_SCALE,
    SKY,
    UNRESOLVED_AREA,
    VERMILION,
    YELLOW,
)
from bouncing_disk_ros.maps.basin_measures import downsample
from bouncing_disk_ros.maps.scales import MAP_PARAMETERS
from bouncing_disk_ros.matplotlib_figures import (
    MOST_PIXELS,
    about_zero,
    cut_at_zero,
    map_frame,
    name_axis,
    new_figure,
    typeset,
)
from bouncing_disk_ros.study.computation import Study

#: impacts in one repetition -> colour; the cascade 1, 2, 4, 8 goes from blue to yellow
PERIODS = {1: BLUE, 2: SKY, 4: GREEN, 8: YELLOW, 3: VERMILION, 6: ORANGE, 5: PURPLE}
OTHER = "#8c510a"
_CLASSES = ["rest", "with contact", *(f"period {n}" for n in PERIODS), "other period", "chaotic",
            "unresolved"]  # fmt: skip
_COLOURS = [REST_AREA, CONTACT_AREA, *PERIODS.values(), OTHER, BLACK, UNRESOLVED_AREA]
_QUANTILE = 0.99
"""So many of the exponents lie within the colour scale."""


def parameter_map_picture(result: xr.Dataset) -> Figure:
    """Figure of period and Lyapunov exponent over two parameters, with the fixed values.

    >>> parameter_map_picture(parameter_map(x_count=12, y_count=8))
    """
    figure = new_figure(12.0, 6.0)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    draw_periods(left, result)
    _draw_exponents(figure, right, result)
    _label_axes(result, left, right)
    figure.suptitle(_title(result), fontsize=12)
    return figure


def mean_speed_picture(result: xr.Dataset) -> Figure:
    """Figure of the mean speed of the disk over two parameters.

    >>> mean_speed_picture(parameter_map(x_count=12, y_count=8))
    """
    figure = new_figure(7.5, 6.0)
    axes = figure.subplots()
    speed = downsample(result["mean_speed"], MOST_PIXELS)
    known = np.isfinite(speed)
    rest = downsample(result["kind"], MOST_PIXELS) == _CLASSES.index("rest")
    frame = map_frame(result["period"])
    ground = ListedColormap([UNRESOLVED_AREA, REST_AREA])
    axes.imshow(np.where(rest, 1.0, 0.0), cmap=ground, vmin=0.0, vmax=1.0, **frame)
    shown = np.ma.masked_where(~known, speed)
    drawn = axes.imshow(shown, cmap=SIGNED_SCALE, **about_zero(speed), **frame)
    figure.colorbar(drawn, ax=axes, label="mean speed α̇ / (ωΦ)")
    _legend_of_areas(
        axes,
        (REST_AREA, "rest", (rest & ~known).any()),
        (UNRESOLVED_AREA, "not known", not (rest | known).all()),
    )
    axes.set_title("Mean speed of the disk", fontsize=10)
    _label_axes(result, axes)
    figure.suptitle(_title(result), fontsize=11)
    return figure


def _label_axes(result: xr.Dataset, *panels: Any) -> None:
    up, across = result["period"].dims
    for axes in panels:
        cut_at_zero(axes, result[across].values, result[up].values)
        name_axis(axes.xaxis, result[across].attrs)
    name_axis(panels[0].yaxis, result[up].attrs)


def classes(kind: NDArray[np.int32], period: NDArray[np.int32]) -> NDArray[np.intp]:
    """Index of each point in the classes of the left panel; numbers of the study's field `kind`."""
    names = {name: i for i, name in enumerate(_CLASSES)}
    found = np.full(kind.shape, names["unresolved"], np.intp)
    for number, name in enumerate(("rest", "with contact", "other period", "chaotic")):
        found[kind == number] = names[name]
    for n in PERIODS:
        found[(kind == 2) & (period == n)] = names[f"period {n}"]
    return found


def draw_periods(axes: Any, result: xr.Dataset) -> None:
    """Kinds and periods as colours, with a legend beneath."""
    found = classes(*(downsample(result[name], MOST_PIXELS) for name in ("kind", "period")))
    norm = BoundaryNorm(np.arange(-0.5, len(_CLASSES)), len(_CLASSES))
    axes.imshow(found, cmap=ListedColormap(_COLOURS), norm=norm, **map_frame(result["period"]))
    shown = np.unique(found)
    handles = [
        Patch(facecolor=_COLOURS[i], edgecolor=BLACK, linewidth=0.5, label=_CLASSES[i])
        for i in shown
    ]
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=4,
                fontsize=9, frameon=False)  # fmt: skip
    axes.set_title("Period: impacts in one repetition", fontsize=10)


def _draw_exponents(figure: Figure, axes: Any, result: xr.Dataset) -> None:
    exponent = downsample(result["lyapunov_exponent"], MOST_PIXELS)
    finite = np.isfinite(exponent)
    top = float(np.quantile(np.abs(exponent[finite]), _QUANTILE)) if finite.any() else 1.0
    ground = np.where(np.isneginf(exponent), 1.0, 0.0)
    frame = map_frame(result["period"])
    axes.imshow(ground, cmap=ListedColormap([REST_AREA, CONTACT_AREA]), vmin=0.0, vmax=1.0, **frame)
    shown = np.ma.masked_where(~finite, exponent)
    drawn = axes.imshow(shown, cmap=SIGNED_SCALE, vmin=-(top or 1.0), vmax=top or 1.0, **frame)
    figure.colorbar(drawn, ax=axes, label="Lyapunov exponent λ per impact", extend="both")
    _legend_of_areas(
        axes,
        (CONTACT_AREA, "with contact: −∞", np.isneginf(exponent).any()),
        (REST_AREA, "rest", np.isnan(exponent).any()),
    )
    axes.set_title("Small changes die out (blue) or grow (red)", fontsize=10)


def _legend_of_areas(axes: Any, *areas: tuple[str, str, Any]) -> None:
    """What areas without a value are, beneath: colour, name, and whether the map has it."""
    handles = [
        Patch(facecolor=color, edgecolor=BLACK, linewidth=0.5, label=name)
        for color, name, there in areas
        if there
    ]
    if handles:
        axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2,
                    fontsize=9, frameon=False)  # fmt: skip


def _title(result: xr.Dataset) -> str:
    given = {name.removeprefix("parameter_"): value for name, value in result.attrs.items()}
    start = given["start"]
    if start == "given":
        phase, velocity = (_number(given[f"initial_{name}"]) for name in ("phase", "velocity"))
        start = f"τ = {phase}, w_A = {velocity}"
    elif start == "period-1":
        start = "a start beside the period-1 orbit"
    else:
        start = "contact"
    fixed = [
        f"{of.symbol} = {_number(given[name])}"
        for name, of in MAP_PARAMETERS.items()
        if name in given
    ]
    if given["start"] == "period-1":
        fixed[0] = f"where there is none, from contact; {fixed[0]}"
    return typeset(f"What the disk settles on from {start}\n{', '.join(fixed)}")


def _number(value: float) -> str:
    return f"{value:g}".replace("-", "−")


def pictures(_: Study, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    return {
        "parameter_map": parameter_map_picture(result),
        "mean_speed": mean_speed_picture(result),
    }

"""The picture of a motor over two of its parameters: speed, efficiency, power, kind of motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from bouncing_disk_ros.analysis.dynamics.row_blocks import downsample
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.parameters import TABLE
from bouncing_disk_ros.plots.style import (
    BLACK,
    BLUE,
    MOST_PIXELS,
    ORANGE,
    SKY,
    UNRESOLVED,
    VERMILION,
    new_figure,
    pixel_frame,
)

KIND_COLORS: Mapping[int, str] = {
    -1: UNRESOLVED, 0: BLUE, 1: ORANGE, 2: "#d9d9d9", 3: BLACK, 4: VERMILION, 5: SKY,
}  # fmt: skip
"""Numbers of the study's field `kind` -> colour."""
_IN_ORDER = sorted(KIND_COLORS)


def motor_map_picture(result: xr.Dataset) -> Figure:
    """Four panels over the two parameters, and what is fixed."""
    figure = new_figure(11.5, 9.0)
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    speed = downsample(result["mean_speed"], MOST_PIXELS)
    known = np.isfinite(speed)
    top = (float(np.abs(speed[known]).max()) if known.any() else 0.0) or 1.0
    scale = {"cmap": "RdBu_r", "vmin": -top, "vmax": top}
    _draw(figure, panels[0, 0], result, "mean_speed", scale)
    _draw(figure, panels[0, 1], result, "efficiency", {"cmap": "viridis", "vmin": 0.0})
    _draw(figure, panels[1, 0], result, "output_power", {"cmap": "PuOr_r", **_around(result)})
    _draw_kinds(panels[1, 1], result)
    up, across = result["kind"].dims
    for axes in panels[1]:
        axes.set_xlabel(axis_label(result[across]))
    for axes in panels[:, 0]:
        axes.set_ylabel(axis_label(result[up]))
    figure.suptitle(fixed_text(result), fontsize=10)
    return figure


def _around(result: xr.Dataset) -> dict[str, float]:
    power = result["output_power"].values
    known = np.isfinite(power)
    top = (float(np.abs(power[known]).max()) if known.any() else 0.0) or 1.0
    return {"vmin": -top, "vmax": top}


def _draw(
    figure: Figure, axes: Any, result: xr.Dataset, field: str, scale: Mapping[str, Any]
) -> None:
    values = downsample(result[field], MOST_PIXELS)
    about = result[field].attrs
    axes.set_facecolor("#e8e8e8")
    shown = np.ma.masked_invalid(values)
    drawn = axes.imshow(shown, **scale, **_frame(result))
    figure.colorbar(drawn, ax=axes, label=f"{about['units']}; grey: none")
    axes.set_title(about["long_name"], fontsize=10)


def _draw_kinds(axes: Any, result: xr.Dataset) -> None:
    found = downsample(result["kind"], MOST_PIXELS)
    edges = [number - 0.5 for number in _IN_ORDER] + [_IN_ORDER[-1] + 0.5]
    colors = ListedColormap([KIND_COLORS[number] for number in _IN_ORDER])
    axes.imshow(found, cmap=colors, norm=BoundaryNorm(edges, len(_IN_ORDER)), **_frame(result))
    names = kinds_of(result)
    handles = [
        Patch(facecolor=KIND_COLORS[number], edgecolor=BLACK, linewidth=0.5, label=names[number])
        for number in sorted({int(number) for number in np.unique(found)})
    ]
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3,
                fontsize=8, frameon=False)  # fmt: skip
    axes.set_title("kind of motion", fontsize=10)


def kinds_of(result: xr.Dataset) -> dict[int, str]:
    """Number of a kind of motion -> its name."""
    about = result["kind"].attrs
    numbers = np.atleast_1d(about["flag_values"])
    names = str(about["flag_meanings"]).split()
    return {int(n): name.replace("_", " ") for n, name in zip(numbers, names, strict=True)}


def _frame(result: xr.Dataset) -> dict[str, Any]:
    """How a map is drawn: arguments of imshow."""
    up, across = result["kind"].dims
    return pixel_frame(result[across].values, result[up].values)


def axis_label(axis: xr.DataArray) -> str:
    """Name, symbol and unit of an axis."""
    about = axis.attrs
    return f"{about['long_name']} {about['symbol']} ({about['units']})"


def fixed_text(result: xr.Dataset) -> str:
    """What is fixed, in two lines."""
    given = {name.removeprefix("parameter_"): value for name, value in result.attrs.items()}
    parts = []
    for name in (*Motion._fields, *Disk._fields):
        if name in given and (given[name] != 0.0 or name == "phase_lag"):
            unit = f" {TABLE[name].shown_unit}".rstrip()
            symbol = TABLE[name].symbol.split(" ")[0]
            parts.append(f"{symbol} = {given[name]:.4g}{unit}".replace("-", "−"))
    half = (len(parts) + 1) // 2
    return f"{', '.join(parts[:half])}\n{', '.join(parts[half:])}; start: {given['start']}"

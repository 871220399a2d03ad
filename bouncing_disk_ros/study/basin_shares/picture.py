"""The picture of shares of basins over a parameter, with best phase lag and speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from bouncing_disk_ros.colours import INK
from bouncing_disk_ros.matplotlib_figures import light_grid, name_axis, new_figure, typeset
from bouncing_disk_ros.study.computation import Study
from bouncing_disk_ros.study.line_picture import draw_shares, line_colours, line_legend


def basin_shares_picture(result: xr.Dataset) -> Figure:
    """Figure of the shares of basins as lines, with the best phase lag and its mean speed below.

    >>> basin_shares_picture(basin_shares(begin=0.4, end=0.5, count=3, samples=24))
    """
    figure = new_figure(8.0, 8.2)
    top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=[2.0, 1.0, 1.0])
    x = result["value"].values
    _draw_lines(figure, top, result)
    largest = "the largest attractor that is neither rest nor chattering"
    middle.set_title(f"fastest rotation on {largest}", fontsize=9)
    middle.plot(x, result["best_phase_lag"].values, ".", ms=4, color=INK)
    name_axis(middle.yaxis, {"units": "rad"}, "best phase lag\nθ")
    bottom.plot(x, result["best_speed"].values, ".", ms=4, color=INK)
    bottom.set_ylabel("mean speed there\n($\\omega\\Phi$)")
    for axes in (middle, bottom):
        light_grid(axes)
    figure.suptitle(_title(result), fontsize=11)
    if len(np.unique(x)) > 1:
        bottom.set_xlim(x.min(), x.max())
    name_axis(bottom.xaxis, result["value"].attrs)
    return figure


def _draw_lines(figure: Figure, axes: Any, result: xr.Dataset) -> None:
    """One line for each attractor, and one for the starts that come to contact."""
    colors = line_colours(result)
    draw_shares(axes, result, result["value"].values, colors)
    line_legend(figure, result, colors)
    light_grid(axes)


def _title(result: xr.Dataset) -> str:
    """What is the same for all values."""
    given = {
        "axial_forcing": "axial forcing Γ",
        "restitution": "restitution ε",
        "angular_forcing": "angular forcing Γ_T",
    }
    fixed = [
        f"{text} = {result.attrs[f'parameter_{name}']:g}"
        for name, text in given.items()
        if name != result.attrs["parameter_along"]
    ]
    return typeset(f"Shares of the basins at {', '.join(fixed)}")


def pictures(_: Study, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    return {"basin_shares": basin_shares_picture(result)}

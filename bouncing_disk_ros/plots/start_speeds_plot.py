"""The picture of the mean speeds that starts end with, a panel for each initial speed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from bouncing_disk_ros.analysis.dynamics.row_blocks import downsample
from bouncing_disk_ros.plots.basin_plot import (
    frame,
    label_axes,
    title_of,
)
from bouncing_disk_ros.plots.style import MOST_PIXELS, UNRESOLVED, new_figure, typeset

COLUMNS = 3


def start_speeds_picture(result: xr.Dataset) -> Figure:
    """Figure of the mean speed over the starts of a result of the study `basins`."""
    speeds = [downsample(one, MOST_PIXELS) for one in result["mean_speed"]]
    columns = min(COLUMNS, len(speeds))
    rows = math.ceil(len(speeds) / columns)
    figure = new_figure(1.6 + 4.6 * columns, 1.2 + 3.6 * rows)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    top = max(float(np.nanmax(np.abs(one), initial=1e-12)) for one in speeds)
    drawn: Any = None
    for place, axes in enumerate(panels.flat):
        if place >= len(speeds):
            axes.set_visible(False)
            continue
        axes.set_facecolor(UNRESOLVED)
        drawn = axes.imshow(speeds[place], cmap="RdBu_r", vmin=-top, vmax=top, **frame(result))
        before = float(result["angular_velocity"].values[place])
        axes.set_title(rf"from $\dot\alpha$ = {before:g} $\omega\Phi$".replace("-", "−"))
        label_axes(axes, result)
        if place % columns:
            axes.set_ylabel("")
        if place + columns < len(speeds):
            axes.set_xlabel("")
    figure.colorbar(drawn, ax=panels, label=r"mean speed at the end ($\omega\Phi$); grey: rest")
    lag, angular = (result.attrs[f"parameter_{name}"] for name in ("phase_lag", "angular_forcing"))
    title = f"{title_of(result)},\nphase lag θ = {lag:g} rad, Γ_T = {angular:g}"
    figure.suptitle(typeset(title.replace("-", "−")), fontsize=12)
    return figure

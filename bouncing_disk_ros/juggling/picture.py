"""Pictures of closed loops: which starts are captured, and how often, by strategy and condition."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from bouncing_disk_ros.colours import BLACK, REST_AREA, UNRESOLVED_AREA, VALUES_SCALE, VERMILION
from bouncing_disk_ros.maps.basin_measures import downsample
from bouncing_disk_ros.maps.scales import MAP_PARAMETERS
from bouncing_disk_ros.matplotlib_figures import (
    MOST_PIXELS,
    mark_in_pi,
    new_figure,
    pixel_frame,
    typeset,
)
from bouncing_disk_ros.study.computation import Study

COLOURS = {-1: UNRESOLVED_AREA, 0: REST_AREA, 1: REST_AREA, 2: VERMILION}
"""Verdict -> colour: not computed, never, captured (drawn over by its time), lost."""
WORDS = {0: "never captured", 2: "captured, then lost"}
SOONEST, LATEST = 1.0, 50.0
"""Periods until captured, at the ends of the scale."""
ROWS = 4
"""Conditions whose maps are drawn; the table has all."""


def capture_maps(result: xr.Dataset) -> Figure:
    """Verdicts over the plane of starts: a column for each strategy, a row for each condition.

    Where a start is captured the colour says after how long.
    """
    strategies = [str(name) for name in result["strategy_name"].values]
    conditions = [str(name) for name in result["condition_name"].values][:ROWS]
    width, height = 3.1 * len(strategies) + 0.9, 2.5 * len(conditions) + 1.2
    figure = new_figure(max(width, 5.5), height)
    panels = figure.subplots(
        len(conditions), len(strategies), sharex=True, sharey=True, squeeze=False
    )
    for i, condition in enumerate(conditions):
        for j, strategy in enumerate(strategies):
            case = result.isel(strategy=j, condition=i)
            drawn = _draw(panels[i, j], case, strategy, condition)
        panels[i, 0].set_ylabel(r"$w_A$ ($\pi g/\omega$)")
    for axes in panels[-1]:
        axes.set_xlabel(r"$\tau_\mathrm{imp}$ (rad)")
        mark_in_pi(axes.xaxis)
    label = "periods until captured"
    bar = figure.colorbar(drawn, ax=panels, label=label, extend="both", aspect=30)
    bar.set_ticks([1, 2, 5, 10, 20, 50], labels=["1", "2", "5", "10", "20", "50"])
    bar.minorticks_off()
    handles = [
        Patch(facecolor=COLOURS[flag], edgecolor=BLACK, linewidth=0.5, label=text)
        for flag, text in WORDS.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False, fontsize=9)
    figure.suptitle(_title(result), fontsize=11)
    return figure


def _draw(axes: Any, case: xr.Dataset, strategy: str, condition: str) -> Any:
    """One map; what its scale of times belongs to."""
    frame = pixel_frame(case["forcing_phase"].values / math.pi, case["velocity"].values)
    verdict = downsample(case["verdict"], MOST_PIXELS)
    axes.imshow(
        verdict,
        cmap=ListedColormap(list(COLOURS.values())),
        norm=BoundaryNorm(np.arange(-1.5, 3.5), 4),
        **frame,
    )
    times = np.where(verdict == 1, downsample(case["time"], MOST_PIXELS), np.nan)
    drawn = axes.imshow(times, cmap=VALUES_SCALE, norm=LogNorm(SOONEST, LATEST), **frame)
    share = 100.0 * float(case["captured"])
    under = "" if condition == "nominal" else f"\n{_written(condition)}"
    axes.set_title(f"{strategy}: {share:.4g} %{under}", fontsize=9)
    return drawn


def success_table(result: xr.Dataset) -> Figure:
    """Part of the starts captured, for each condition (rows) and strategy (columns)."""
    strategies = [str(name) for name in result["strategy_name"].values]
    conditions = [str(name) for name in result["condition_name"].values]
    figure = new_figure(3.6 + 1.3 * len(strategies), 1.6 + 0.36 * len(conditions))
    axes = figure.subplots()
    share = 100.0 * result["captured"].values.T
    drawn = axes.imshow(share, cmap="Blues", vmin=0.0, vmax=100.0, aspect="auto")
    for (i, j), value in np.ndenumerate(share):
        color = "white" if value > 60.0 else BLACK
        axes.text(j, i, f"{value:.4g}", ha="center", va="center", color=color, fontsize=9)
    axes.set_xticks(range(len(strategies)), strategies)
    axes.set_yticks(range(len(conditions)), [_written(one) for one in conditions])
    axes.tick_params(length=0, labelsize=9)
    figure.colorbar(drawn, ax=axes, label="starts captured (%)")
    axes.set_title(_title(result), fontsize=10)
    return figure


def _written(condition: str) -> str:
    """A condition as a figure writes it: axial_forcing=0.55 is Γ = 0.55."""
    parts = (part.strip().partition("=") for part in condition.split(","))
    symbols = {name: of.symbol for name, of in MAP_PARAMETERS.items()}
    words = [f"{symbols.get(name, name)} {is_} {value}".strip() for name, is_, value in parts]
    return typeset(", ".join(words))


def _title(result: xr.Dataset) -> str:
    values = (result.attrs[f"parameter_{name}"] for name in ("axial_forcing", "restitution"))
    forcing, restitution = values
    return f"Starts captured at Γ = {forcing:g}, ε = {restitution:g}"


def pictures(_: Study, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    return {"juggling": capture_maps(result), "juggling_table": success_table(result)}

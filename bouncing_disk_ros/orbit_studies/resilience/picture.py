"""The pictures of resilience: shares, fatal changes and times over a parameter."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import ListedColormap, PowerNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from bouncing_disk_ros.colours import ABSENT, BLACK, VALUES_SCALE
from bouncing_disk_ros.matplotlib_figures import (
    cell_ends,
    light_grid,
    mark_in_pi,
    name_axis,
    new_figure,
    say_instead,
)
from bouncing_disk_ros.study.computation import Study
from bouncing_disk_ros.study.line_picture import draw_shares, few, line_colours, line_legend

_NEVER = "#f7c6c5"
"""Areas where no impulse is fatal, and where there is no such attractor."""


def resilience_picture(result: xr.Dataset) -> Figure:
    """Figure of shares, fatal impulses, fatal timing errors and times, a line for an attractor.

    >>> resilience_picture(resilience(begin=0.4, end=0.45, count=2, samples=40, instants=8))
    """
    figure = new_figure(8.5, 11.0)
    panels = figure.subplots(4, 1, sharex=True, height_ratios=[1.2, 1.2, 1.0, 1.0])
    x = result["value"].values
    colors = line_colours(result)
    draw_shares(panels[0], result, x, colors)
    _draw_pairs(panels[1], x, result["line_least_fatal_impulse"].values, colors)
    panels[1].set_ylabel(r"fatal impulse ($m\,\pi g/\omega$)")
    _second_scale(panels[1], impulse_unit(result), "N·s")
    panels[1].set_title("smallest fatal impulse at any instant: upwards solid, downwards dashed",
                        fontsize=9)  # fmt: skip
    _draw_pairs(panels[2], x, result["line_fatal_timing_error"].values, colors)
    mark_in_pi(panels[2].yaxis, 0.25, math.pi)
    panels[2].set_ylabel("fatal timing error (rad)")
    _second_scale(panels[2], 1e3 * time_unit(result), "ms")
    panels[2].set_title("smallest fatal timing error of an impact: late solid, early dashed",
                        fontsize=9)  # fmt: skip
    _draw_times(panels[3], result, x, colors)
    for axes in panels:
        light_grid(axes)
    if len(np.unique(x)) > 1:
        panels[3].set_xlim(x.min(), x.max())
    name_axis(panels[3].xaxis, result["value"].attrs)
    line_legend(figure, result, colors)
    figure.suptitle(_title(result), fontsize=11)
    return figure


def impulse_unit(result: xr.Dataset) -> float:
    """The unit of impulses, m π g/ω, in N·s."""
    given = (float(result.attrs[f"parameter_{name}"]) for name in ("mass", "gravity", "frequency"))
    mass, gravity, frequency = given
    return mass * gravity / (2.0 * frequency)


def time_unit(result: xr.Dataset) -> float:
    """The unit of time, 1/ω, in s."""
    return 1.0 / (math.tau * float(result.attrs["parameter_frequency"]))


def _draw_pairs(
    axes: Any, x: NDArray[np.float64], values: NDArray[np.float64], colors: list[str]
) -> None:
    """Both senses of a change, of each line; values that are nowhere fatal are left out."""
    for i, color in enumerate(colors):
        for k, style in enumerate(("-", "--")):
            shown = np.where(np.isfinite(values[i, :, k]), values[i, :, k], np.nan)
            dot = "." if few(shown) else ""
            axes.plot(x, shown, style, color=color, lw=1.3, marker=dot, ms=3)
    if not np.isfinite(values).any():
        say_instead(axes, "none is fatal, or none is known")
    axes.set_ylim(bottom=0.0)


def _second_scale(axes: Any, unit: float, name: str) -> None:
    other = axes.secondary_yaxis("right", functions=(lambda v: v * unit, lambda v: v / unit))
    other.set_ylabel(name)


def _draw_times(axes: Any, result: xr.Dataset, x: NDArray[np.float64], colors: list[str]) -> None:
    for i, color in enumerate(colors):
        for name, style in (("median_time", "-"), ("convergence_time", ":")):
            values = result[f"line_{name}"].values[i]
            values = np.where(values > 0.0, values, np.nan)
            axes.plot(x, values, style, color=color, lw=1.3, marker="." if few(values) else "")
    axes.set_yscale("log")
    axes.set_ylabel(r"periods $2\pi/\omega$")
    axes.set_title("median time to reach it from its basin (solid), time constant near it (dotted)",
                   fontsize=9)  # fmt: skip


def impulse_picture(result: xr.Dataset) -> Figure:
    """Figure of fatal impulses over instant and parameter, of the largest line without contact.

    A line of which none is fatal is taken only where all are such lines.

    >>> impulse_picture(resilience(begin=0.4, end=0.45, count=2, samples=40, instants=8))
    """
    figure = new_figure(10.0, 4.6)
    panels = figure.subplots(1, 2, sharey=True)
    colors = line_colours(result)
    shares = np.nanmax(result["line_share_without_contact"].values, axis=1)
    own = [i for i, color in enumerate(colors) if color != BLACK] or list(range(len(colors)))
    if not own:
        return figure
    has_sizes = np.isfinite(result["line_fatal_impulse"].values).any(axis=(1, 2, 3))
    line = max(own, key=lambda i: (bool(has_sizes[i]), float(shares[i])))
    sizes = result["line_fatal_impulse"].values[line]
    top = float(np.quantile(sizes[np.isfinite(sizes)], 0.99)) if np.isfinite(sizes).any() else 1.0
    x = result["value"].values
    for k, (axes, name) in enumerate(zip(panels, ("upwards", "downwards"), strict=True)):
        shown = np.ma.masked_invalid(sizes[:, k])
        never = np.ma.masked_equal(np.isinf(sizes[:, k]), False)
        axes.set_facecolor(ABSENT)
        frame = {"origin": "lower", "aspect": "auto", "interpolation": "nearest",
                 "extent": (0.0, 1.0, *cell_ends(x))}  # fmt: skip
        axes.imshow(never, cmap=ListedColormap([_NEVER]), **frame)
        drawn = axes.imshow(shown, norm=PowerNorm(0.5, 0.0, top), cmap=VALUES_SCALE, **frame)
        axes.set_xlabel("part of a repetition since its first impact")
        axes.set_title(f"impulse {name}", fontsize=10)
    figure.colorbar(drawn, ax=panels, label=r"fatal impulse ($m\,\pi g/\omega$)", extend="max")
    name_axis(panels[0].yaxis, result["value"].attrs)
    name = str(result["line_name"].values[line])
    figure.suptitle(f"Smallest fatal impulse over its instant: {name}", fontsize=11)
    _areas(figure, sizes, float(result.attrs["parameter_largest_impulse"]))
    return figure


def _areas(figure: Figure, sizes: NDArray[np.float64], largest: float) -> None:
    """What the areas without a size are, those that are there."""
    texts = (
        (_NEVER, f"no impulse up to {largest:g} is fatal", np.isinf(sizes).any()),
        (ABSENT, "the attractor is not there, or its size is not decided", np.isnan(sizes).any()),
    )
    handles = [Patch(facecolor=color, edgecolor=BLACK, linewidth=0.5, label=text)
               for color, text, there in texts if there]  # fmt: skip
    if handles:
        figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=9,
                      frameon=False)  # fmt: skip


def _title(result: xr.Dataset) -> str:
    along = result.attrs["parameter_along"]
    other, symbol = ("restitution", "ε") if along == "axial_forcing" else ("axial_forcing", "Γ")
    about = {name: float(result.attrs[f"parameter_{name}"]) for name in ("mass", "frequency")}
    return (
        f"Resilience of the attractors at {other.replace('_', ' ')} {symbol} = "
        f"{result.attrs[f'parameter_{other}']:g}; N·s and ms for {about['mass']:g} kg at "
        f"{about['frequency']:g} Hz"
    )


def pictures(_: Study, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    return {"resilience": resilience_picture(result), "fatal_impulse": impulse_picture(result)}

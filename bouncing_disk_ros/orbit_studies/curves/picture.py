"""The picture of curves in the plane of Γ and ε, over the map of attractors."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from bouncing_disk_ros.colours import BLACK, VERMILION
from bouncing_disk_ros.matplotlib_figures import cut_at_zero, new_figure
from bouncing_disk_ros.study.computation import Study
from bouncing_disk_ros.study.parameter_map.picture import draw_periods

STYLES: dict[str, tuple[Any, str]] = {
    "fold": ("-", BLACK),
    "doubling": ("--", BLACK),
    "graze": ("-", VERMILION),
    "contact onset": (":", VERMILION),
}
_HALO = [withStroke(linewidth=2.8, foreground="white", alpha=0.7)]
"""About a curve, so that it is seen on areas of its own colour; not between dots."""
MARKERS = {
    "cusp": "^", "generalised flip": "s", "graze meets doubling": "D", "graze meets fold": "v",
    "two grazes": "o",
}  # fmt: skip


def curves_picture(result: xr.Dataset) -> Figure:
    """Figure of the curves and their special points, over the periods of the attractors.

    >>> curves_picture(curves(axial_forcing_count=8, restitution_count=6, doublings=0))
    """
    figure = new_figure(9.5, 7.2)
    axes = figure.subplots()
    draw_periods(axes, result)
    for name, get, keep in (
        ("axial_forcing", axes.get_xlim, axes.set_xlim),
        ("restitution", axes.get_ylim, axes.set_ylim),
    ):
        low, high = (float(result.attrs[f"parameter_{name}_{end}"]) for end in ("begin", "end"))
        keep(min(low, get()[0]), max(high, get()[1]))  # one column is narrower than the window
    cut_at_zero(axes, result["axial_forcing"].values, result["restitution"].values)
    ends = axes.get_xlim(), axes.get_ylim()
    drawn = [_draw_curve(axes, result, i) for i in range(result.sizes.get("curve", 0))]
    special = _draw_special(axes, result)
    axes.set_xlim(ends[0])
    axes.set_ylim(ends[1])
    axes.set_xlabel("axial forcing Γ")
    axes.set_ylabel("restitution ε")
    axes.set_title("")
    kinds = [kind for kind in STYLES if kind in {str(k) for k in result["curve_kind"].values}]
    handles: list[Any] = [
        Line2D([], [], linestyle=STYLES[kind][0], color=STYLES[kind][1], label=kind)
        for kind in kinds
    ]
    if any(drawn):
        handles.append(Line2D([], [], color=BLACK, alpha=0.25, label="no motion of a disk"))
    figure.legend(handles=[*handles, *special], loc="outside right upper", fontsize=9,
                  frameon=False)  # fmt: skip
    about = result.attrs
    figure.suptitle(
        "Curves of the attractors at "
        f"Γ = {about['parameter_axial_forcing']:g}, ε = {about['parameter_restitution']:g}\n"
        "numbers: impacts/periods of the orbit",
        fontsize=11,
    )
    return figure


def _draw_curve(axes: Any, result: xr.Dataset, i: int) -> bool:
    """One curve, faint where the orbit is cut short; whether it is so anywhere."""
    own = result["point_curve"].values == i
    x, y = (result[f"point_{name}"].values[own] for name in ("axial_forcing", "restitution"))
    allowed = result["point_admissible"].values[own] > 0
    line, color = STYLES[str(result["curve_kind"].values[i])]
    style: dict[str, Any] = {"lw": 1.8} if line == ":" else {"lw": 1.3, "path_effects": _HALO}
    axes.plot(np.where(allowed, x, np.nan), np.where(allowed, y, np.nan), line, color=color,
              **style)  # fmt: skip
    faint = np.append(~allowed[1:] | ~allowed[:-1], False) | np.append(False, ~allowed[1:])
    if (~allowed).any():
        axes.plot(np.where(faint, x, np.nan), np.where(faint, y, np.nan), line, color=color, lw=1.0,
                  alpha=0.25)  # fmt: skip
    impacts, cycles = (int(result[f"curve_{name}"].values[i]) for name in ("impacts", "cycles"))
    low, high = axes.get_xlim(), axes.get_ylim()
    inside = allowed & (x > low[0]) & (x < low[1]) & (y > high[0]) & (y < high[1])
    if inside.any():
        places = np.flatnonzero(inside)
        at = places[int((0.35 + 0.13 * (i % 4)) * (len(places) - 1))]
        text = f"{impacts}/{cycles}" if impacts else f"{cycles}"
        box = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8}
        axes.annotate(text, (x[at], y[at]), fontsize=7, color=color, ha="center", va="center",
                      bbox=box)  # fmt: skip
    return bool((~allowed).any())


def _draw_special(axes: Any, result: xr.Dataset) -> list[Any]:
    """The special points; their handles for a legend."""
    handles = []
    kinds = np.array([str(kind) for kind in result["special_kind"].values])
    for kind, marker in MARKERS.items():
        mine = kinds == kind
        if mine.any():
            x, y = (result[f"special_{n}"].values[mine] for n in ("axial_forcing", "restitution"))
            style: dict[str, Any] = {"color": "white", "mec": BLACK, "ms": 6, "label": kind}
            handles += axes.plot(x, y, marker, **style)
    return handles


def pictures(_: Study, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    return {"curves": curves_picture(result)}

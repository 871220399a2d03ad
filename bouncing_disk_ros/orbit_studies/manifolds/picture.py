"""The picture of saddles and their manifolds, over the basins."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from bouncing_disk_ros.colours import BLACK, BLUE, VERMILION
from bouncing_disk_ros.maps.basin_measures import downsample
from bouncing_disk_ros.matplotlib_figures import MOST_PIXELS, new_figure
from bouncing_disk_ros.study.basins.picture import frame, label_axes, title_of
from bouncing_disk_ros.study.computation import Study

_PALE = ("#e8e8e8", "#cfe3f5", "#fbe3c0", "#cdeadb", "#f0d9e6", "#dcf0fb", "#f8d6c4", "#fbf8cf")
_COLOURS = (BLUE, VERMILION)


def manifolds_picture(result: xr.Dataset) -> Figure:
    """Figure of basins (pale), stable manifolds (blue), unstable ones (red) and saddles (stars).

    >>> manifolds_picture(manifolds(axial_forcing=0.45, width=24, height=24))
    """
    figure = new_figure(9.5, 7.0)
    axes = figure.subplots()
    labels = downsample(result["label"], MOST_PIXELS)
    names = [str(name) for name in result["attractor_name"].values]
    colors = [_PALE[i % len(_PALE)] for i in range(len(names))]
    axes.imshow(labels, cmap=ListedColormap(["#777777", *colors]), vmin=-1.5,
                vmax=len(names) - 0.5, **frame(result))  # fmt: skip
    ends = axes.get_xlim(), axes.get_ylim()
    for k in (1, 0):
        _draw_pieces(axes, result, k, ends)
    phases = result["saddle_point_forcing_phase"].values / math.pi
    left = ends[0][0]
    axes.plot(left + (phases - left) % 2.0, result["saddle_point_velocity"].values, "*", ms=13,
              color="white", mec=BLACK, label="saddle")  # fmt: skip
    axes.set_xlim(ends[0])
    axes.set_ylim(ends[1])
    label_axes(axes, result)
    _add_legend(axes, result, names, colors)
    figure.suptitle(title_of(result), fontsize=12)
    return figure


def _draw_pieces(axes: Any, result: xr.Dataset, stability: int, ends: Any) -> None:
    """Pieces of the manifolds of one kind, once for each period of the window they lie in."""
    kinds = result["piece_stability"].values
    pieces = result["manifold_piece"].values
    order = np.flatnonzero(np.diff(pieces)) + 1
    phases = np.split(result["manifold_forcing_phase"].values / math.pi, order)
    speeds = np.split(result["manifold_velocity"].values, order)
    lines = []
    for kind, phase, speed in zip(kinds, phases, speeds, strict=False):
        if kind != stability:
            continue
        first = math.floor((ends[0][0] - phase.max()) / 2.0)
        last = math.ceil((ends[0][1] - phase.min()) / 2.0)
        lines += [
            np.stack((phase + 2.0 * shift, speed), axis=1) for shift in range(first, last + 1)
        ]
    width = 0.9 if stability == 0 else 0.6
    drawn = LineCollection(lines, colors=_COLOURS[stability], linewidths=width, rasterized=True)
    axes.add_collection(drawn, autolim=False)


def _add_legend(axes: Any, result: xr.Dataset, names: list[str], colors: list[str]) -> None:
    handles: list[Any] = []
    for i, (name, color) in enumerate(zip(names, colors, strict=True)):
        share = 100.0 * float(result["fraction"][i])
        label = f"basin of {name}: {share:.2f} %"
        handles.append(Line2D([], [], marker="s", ls="", ms=9, color=color, mec=BLACK, mew=0.5,
                              label=label))  # fmt: skip
    handles += [
        Line2D([], [], color=_COLOURS[0], label="stable manifold"),
        Line2D([], [], color=_COLOURS[1], label="unstable manifold"),
        Line2D([], [], marker="*", ls="", ms=11, color="white", mec=BLACK, label="saddle"),
    ]
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=3,
                fontsize=9, frameon=False)  # fmt: skip


def pictures(_: Study, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    return {"manifolds": manifolds_picture(result)}

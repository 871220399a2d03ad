"""Figures of single tosses after the paper's Figs. 1 and 2d: paths of the hand, tosses in time.

Colour-blind people can distinguish the colours. The study `toss_map` draws the maps of Fig. 2a-c.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bouncing_disk_ros.colours import BLUE, DISK, GREEN, GREY, PLATFORM, PURPLE, VERMILION
from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.maps.toss_paths import TossPaths, TossTrajectory
from bouncing_disk_ros.maps.tosses import Floats
from bouncing_disk_ros.matplotlib_figures import light_grid, new_figure
from bouncing_disk_ros.study.computation import Study
from bouncing_disk_ros.units import in_pi

DPI = 200
"""Of PNG files, and of the images within vector figures."""


def toss_title(phase_lag: float, amplitude_angle: float) -> str:
    """Name of a toss: θ and φ_L (rad) as parts of π."""
    lag, angle = in_pi(phase_lag / math.pi), in_pi(amplitude_angle / math.pi)
    return rf"$\theta$ = {lag}, $\phi_L$ = {angle}"


# Fig. 1 -------------------------------------------------------------------------------------------


def paths_figure(paths: TossPaths, titles: Sequence[str], columns: int = 3) -> Figure:
    """Figure of paths of the hand, one panel each, with start, direction and point of separation.

    `paths` has one leading axis, as long as `titles`.

    >>> from bouncing_disk_ros.maps.toss_paths import toss_paths
    >>> paths_figure(toss_paths(np.array([0.0, -0.7]), np.array([0.8, 0.8])), ["a", "b"])
    """
    rows = -(-len(titles) // columns)
    figure = new_figure(3.1 * columns, 3.25 * rows + 0.5, DPI)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes in panels[len(titles) :]:
        axes.set_visible(False)
    reach = 1150.0 * max(np.abs(paths.arc).max(), np.abs(paths.axial_position).max())
    for i, title in enumerate(titles):
        axes = panels[i]
        _path(axes, paths, i)
        axes.set_title(f"({'abcdefghijklmnopqrstuvwxyz'[i % 26]}) {title}", fontsize=10)
        axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
        light_grid(axes)
        axes.label_outer()
    figure.supxlabel(r"arc $a_e \beta$ along the circle of radius $a_e$ (mm)", fontsize=10)
    figure.supylabel("height $s$ (mm)", fontsize=10)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=9, frameon=False)
    return figure


def _path(axes: Any, paths: TossPaths, i: int) -> None:
    x, y = 1e3 * paths.arc[i], 1e3 * paths.axial_position[i]
    up = paths.forcing_phase <= paths.separation_phase[i] + math.tau  # nan: none
    axes.plot(x, y, color=GREY, lw=1.2, label="rest of the period")
    axes.plot(x[up], y[up], color=BLUE, lw=2.4, label="disk on the hand, from rest")
    n = len(x)
    for k in (n // 8, 5 * n // 8):  # halfway up, and halfway down
        arrow = {"arrowstyle": "-|>", "color": BLUE if up[k] else GREY, "mutation_scale": 16}
        axes.annotate("", (x[k + 2], y[k + 2]), (x[k - 2], y[k - 2]), arrowprops=arrow)
    axes.plot(x[0], y[0], "o", color=BLUE, ms=7, label="start, lowest point")
    left = 1e3 * paths.separation_arc[i], 1e3 * paths.separation_position[i]
    axes.plot(*left, "X", color=VERMILION, ms=9, mec="white", label=r"disk leaves ($\tau_{sep}$)")


# Fig. 2d ------------------------------------------------------------------------------------------


def trajectories_figure(
    tosses: Sequence[TossTrajectory], titles: Sequence[str], heights: str = "height"
) -> Figure:
    """Figure of tosses in time: height of the first (title `heights`), angular velocity of each.

    >>> from bouncing_disk_ros.maps.toss_paths import toss_trajectory
    >>> trajectories_figure([toss_trajectory(0.0, 0.78)], ["θ = 0"])
    """
    figure = new_figure(7.0, 2.3 * (len(tosses) + 1) + 0.4, DPI)
    panels = figure.subplots(len(tosses) + 1, 1, sharex=True, squeeze=False).ravel()
    first = tosses[0]
    pair = (first.platform_position, first.axial_position)
    _pair(
        panels[0],
        first,
        1e3 * pair[0],
        1e3 * pair[1],
        (r"platform $s$, $\dot{\beta}$", r"disk $x$, $\dot{\alpha}$"),
    )
    panels[0].set(title=heights, ylabel="height $s$, $x$ (mm)")
    for axes, run, name in zip(panels[1:], tosses, titles, strict=True):
        title = name
        _pair(axes, run, run.platform_angular_velocity, run.angular_velocity, ("", ""))
        if math.isfinite(run.separation_time):
            title += rf":  $\dot{{\alpha}}_f$ = {run.airborne_speed:.2f} rad/s"
        axes.set(title=title, ylabel=r"$\dot{\alpha}$, $\dot{\beta}$ (rad/s)")
        for phase, colour in ((Phase.SLIDING, PURPLE), (Phase.STICKING, GREEN)):
            if (run.phase == phase).any():
                label = f"disk {phase.name.lower()}"
                _shade(axes, run.time, run.phase == phase, colour, label)
    for axes in panels:
        axes.title.set_fontsize(10)
        light_grid(axes)
    panels[-1].set(xlabel="time after the start (s)")
    panels[-1].set_xlim(first.time[0], first.time[-1])
    entries = {
        label: handle
        for axes in panels
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        entries.values(), entries, loc="outside upper center", ncols=5, fontsize=9, frameon=False
    )
    return figure


def _pair(
    axes: Any, run: TossTrajectory, platform: Floats, disk: Floats, labels: tuple[str, str]
) -> None:
    axes.plot(run.time, disk, color=DISK, lw=2.0, label=labels[1])
    axes.plot(run.time, platform, color=PLATFORM, lw=1.6, ls="--", label=labels[0])
    separation = r"disk leaves ($\tau_{sep}$)" if labels[0] else ""
    if math.isfinite(run.separation_time):
        axes.axvline(run.separation_time, color="black", lw=1.0, ls=":", label=separation)


def _shade(axes: Any, time: Floats, where: NDArray[np.bool_], colour: str, label: str) -> None:
    axes.fill_between(
        time, 0, 1, where=where, transform=axes.get_xaxis_transform(), color=colour, alpha=0.25,
        lw=0, label=label,
    )  # fmt: skip


def pictures(_: Study, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    paths = TossPaths(**{name: result[name].values for name in TossPaths._fields})
    pairs = zip(result["phase_lag"].values, result["amplitude_angle"].values, strict=True)
    titles = [toss_title(float(lag), float(angle)) for lag, angle in pairs]
    return {"toss_paths": paths_figure(paths, titles)}

"""The pictures of basins of attraction (paper, Fig. 4) and of the mean speeds of their starts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from bouncing_disk_ros.colours import (
    BLACK,
    CONTACT_AREA,
    REST_AREA,
    SIGNED_SCALE,
    UNRESOLVED_AREA,
    VALUES_SCALE,
    VERMILION,
    attractor_colours,
)
from bouncing_disk_ros.maps.basin_measures import downsample
from bouncing_disk_ros.matplotlib_figures import (
    MOST_PIXELS,
    mark_in_pi,
    new_figure,
    pixel_frame,
    typeset,
)
from bouncing_disk_ros.study.computation import Study

POINTS = "impacts on the attractors"
CONTACT_POINTS = "impacts on the attractor with contact"


def basins_picture(result: xr.Dataset) -> Figure:
    """Figure of a map of labels with the attractors, and of the time that each start takes.

    >>> basins_picture(basins(axial_forcing=0.34, width=60, height=60))
    """
    figure = new_figure(11.5, 5.4)
    left, right = figure.subplots(1, 2, sharey=True)
    draw_labels(left, result)
    _draw_times(figure, right, result)
    figure.suptitle(title_of(result), fontsize=12)
    left.set_title("Attractor that each start goes to", fontsize=10)
    return figure


def title_of(result: xr.Dataset) -> str:
    """What the map is of."""
    axial_forcing, restitution = (
        result.attrs["parameter_axial_forcing"],
        result.attrs["parameter_restitution"],
    )
    at = f"axial forcing Γ = {axial_forcing:g}, restitution ε = {restitution:g}"
    return f"Basins of attraction at {at}"


def draw_labels(axes: Any, result: xr.Dataset) -> None:
    """Labels as colours, the points of each attractor, and a legend with the shares."""
    names = [str(name) for name in result["attractor_name"].values]
    colors = attractor_colours(names)
    norm = BoundaryNorm(np.arange(-1.5, len(names) + 0.5), len(names) + 1)
    axes.imshow(
        downsample(result["label"], MOST_PIXELS),
        cmap=ListedColormap([UNRESOLVED_AREA, *colors]),
        norm=norm,
        **frame(result),
    )
    handles = []
    for i, (name, color) in enumerate(zip(names, colors, strict=True)):
        share, error = float(result["fraction"][i]), float(result["fraction_uncertainty"][i])
        digits = 2 if error == 0.0 else max(2, -math.floor(math.log10(100.0 * error)))
        text = f"{name}: {100 * share:.{digits}f} ± {100 * error:.{digits}f} %"
        handles.append(Patch(facecolor=color, edgecolor=BLACK, linewidth=0.5, label=text))
        _draw_points(axes, result, i, color)
    handles += _legend_of_points(axes)
    unresolved = float(result["unresolved_fraction"])
    if unresolved > 0.0:
        text = f"unresolved: {100 * unresolved:.2f} %"
        handles.append(Patch(facecolor=UNRESOLVED_AREA, edgecolor=BLACK, linewidth=0.5, label=text))
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=2,
                fontsize=9, frameon=False)  # fmt: skip
    label_axes(axes, result)


def _draw_points(axes: Any, result: xr.Dataset, i: int, color: str) -> None:
    owner = result["point_attractor"].values == i
    phases = result["point_forcing_phase"].values[owner] / math.pi
    speeds = result["point_velocity"].values[owner]
    light = color in (REST_AREA, CONTACT_AREA)
    style: dict[str, Any] = {
        "color": VERMILION if light else "white",
        "markeredgecolor": BLACK,
        "mew": 0.6,
    }
    style["ms"] = 3.5 if light else 6
    if len(phases) > 1000:  # chaotic: a cloud
        style |= {"ms": 1.2, "markeredgecolor": "none", "rasterized": True}
    left, right = axes.get_xlim()
    low, high = axes.get_ylim()
    phases = left + (phases - left) % 2.0  # the window may begin anywhere on the circle
    inside = (speeds >= low) & (speeds <= high) & (phases <= right)
    if inside.any():
        name = CONTACT_POINTS if light else POINTS
        axes.plot(phases[inside], speeds[inside], "o", label=name, **style)


def _legend_of_points(axes: Any) -> list[Any]:
    """What the white and the orange dots are, those there are."""
    known = {line.get_label(): line for line in axes.get_lines()}
    return [
        axes.plot([], [], "o", color=line.get_color(), mec=BLACK, mew=0.6, ms=5, label=name)[0]
        for name, line in known.items()
        if name in (POINTS, CONTACT_POINTS)
    ]


def _draw_times(figure: Figure, axes: Any, result: xr.Dataset) -> None:
    cycles = downsample(result["time"], MOST_PIXELS) / math.tau
    known = np.isfinite(cycles)
    top = float(np.quantile(cycles[known], 0.995)) if known.any() else 1.0
    axes.set_facecolor(UNRESOLVED_AREA)
    drawn = axes.imshow(cycles, cmap=VALUES_SCALE, vmin=0.0, vmax=top, **frame(result))
    figure.colorbar(drawn, ax=axes, label="time until it is clear (periods 2π/ω)", extend="max")
    axes.set_title("Time until it is clear where a start goes", fontsize=10)
    if not known.all():
        text = "no time: on a chaotic attractor, or unresolved"
        grey = Patch(facecolor=UNRESOLVED_AREA, edgecolor=BLACK, linewidth=0.5, label=text)
        axes.legend(handles=[grey], loc="upper center", bbox_to_anchor=(0.5, -0.14), fontsize=9,
                    frameon=False)  # fmt: skip
    label_axes(axes, result)
    axes.set_ylabel("")


def frame(result: xr.Dataset) -> dict[str, Any]:
    """How a map over the starts is drawn: arguments of imshow."""
    return pixel_frame(result["forcing_phase"].values / math.pi, result["velocity"].values)


def label_axes(axes: Any, result: xr.Dataset) -> None:
    """Name the axes of such a map."""
    mark_in_pi(axes.xaxis)
    axes.set_xlabel(r"forcing phase at the first impact $\tau_{imp}$ (rad)")
    before = result.attrs["parameter_velocity"] == "before"
    name = "relative velocity before it, $w_A$"
    if not before:
        name = r"relative velocity after it, sign changed, $-u = \epsilon\, w_A$"
    axes.set_ylabel(f"{name} ($\\pi g/\\omega$)")


# ------------------------------------------------------------------------------------------------
# The picture of the mean speeds that starts end with, a panel for each initial speed.


COLUMNS = 3


def start_speeds_picture(result: xr.Dataset) -> Figure:
    """Figure of the mean speed over the starts of a result of the study `basins`.

    >>> start_speeds_picture(basins(width=60, height=60, angular_velocities=[0.0]))
    """
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
        axes.set_facecolor(UNRESOLVED_AREA)
        drawn = axes.imshow(speeds[place], cmap=SIGNED_SCALE, vmin=-top, vmax=top, **frame(result))
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


def pictures(_: Study, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    figures = {"basins": basins_picture(result)}
    if "mean_speed" in result:
        figures["mean_speeds"] = start_speeds_picture(result)
    return figures

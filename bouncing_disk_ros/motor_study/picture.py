"""The pictures of a motor: over two of its parameters, and its speed over its torque."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from bouncing_disk_ros.colours import (
    ABSENT,
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    SIGNED_SCALE,
    SKY,
    UNRESOLVED_AREA,
    VALUES_SCALE,
    VERMILION,
)
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.maps.basin_measures import downsample
from bouncing_disk_ros.matplotlib_figures import (
    MOST_PIXELS,
    about_zero,
    cut_at_zero,
    map_frame,
    name_axis,
    name_lines,
    new_figure,
    pixel_frame,
    say_instead,
    typeset,
)
from bouncing_disk_ros.motor_study.compute import Motor
from bouncing_disk_ros.parameters import TABLE
from bouncing_disk_ros.units import with_prefix

KIND_COLOURS: Mapping[int, str] = {
    -1: UNRESOLVED_AREA, 0: BLUE, 1: ORANGE, 2: "#d9d9d9", 3: BLACK, 4: VERMILION, 5: SKY,
}  # fmt: skip
"""Numbers of the study's field `kind` -> colour."""
_IN_ORDER = sorted(KIND_COLOURS)


def motor_map_picture(result: xr.Dataset) -> Figure:
    """Four panels over the two parameters, and what is fixed."""
    figure = new_figure(11.5, 9.0)
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    speeds = about_zero(downsample(result["mean_speed"], MOST_PIXELS))
    _draw(figure, panels[0, 0], result, "mean_speed", {"cmap": SIGNED_SCALE, **speeds})
    _draw(figure, panels[0, 1], result, "efficiency", {"cmap": VALUES_SCALE, "vmin": 0.0})
    powers = about_zero(result["output_power"].values)
    _draw(figure, panels[1, 0], result, "output_power", {"cmap": "PuOr_r", **powers})
    _draw_kinds(panels[1, 1], result)
    up, across = result["kind"].dims
    cut_at_zero(panels[0, 0], result[across].values, result[up].values)  # axes are shared
    for axes in panels[1]:
        name_axis(axes.xaxis, result[across].attrs)
    for axes in panels[:, 0]:
        name_axis(axes.yaxis, result[up].attrs)
    figure.suptitle(fixed_text(result), fontsize=10)
    return figure


def _draw(
    figure: Figure, axes: Any, result: xr.Dataset, field: str, scale: Mapping[str, Any]
) -> None:
    values = downsample(result[field], MOST_PIXELS)
    about = result[field].attrs
    axes.set_facecolor(ABSENT)
    shown = np.ma.masked_invalid(values)
    drawn = axes.imshow(shown, **scale, **map_frame(result["kind"]))
    unit = "" if about["units"] == "1" else f"{about['units']}; "
    figure.colorbar(drawn, ax=axes, label=f"{unit}grey: none")
    axes.set_title(about["long_name"], fontsize=10)


def _draw_kinds(axes: Any, result: xr.Dataset) -> None:
    found = downsample(result["kind"], MOST_PIXELS)
    edges = [number - 0.5 for number in _IN_ORDER] + [_IN_ORDER[-1] + 0.5]
    colors = ListedColormap([KIND_COLOURS[number] for number in _IN_ORDER])
    axes.imshow(
        found, cmap=colors, norm=BoundaryNorm(edges, len(_IN_ORDER)), **map_frame(result["kind"])
    )
    names = kinds_of(result)
    handles = [
        Patch(facecolor=KIND_COLOURS[number], edgecolor=BLACK, linewidth=0.5, label=names[number])
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


def axis_label(axis: xr.DataArray) -> str:
    """Name, symbol and unit of an axis."""
    about = axis.attrs
    return typeset(f"{about['long_name']} {about['symbol']} ({about['units']})")


def fixed_text(result: xr.Dataset) -> str:
    """What is fixed, in two lines."""
    given = {name.removeprefix("parameter_"): value for name, value in result.attrs.items()}
    parts = []
    for name in (*Motion._fields, *Disk._fields):
        if name in given and (given[name] != 0.0 or name == "phase_lag"):
            symbol = TABLE[name].symbol.split(" ")[0]
            parts.append(f"{symbol} = {with_prefix(given[name], TABLE[name].shown_unit)}")
    half = (len(parts) + 1) // 2
    return typeset(f"{', '.join(parts[:half])}\n{', '.join(parts[half:])}; start: {given['start']}")


# ------------------------------------------------------------------------------------------------
# Speed over torque of a motor, with its efficiency; stall torque and no-load speed.


LINES = 7
"""Curves drawn, spread evenly over the axis that is not the torque."""
_LEVELS = 10
_BEYOND = 0.05
"""Where contours do not reach more than this share of the points, cells are drawn."""


def speed_torque_picture(result: xr.Dataset, load: str) -> Figure:
    """Speed over `load` for some values of the other axis, and efficiency over both."""
    figure = new_figure(12.5, 5.4)
    left, right = figure.subplots(1, 2)
    other = next(str(dim) for dim in result["mean_speed"].dims if dim != load)
    speed, efficiency, kind = (
        result[name].transpose(other, load).values for name in ("mean_speed", "efficiency", "kind")
    )
    top = float(np.nanmax(efficiency)) if np.isfinite(efficiency).any() else 1.0
    norm = Normalize(0.0, top or 1.0)
    torques = result[load].values
    for i in _spread(kind):
        _draw_line(left, torques, speed[i], efficiency[i], norm)
    left.axhline(0.0, color=GREY, linewidth=0.8)
    if not np.isfinite(speed).any():
        say_instead(left, "no mean speed anywhere")
    others = [float(value) for value in result[other]]
    name_lines(left, _ends(torques, speed, others, _spread(kind)))
    name_axis(left.xaxis, result[load].attrs)
    left.set_ylabel("mean speed of the rotor (rad/s)")
    left.set_title(f"Numbers at the lines: {axis_label(result[other])}", fontsize=10)
    _draw_efficiency(figure, right, result, efficiency, (load, other), norm)
    figure.suptitle(fixed_text(result), fontsize=10)
    return figure


def _spread(kind: NDArray[np.int32]) -> list[int]:
    """Some rows, spread evenly over those where the rotor bounces without contact at some load."""
    rows = np.flatnonzero((kind == 0).any(axis=1))
    if len(rows) == 0:
        rows = np.arange(len(kind))
    picked = np.linspace(0, len(rows) - 1, min(LINES, len(rows))).round().astype(int)
    return [int(rows[i]) for i in picked]


def _draw_line(
    axes: Any, torques: Any, speed: NDArray[Any], efficiency: NDArray[Any], norm: Normalize
) -> None:
    """One curve, coloured by efficiency, grey where there is none."""
    points = np.column_stack([torques, speed])
    pieces = np.stack([points[:-1], points[1:]], axis=1)
    known = np.isfinite(pieces).all(axis=(1, 2))
    if not known.any():  # points without a neighbour
        axes.plot(torques, speed, ".", color=GREY)
    middle = 0.5 * (efficiency[:-1] + efficiency[1:])
    useful = known & np.isfinite(middle)
    axes.add_collection(LineCollection(pieces[known & ~useful], colors=GREY, linewidths=1.6))
    axes.add_collection(
        LineCollection(pieces[useful], array=middle[useful], cmap=VALUES_SCALE, norm=norm,
                       linewidths=2.2)
    )  # fmt: skip


def _ends(
    torques: Any, speed: NDArray[Any], others: list[float], rows: list[int]
) -> list[tuple[float, float, str]]:
    """Where each curve ends, and its value of the other axis."""
    found = []
    for i in rows:
        known = np.flatnonzero(np.isfinite(speed[i]))
        if len(known):
            found.append((torques[known[-1]], speed[i, known[-1]], f"{others[i]:.4g}"))
    return found


def _draw_efficiency(
    figure: Figure,
    axes: Any,
    result: xr.Dataset,
    efficiency: NDArray[Any],
    names: tuple[str, str],
    norm: Normalize,
) -> None:
    load, other = names
    axes.set_title("Efficiency: work on load and brake over work of the stator", fontsize=10)
    x, y = result[load].values, result[other].values
    axes.set_xlim(x[0], x[-1] if x[-1] > x[0] else x[0] + 1.0)
    axes.set_ylim(y[0], y[-1] if y[-1] > y[0] else y[0] + 1.0)
    name_axis(axes.xaxis, result[load].attrs)
    name_axis(axes.yaxis, result[other].attrs)
    if not np.isfinite(efficiency).any():
        say_instead(axes, "no efficiency anywhere")
        return
    shown = np.ma.masked_invalid(efficiency)
    if _contours_show(efficiency):
        levels = MaxNLocator(_LEVELS).tick_values(0.0, norm.vmax or 1.0)
        drawn = axes.contourf(x, y, shown, levels, cmap=VALUES_SCALE, norm=norm)
    else:
        frame = pixel_frame(x, y)
        drawn = axes.imshow(shown, cmap=VALUES_SCALE, norm=norm, **frame)
        axes.set(xlim=frame["extent"][:2], ylim=frame["extent"][2:])
        cut_at_zero(axes, x, y)
        if len(y) <= LINES:
            axes.set_yticks(y)
    figure.colorbar(drawn, ax=axes, label="efficiency η")


def _contours_show(values: NDArray[Any]) -> bool:
    """Whether contours reach nearly all points with a value: those of squares that have four."""
    known = np.isfinite(values)
    whole = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    reached = np.zeros_like(known)
    for part in (reached[:-1, :-1], reached[1:, :-1], reached[:-1, 1:], reached[1:, 1:]):
        part |= whole
    return bool(np.sum(known & ~reached) <= _BEYOND * np.sum(known))


def stall_picture(result: xr.Dataset) -> Figure:
    """No-load speed and stall torque over the axis that is not the load."""
    figure = new_figure(11.5, 4.8)
    panels = figure.subplots(1, 2, sharex=True)
    other = str(result["stall_torque"].dims[0])
    places = result[other].values
    loads = result["load_torque"].values
    at_zero = int(np.abs(loads).argmin())
    kind = result["kind"].transpose(other, "load_torque").values[:, at_zero]
    names = kinds_of(result)
    for axes, field in zip(panels, ("no_load_speed", "stall_torque"), strict=True):
        values = result[field].values
        axes.plot(places, values, color=GREY, linewidth=0.8, zorder=1)
        for number, name in names.items():
            mine = (kind == number) & np.isfinite(values)
            if mine.any():
                axes.plot(places[mine], values[mine], ".", color=KIND_COLOURS[number], label=name)
        axes.axhline(0.0, color=GREY, linewidth=0.8)
        if not np.isfinite(values).any():
            say_instead(axes, f"no {result[field].attrs['long_name']} anywhere")
        _mark_regimes(axes, result, other)
        name_axis(axes.xaxis, result[other].attrs)
        name_axis(axes.yaxis, result[field].attrs)
    if panels[0].get_legend_handles_labels()[0]:
        panels[0].legend(fontsize=8, title="without a load")
    figure.suptitle(fixed_text(result), fontsize=10)
    return figure


def _mark_regimes(axes: Any, result: xr.Dataset, other: str) -> None:
    if other != "preload" or "preload_doubling" not in result.attrs:
        return
    places = result[other].values
    for name, text in (("doubling", "doubling"), ("no_period_one", "no period 1"),
                       ("contact_lasts", "contact lasts")):  # fmt: skip
        at = float(result.attrs[f"preload_{name}"])
        if places[0] <= at <= places[-1]:
            axes.axvline(at, color=GREY, linewidth=0.8, linestyle=":")
            axes.text(at, 1.01, text, rotation=90, va="bottom", ha="center", fontsize=7,
                      transform=axes.get_xaxis_transform())  # fmt: skip


def pictures(study: Motor, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    found = {}
    load = next((name for name in (study.across, study.up) if name.endswith("_torque")), "")
    if load:
        found["speed_torque"] = speed_torque_picture(result, load)
    if "stall_torque" in result:
        found["stall"] = stall_picture(result)
    return {**found, "motor_map": motor_map_picture(result)}

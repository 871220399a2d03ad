"""Maps of single tosses over phase lag and amplitude angle, after the paper's Fig. 2a-c.

Colour-blind people can distinguish the colours. Only the colours are drawn as an image: text,
lines and marks stay vectors in PDF and SVG.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from bouncing_disk_ros.maps.best_toss import Extreme, Ridge
from bouncing_disk_ros.maps.toss_paths import toss_trajectory
from bouncing_disk_ros.maps.tosses import Floats, Toss, separation_phase
from bouncing_disk_ros.matplotlib_figures import edges_of, mark_in_pi, new_figure, typeset
from bouncing_disk_ros.study.toss_map.compute import TossMap
from bouncing_disk_ros.study.toss_paths.picture import DPI, toss_title, trajectories_figure

_STAYS = "#c8c8c8"
_HALO = [withStroke(linewidth=3.0, foreground="black")]
_ABOVE = {
    "loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "fontsize": 8, "frameon": False,
    "borderaxespad": 0.0,
}  # fmt: skip
_LINES = 20
"""Lines of equal value on each side of 0, at most: of more, every tenth is drawn."""
_MEASURES = {
    "airborne_speed": (r"airborne speed $\dot{\alpha}_f$", "rad/s", "RdBu_r", 5.0),
    "speed_ratio": (r"speed ratio $\nu = \dot{\alpha}_f/(\omega\Phi)$", "1", "RdBu_r", 0.2),
    "efficiency": (r"efficiency $\eta = \Delta E_r/E_{in}$", "1", "cividis", 0.05),
}


def maps_figure(
    phase_lag: Floats,
    amplitude_angle: Floats,
    tosses: Toss,
    extremes: Sequence[Extreme] = (),
    ridge: Ridge | None = None,
) -> Figure:
    """Figure of airborne speed, speed ratio and efficiency over θ (n,) and φ_L (m,), rising, rad.

    `tosses` has the shape (n, m). Each extreme is marked on its own map, with its mirror image at
    θ ± π; the ridge on the map of the speed ratio.

    >>> lag, angle = np.linspace(-3.0, 3.0, 31), np.linspace(0.1, 1.5, 21)
    >>> maps_figure(lag, angle, toss(lag[:, None], angle))
    """
    figure = new_figure(7.0, 9.6, DPI)
    panels = figure.subplots(3, 1, sharex=True, sharey=True)
    for axes, (name, letter) in zip(panels, zip(_MEASURES, "abc", strict=True), strict=True):
        _map(figure, axes, phase_lag, amplitude_angle, getattr(tosses, name), name, letter)
        if name == "speed_ratio" and ridge is not None:
            _mark_ridge(axes, ridge)
        for best in (extreme for extreme in extremes if extreme.measure == name):
            _mark(axes, best, _ends(phase_lag / math.pi))
        axes.set(
            xlim=_ends(phase_lag / math.pi),
            ylim=_ends(amplitude_angle / math.pi),
            ylabel=r"amplitude angle $\phi_L$ (rad)",
        )
        if axes.get_legend_handles_labels()[0]:
            axes.legend(**_ABOVE)
    panels[-1].set_xlabel(r"phase lag $\theta$ (rad)")
    return figure


def _map(
    figure: Figure, axes: Any, lags: Floats, angles: Floats, values: Floats, name: str, letter: str
) -> None:
    title, unit, colours, step = _MEASURES[name]
    x, y, z = lags / math.pi, angles / math.pi, values.T
    known = np.isfinite(z)
    top = float(np.abs(z[known]).max(initial=0.0)) or 1.0  # nothing turns, or nothing leaves
    norm = None if name == "efficiency" else TwoSlopeNorm(0.0, -top, top)
    axes.set_facecolor(_STAYS)
    drawn = {"cmap": colours, "norm": norm, "rasterized": True}
    image = axes.pcolormesh(edges_of(x), edges_of(y), z, **drawn)
    step *= 10.0 ** max(0, math.ceil(math.log10(top / (_LINES * step))))
    levels = step * np.arange(-math.floor(top / step), math.floor(top / step) + 1)
    line = "white" if name == "efficiency" else "black"
    if min(z.shape) > 1 and known.any() and np.ptp(z[known]) > 0.0:
        lines = axes.contour(x, y, z, levels=levels, colors=line, linewidths=0.6, alpha=0.8)
        named = [v for v in lines.levels if round(v / step) % 2 == 0 and 0.0 < abs(v) < 0.75 * top]
        axes.clabel(lines, named, fmt=lambda v: f"{v:g}".replace("-", "−"), fontsize=7)
    caption = title if unit == "1" else f"{title} ({unit})"
    figure.colorbar(image, ax=axes, label=caption, pad=0.015)
    axes.set_title(f"({letter}) {title}", loc="left", fontsize=10)
    mark_in_pi(axes.xaxis, 0.5)
    mark_in_pi(axes.yaxis, 0.125)
    column = known[:, z.shape[1] // 2]
    begin = float(y[column][-1]) if column.any() else float(y[0])
    if not column[-1] and (y[-1] - begin > 0.02 or not column.any()):
        middle = 0.5 * (y[-1] + begin)
        text = r"the disk never leaves: $\Gamma \leq 1/\pi$"
        axes.text(0.5 * (x[0] + x[-1]), middle, text, ha="center", va="center", fontsize=8)


def _ends(values: Floats) -> tuple[float, float]:
    """What is shown of an axis: from value to value, or the cell of a single one."""
    ends = values if len(values) > 1 else edges_of(values)
    return float(ends[0]), float(ends[-1])


def _mark(axes: Any, best: Extreme, shown: tuple[float, float]) -> None:
    """A cross at the extreme and at its mirror images between two ends, whole at these too."""
    _, unit, *_ = _MEASURES[best.measure]
    size = getattr(best, best.measure)
    size = size if best.measure == "efficiency" else abs(size)
    unit = "" if unit == "1" else f" {unit}"
    lag = best.phase_lag / math.pi
    lag = 0.0 if abs(lag) < 5e-5 else lag
    label = rf"{size:.4g}{unit} at $\phi_L$ = {best.amplitude_angle / math.pi:.4f}π, $\theta$ = "
    label += "0, π" if lag == 0.0 else f"{lag:.4f}π, {lag + 1.0:.4f}π"
    x = lag + np.arange(-4.0, 5.0)
    x = x[(x >= shown[0]) & (x <= shown[1])]
    y = np.full_like(x, best.amplitude_angle / math.pi)
    axes.plot(x, y, "x", color="white", ms=9, mew=2.0, path_effects=_HALO, label=typeset(label),
              zorder=5, clip_on=False)  # fmt: skip


def _mark_ridge(axes: Any, ridge: Ridge) -> None:
    stuck = ridge.amplitude_angle <= ridge.end
    label = (
        rf"$|\nu| = 1$: $\theta = -\tau_{{sep}}$ (+ π) up to $\phi_L$ = {ridge.end / math.pi:.4f}π"
    )
    for shift in range(-4, 5):
        x = ridge.phase_lag / math.pi + shift
        y = ridge.amplitude_angle / math.pi
        halo = {"path_effects": _HALO, "label": label if shift == 0 else None}
        axes.plot(x[stuck], y[stuck], color="white", lw=1.6, zorder=4, **halo)


def pictures(study: TossMap, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    held = {name: result[name].values for name in Toss._fields if name in result}
    tosses = Toss(**{name: held.get(name, held["delay"]) for name in Toss._fields})
    lag, angle = result["phase_lag"].values, result["amplitude_angle"].values
    given = study.parameters
    lags, at = study.trajectory_lags, float(given["trajectory_angle"])
    never_leaves = math.isnan(separation_phase(at, study.setting))
    runs = [
        toss_trajectory(
            one, at, study.setting,
            angular_velocity=float(given["initial_angular_velocity"]),
            forcing_phase=float(given["initial_forcing_phase"]),
            duration=1.0 / study.setting.frequency if never_leaves else None,
        )
        for one in lags
    ]  # fmt: skip
    return {
        "toss_map": maps_figure(lag, angle, tosses, study.extremes, study.ridge()),
        "trajectories": trajectories_figure(runs, [toss_title(one, at) for one in lags]),
    }

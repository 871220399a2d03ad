"""Bifurcation diagrams: phases of impact over a parameter, mean speed and exponent beneath.

The phases are drawn as a density: each column is one value of the parameter, and the darkness of a
cell tells how many of its impacts fell there, so that bands and orbits of many impacts keep their
inner structure. The raster is at the resolution of the page, all else is vectors.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.bifurcation import Branch, sections_along
from bouncing_disk_ros.analysis.continuation import Doubling, existence_limit
from bouncing_disk_ros.analysis.next_collision import NextCollisionMap
from bouncing_disk_ros.plots.style import BLUE, GREEN, GREY, VERMILION, new_figure

Array = NDArray[np.float64]

LABELS = {
    "forcing": "axial forcing Γ (1)",
    "restitution": "restitution ε (1)",
    "phase_lag": "phase lag θ (rad)",
    "angular_forcing": "angular forcing Γ_T (1)",
}
SYMBOLS = {"forcing": "Γ", "restitution": "ε", "phase_lag": "θ", "angular_forcing": "Γ_T"}
_ROWS, _COLUMNS = 420, 800  # cells of the raster: not more than the pixels of a small PNG
_NAMED = 3  # doublings with their numbers; the next ones lie too close
_INK = LinearSegmentedColormap.from_list("ink", ["#d6e7f4", BLUE, "#001a33"])
_DECADES = 20.0  # Γ_T over more than this is drawn on a scale of logarithms
_BINS = 72  # of the circle, to find where it is emptiest


def bifurcation_figure(
    branch: Branch,
    section: NextCollisionMap,
    axis: str,
    doublings: Sequence[Doubling] = (),
    phases: tuple[float, float] | None = None,
) -> Figure:
    """Three panels over one parameter, as Fig. 3 of the paper, with the theory of period 1.

    `branch` is what `follow` or `from_starts` gave for `section` along `axis`; of several starts
    all are drawn. `doublings` are marked; `phases` is the range of τ shown, rad (default: what the
    impacts cover, cut where the circle is emptiest).
    """
    figure = new_figure(9.0, 9.0)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=[2.4, 1.0, 1.0])
    top, middle, bottom = panels
    low, high = phases or phase_range(branch)
    _phases(top, branch, low, high)
    _speed(middle, branch)
    _exponent(bottom, branch)
    _theory(top, middle, branch, section, axis, low)
    for axes in panels:
        _mark(axes, doublings, named=axes is top)
        axes.grid(visible=True, color="#dddddd", linewidth=0.5)
        axes.set_axisbelow(True)
    top.set_xlim(float(branch.values.min()), float(branch.values.max()))
    if axis == "angular_forcing" and branch.values.max() > _DECADES * branch.values.min():
        top.set_xscale("log")
    bottom.set_xlabel(LABELS[axis])
    figure.suptitle(_title(branch, section, axis), fontsize=12)
    return figure


def phase_range(branch: Branch) -> tuple[float, float]:
    """The part of the circle that the impacts cover, rad, with a margin; it may begin below 0."""
    tau = branch.forcing_phase[np.isfinite(branch.forcing_phase)] % math.tau
    if len(tau) == 0:
        return 0.0, math.tau
    counts = np.histogram(tau, _BINS, (0.0, math.tau))[0]
    around = sum(np.roll(counts, k) for k in range(-4, 5))
    cut = (float(np.argmin(around)) + 0.5) * math.tau / _BINS
    tau = cut + (tau - cut) % math.tau
    low, high = float(tau.min()), float(tau.max())
    if 0.5 * (low + high) > math.pi:
        low, high = low - math.tau, high - math.tau
    margin = max(0.04 * (high - low), 0.02)
    if high - low + 2.0 * margin >= math.tau:
        cut -= math.tau if cut > 0.5 * math.pi else 0.0  # period 1 has τ from 0 to π/2
        return cut, cut + math.tau
    return low - margin, high + margin


def density(branch: Branch, low: float, high: float, rows: int = _ROWS) -> Array:
    """Share of the impacts at each value (columns, n) in each cell of τ (rows) from low to high."""
    counts = np.zeros((rows, len(branch.values)))
    tau = low + np.mod(branch.forcing_phase - low, math.tau)
    for column, here in enumerate(tau):
        here = here[np.isfinite(here) & (here <= high)]
        cells = np.minimum(((here - low) / (high - low) * rows).astype(int), rows - 1)
        np.add.at(counts[:, column], cells, 1.0)
    return counts / math.prod(branch.forcing_phase.shape[1:])


def edges_of(values: Array) -> Array:
    """Borders (n + 1,) of the cells about rising values (n,)."""
    if len(values) == 1:
        return np.array([values[0] - 0.5, values[0] + 0.5])
    middles = 0.5 * (values[1:] + values[:-1])
    first, last = 2.0 * values[0] - middles[0], 2.0 * values[-1] - middles[-1]
    return np.concatenate([[first], middles, [last]])


def _phases(axes: Any, branch: Branch, low: float, high: float) -> None:
    order = np.argsort(branch.values)
    shares = density(branch, low, high)[:, order]
    together = math.ceil(len(order) / _COLUMNS)  # neighbours in one column
    starts = np.arange(0, len(order), together)
    shares = np.add.reduceat(shares, starts, axis=1) / np.diff(starts, append=len(order))
    least = 1.0 / math.prod(branch.forcing_phase.shape[1:])
    edges = edges_of(branch.values[order])[[*starts, len(order)]]
    axes.pcolormesh(
        edges, np.linspace(low, high, _ROWS + 1),
        np.ma.masked_equal(shares, 0.0), cmap=_INK, norm=LogNorm(min(least, 0.1), 1.0),
        rasterized=True, zorder=2.5,
    )  # fmt: skip
    axes.set_ylim(low, high)
    axes.yaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 2.5, 5, 10]))
    axes.set_ylabel("forcing phase at impact τ (rad)")
    turns = axes.secondary_yaxis("right", functions=(_to_pi, _from_pi))
    turns.yaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:.2f} π".replace("-", "−")))


def _to_pi(x: Array) -> Array:
    return np.asarray(x) / math.pi


def _from_pi(x: Array) -> Array:
    return np.asarray(x) * math.pi


def _speed(axes: Any, branch: Branch) -> None:
    for j in range(branch.mean_speed.shape[1]):
        axes.plot(branch.values, branch.mean_speed[:, j], color=BLUE, lw=1.2,
                  label="mean in time" if j == 0 else None)  # fmt: skip
    axes.set_ylabel("mean speed α̇ / (ωΦ) (1)")


def _exponent(axes: Any, branch: Branch) -> None:
    """Finite exponents as a line; values with contact as marks at the lower border."""
    axes.axhline(0.0, color="black", lw=0.8)
    for j in range(branch.lyapunov_exponent.shape[1]):
        exponent = branch.lyapunov_exponent[:, j]
        contact = np.isneginf(exponent)
        axes.plot(branch.values, np.where(contact, math.nan, exponent), color=VERMILION, lw=1.2)
        if contact.any():
            places = branch.values[contact]
            axes.plot(places, np.zeros(len(places)), "|", color=GREY, ms=7, clip_on=False,
                      transform=axes.get_xaxis_transform(),
                      label="with contact: −∞" if j == 0 else None)  # fmt: skip
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=9)
    axes.set_ylabel("Lyapunov exponent\nper impact (1)")


def _theory(
    top: Any, middle: Any, branch: Branch, section: NextCollisionMap, axis: str, low: float
) -> None:
    """The period-1 orbit, stable or not: cos τ = (1 − ε)/((1 + ε)Γ), speed cos(τ + θ) (eq. 4)."""
    values = np.linspace(branch.values.min(), branch.values.max(), 400)
    sections = sections_along(section, axis, values)
    ratio = [existence_limit(s.restitution) / s.forcing if s.forcing > 0 else 2.0 for s in sections]
    phase = np.arccos(np.where(np.array(ratio) <= 1.0, ratio, math.nan))
    lag = np.array([s.phase_lag for s in sections])
    shown = low + np.mod(phase - low, math.tau)
    style = {"color": VERMILION, "lw": 1.0, "ls": (0, (5, 4)), "zorder": 2.0}
    top.plot(values, shown, **style, label="period 1: cos τ = (1 − ε)/((1 + ε) Γ)")
    top.legend(loc="upper left", fontsize=9)
    if math.isfinite(section.angular_forcing) or axis == "angular_forcing":
        middle.plot(values, np.cos(phase + lag), **style, label="period 1: cos(τ + θ) (eq. 4)")
        middle.legend(loc="lower left", fontsize=9)


def _mark(axes: Any, doublings: Sequence[Doubling], named: bool) -> None:
    for k, point in enumerate(doublings):
        axes.axvline(point.value, color=GREEN, lw=0.7, alpha=0.8, zorder=1.2)
        if named and k < _NAMED:
            text = axes.annotate(
                f"{point.impacts}→{2 * point.impacts}: {point.value:.6f}", (point.value, 0.02),
                xycoords=("data", "axes fraction"), xytext=(-1, 0), textcoords="offset points",
                ha="right", va="bottom", rotation=90, fontsize=8, color=GREEN,
                annotation_clip=True,
            )  # fmt: skip
            text.set_in_layout(False)


def _title(branch: Branch, section: NextCollisionMap, axis: str) -> str:
    fixed = [
        f"{symbol} = {getattr(section, name):g}" for name, symbol in SYMBOLS.items() if name != axis
    ]
    if math.isinf(section.angular_forcing) and axis != "angular_forcing":
        fixed[-1] = "no friction"
    way = "downward" if branch.values[-1] < branch.values[0] else "upward"
    text = f"Attractor followed {way} in {SYMBOLS[axis]}; {', '.join(fixed)}"
    return text.replace("-", "−")

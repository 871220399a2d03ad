"""Bifurcation diagrams: phases of impact over a parameter, speeds and exponent beneath.

The phases are drawn as a density: each column is one value of the parameter, and the darkness of a
cell shows how many of its impacts fell there, so that bands and orbits of many impacts keep their
inner structure. The raster is at the resolution of the page, all else is vectors.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import Colormap, LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bouncing_disk_ros.angles import wrap_to_pi
from bouncing_disk_ros.colours import BLACK, BLUE, GREEN, PURPLE, VERMILION
from bouncing_disk_ros.maps.bifurcation_diagram import Branch, sections_along
from bouncing_disk_ros.maps.bifurcations import Doubling
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.period_one import existence_limit
from bouncing_disk_ros.maps.scales import MAP_PARAMETERS
from bouncing_disk_ros.matplotlib_figures import (
    edges_of,
    light_grid,
    name_axis,
    new_figure,
    typeset,
)
from bouncing_disk_ros.study.bifurcation.compute import Bifurcation, branch_of
from bouncing_disk_ros.study.line_picture import few

Array = NDArray[np.float64]

_ROWS, _SPEED_ROWS, _COLUMNS = 320, 180, 720
"""Cells of the rasters: fewer than the pixels of the panels of a small PNG. Else some are lost."""
INK = LinearSegmentedColormap.from_list("ink", ["#d6e7f4", BLUE, "#001a33"])
CONTACT_INK = LinearSegmentedColormap.from_list("contact", ["#fbe3d3", VERMILION, "#4d2000"])
LOWER_INK = LinearSegmentedColormap.from_list("lower", ["#f0cfe1", PURPLE, "#3d0a26"])
UPPER_INK = LinearSegmentedColormap.from_list("upper", ["#c6eadf", GREEN, "#00261b"])
_ON_THE_ORBIT = 1e-6  # rad: nearer to period 1, an impact belongs to no branch
_DECADES = 20.0  # Γ_T over more than this is drawn on a scale of logarithms
_BINS = 72  # of the circle, to find where it is emptiest


def bifurcation_figure(
    branch: Branch,
    section: NextCollisionMap,
    axis: str,
    doublings: Sequence[Doubling] = (),
    phases: tuple[float, float] | None = None,
    *,
    followed: bool | None = None,
    onset: float = math.nan,
    marks: Sequence[float] = (),
) -> Figure:
    """Bifurcation diagram as Fig. 3 of the paper, with the theory of period 1, and the exponent.

    Panels: (a) phase and (c) speed of the impacts, (b) mean speed of the disk. The branches of (c)
    are those of (a) below and above the period-1 orbit.

    `branch` is what `follow` or `from_starts` gave for `section` along `axis`. `doublings` are
    marked; `phases` is the range of τ shown, rad (default: what the impacts cover, cut where the
    circle is emptiest). A branch that was not `followed` (default: one of several starts) is drawn
    as points; starts that end with contact have another colour. `onset` is the value at which the
    attractor followed first comes to contact (nan: nowhere).

    >>> from bouncing_disk_ros.maps.bifurcation_diagram import follow
    >>> section, values = NextCollisionMap(0.34, 0.5), np.linspace(0.34, 0.56, 20)
    >>> branch = follow(section, "axial_forcing", values, settling=200, measured=100, kept=50)
    >>> bifurcation_figure(branch, section, "axial_forcing")
    """
    followed = branch.mean_speed.shape[1] == 1 if followed is None else followed
    figure = new_figure(9.0, 11.0)
    panels = figure.subplots(4, 1, sharex=True, height_ratios=[2.4, 1.0, 1.4, 1.0])
    top, middle, hits, bottom = panels
    low, high = phases or phase_range(branch)
    with_contact = branch.contacts > 0.0
    _phases(top, _only(branch, ~with_contact), low, high, INK)
    if with_contact.any():
        _phases(top, _only(branch, with_contact), low, high, CONTACT_INK)
        _legend_of_contact(top, with_contact, followed)
    top.set_ylim(low, high)
    name_axis(top.yaxis, {"units": "rad"}, "forcing phase at impact τ")
    _speed(middle, branch, with_contact, followed)
    _impact_speeds(hits, branch, section, axis)
    _exponent(bottom, branch, followed)
    _theory(top, middle, branch, section, axis, low)
    _mark(panels, doublings, onset)
    _letters(panels, marks, branch.values)
    # above the panel: within it, it would cover a branch at some restitutions
    top.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=8, frameon=False)
    if followed and len(middle.get_legend_handles_labels()[0]) > 1:
        middle.legend(loc="best", fontsize=9)
    for axes in panels:
        light_grid(axes)
    ends = branch.values if len(branch.values) > 1 else edges_of(branch.values)
    top.set_xlim(float(ends.min()), float(ends.max()))
    if axis == "angular_forcing" and branch.values.max() > _DECADES * branch.values.min():
        top.set_xscale("log")
    symbol, unit = MAP_PARAMETERS[axis]
    name_axis(bottom.xaxis, {"units": unit}, f"{axis.replace('_', ' ')} {symbol}")
    figure.suptitle(_title(branch, section, axis, followed), fontsize=12)
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
    return _shares(low + np.mod(branch.forcing_phase - low, math.tau), low, high, rows)


def _shares(places: Array, low: float, high: float, rows: int) -> Array:
    """Share of the numbers (n, ...) of each of n columns in each cell (rows) from low to high."""
    counts = np.zeros((rows, len(places)))
    for column, here in enumerate(places):
        here = here[np.isfinite(here) & (here >= low) & (here <= high)]
        cells = np.minimum(((here - low) / (high - low) * rows).astype(int), rows - 1)
        np.add.at(counts[:, column], cells, 1.0)
    return counts / math.prod(places.shape[1:])


def _only(branch: Branch, chosen: NDArray[np.bool_]) -> Branch:
    """The impacts of some starts (n, m) alone."""
    return branch._replace(
        forcing_phase=np.where(chosen[..., None], branch.forcing_phase, math.nan)
    )


def _phases(axes: Any, branch: Branch, low: float, high: float, ink: Colormap) -> None:
    _raster(axes, branch, density(branch, low, high), (low, high), ink)


def _raster(
    axes: Any, branch: Branch, shares: Array, ends: tuple[float, float], ink: Colormap
) -> None:
    """Draw the shares of cells (rows, n) between two ends, over the values of a branch."""
    order = np.argsort(branch.values)
    shares = shares[:, order]
    together = math.ceil(len(order) / _COLUMNS)  # neighbours in one column
    starts = np.arange(0, len(order), together)
    shares = np.add.reduceat(shares, starts, axis=1) / np.diff(starts, append=len(order))
    least = 1.0 / math.prod(branch.forcing_phase.shape[1:])
    edges = edges_of(branch.values[order])[[*starts, len(order)]]
    axes.pcolormesh(
        edges, np.linspace(*ends, len(shares) + 1),
        np.ma.masked_equal(shares, 0.0), cmap=ink, norm=LogNorm(min(least, 0.1), 1.0),
        rasterized=True, zorder=2.5,
    )  # fmt: skip


def _style(followed: bool, color: str, shown: Array) -> dict[str, Any]:
    """A line through what was followed, with its points where they are few; points of starts."""
    if followed:
        return {"color": color, "lw": 1.2, "marker": "." if few(shown) else ""}
    return {"color": color, "ls": "", "marker": ".", "ms": 2.0, "rasterized": True}


def _speed(axes: Any, branch: Branch, with_contact: NDArray[np.bool_], followed: bool) -> None:
    for chosen, color in ((~with_contact, BLUE), (with_contact, VERMILION)):
        if chosen.any():
            shown = np.where(chosen, branch.mean_speed, math.nan)
            lines = axes.plot(branch.values, shown, **_style(followed, color, shown))
            lines[0].set_label("mean in time" + (", with contact" if color == VERMILION else ""))
    axes.set_ylabel("mean speed\nα̇ / (ωΦ)")


def _impact_speeds(axes: Any, branch: Branch, section: NextCollisionMap, axis: str) -> None:
    """|w_A| of the impacts, those before and after the period-1 orbit's phase in two inks."""
    speed = -branch.axial_impact_velocity
    known = np.isfinite(speed)
    top = 1.05 * (float(speed[known].max()) if known.any() else 1.0)
    phase, _ = _period_one(branch.values, section, axis)
    apart = wrap_to_pi(branch.forcing_phase - phase[:, None, None])
    inks = (
        (apart < -_ON_THE_ORBIT, LOWER_INK, "impacts earlier than period 1: the lower branch"),
        (apart > _ON_THE_ORBIT, UPPER_INK, "impacts later than period 1: the upper branch"),
        (~(np.abs(apart) > _ON_THE_ORBIT), INK, "on the period-1 orbit, or where there is none"),
    )
    for chosen, ink, label in inks:
        if not (chosen & known).any():
            continue
        shares = _shares(np.where(chosen, speed, math.nan), 0.0, top, _SPEED_ROWS)
        _raster(axes, branch, shares, (0.0, top), ink)
        axes.plot([], [], "s", color=ink(0.5), ms=5, label=label)
    axes.set_ylim(0.0, top)
    axes.set_ylabel(typeset("impact speed\n|w_A| (πg/ω)"))
    if known.any():
        axes.legend(loc="lower left", fontsize=8)


def _exponent(axes: Any, branch: Branch, followed: bool) -> None:
    """Finite exponents; values with contact as marks at the lower border."""
    axes.axhline(0.0, color="black", lw=0.8)
    contact = np.isneginf(branch.lyapunov_exponent)
    finite = np.where(contact, math.nan, branch.lyapunov_exponent)
    axes.plot(branch.values, finite, **_style(followed, BLUE, finite))
    places = branch.values[contact.any(axis=1)]
    if len(places):
        axes.plot(places, np.zeros(len(places)), "|", color=VERMILION, ms=7,
                  clip_on=False, transform=axes.get_xaxis_transform(),
                  label="with contact: −∞")  # fmt: skip
        axes.legend(fontsize=9)
    axes.set_ylabel("Lyapunov exponent\nper impact")


def _theory(
    top: Any, middle: Any, branch: Branch, section: NextCollisionMap, axis: str, low: float
) -> None:
    """The period-1 orbit, stable or not: cos τ = (1 − ε)/((1 + ε)Γ), speed cos(τ + θ) (eq. 4)."""
    values = np.linspace(branch.values.min(), branch.values.max(), 400)
    phase, lag = _period_one(values, section, axis)
    shown = low + np.mod(phase - low, math.tau)
    style: dict[str, Any] = {"color": BLACK, "lw": 1.0, "ls": (0, (5, 4)), "zorder": 2.0}
    if values[0] == values[-1]:
        style |= {"ls": "", "marker": "+", "ms": 9, "zorder": 3.0}  # a line would have no length
    top.plot(values, shown, **style, label="period 1, theory: cos τ = (1 − ε)/((1 + ε) Γ)")
    if math.isfinite(section.angular_forcing) or axis == "angular_forcing":
        middle.plot(
            values, np.cos(phase + lag), **style, label="period 1, theory: cos(τ + θ) (eq. 4)"
        )


def _period_one(values: Array, section: NextCollisionMap, axis: str) -> tuple[Array, Array]:
    """τ of the period-1 orbit, nan where there is none, and θ at each value (n,)."""
    sections = sections_along(section, axis, values)
    ratio = [
        existence_limit(s.restitution) / s.axial_forcing if s.axial_forcing > 0 else 2.0
        for s in sections
    ]
    phase = np.arccos(np.where(np.array(ratio) <= 1.0, ratio, math.nan))
    return phase, np.array([s.phase_lag for s in sections])


def _legend_of_contact(axes: Any, with_contact: NDArray[np.bool_], followed: bool) -> None:
    """Names of the two inks, those that are there."""
    what = "orbits" if followed else "starts that end"
    if not with_contact.all():
        axes.plot([], [], "s", color=BLUE, ms=5, label=f"{what} without contact")
    axes.plot([], [], "s", color=VERMILION, ms=5, label=f"{what} with contact")


def _mark(panels: Sequence[Any], doublings: Sequence[Doubling], onset: float) -> None:
    """Lines through all panels, named in the legend of the first: where an orbit changes."""
    for axes in panels:
        for point in doublings:
            axes.axvline(point.value, color=GREEN, lw=0.7, alpha=0.8, zorder=1.2)
        if not math.isnan(onset):
            axes.axvline(onset, color=PURPLE, lw=1.4, zorder=2.6)
    for point in doublings:
        name = f"period {point.impacts} → {2 * point.impacts} at {point.value:.6f}"
        panels[0].plot([], [], color=GREEN, lw=0.9, label=name)
    if not math.isnan(onset):
        label = f"first contact at {onset:.6f}: another attractor from here on"
        panels[0].plot([], [], color=PURPLE, lw=1.4, label=label)


def _letters(panels: Sequence[Any], marks: Sequence[float], values: Array) -> None:
    """Name the panels of the paper's Fig. 3, and mark in the first the values on its axis."""
    for letter, axes in zip("abc", panels, strict=False):
        axes.annotate(  # left of the longest number at a tick, above the label of the axis
            f"({letter})", (0.0, 1.0), (-52.0, 0.0), xycoords="axes fraction",
            textcoords="offset points", ha="right", va="top", fontsize=11,
        )  # fmt: skip
    top, box = panels[0], {"fc": "white", "ec": "none", "pad": 1}
    for letter, value in zip("abcdefghijklmnopqrstuvwxyz", marks, strict=False):
        if not values.min() <= value <= values.max():
            continue
        place = {"xycoords": top.get_xaxis_transform(), "ha": "center", "bbox": box}
        top.axvline(value, color=BLACK, lw=0.6, ls=":", zorder=1.2)
        top.annotate(letter, (value, 0.02), fontsize=11, fontweight="bold", **place)


def _title(branch: Branch, section: NextCollisionMap, axis: str, followed: bool) -> str:
    fixed = [
        f"{of.symbol} = {getattr(section, name):g}"
        for name, of in MAP_PARAMETERS.items()
        if name != axis
    ]
    if math.isinf(section.angular_forcing) and axis != "angular_forcing":
        fixed[-1] = "no friction"
    way = "downward" if branch.values[-1] < branch.values[0] else "upward"
    what = f"Attractor followed {way} in"
    if not followed:
        starts = branch.mean_speed.shape[1]
        what = f"Attractors reached from {starts} start{'s' if starts > 1 else ''} at each"
    text = f"{what} {MAP_PARAMETERS[axis].symbol}; {', '.join(fixed)}"
    return typeset(text.replace("-", "−"))


def pictures(study: Bifurcation, result: xr.Dataset) -> Mapping[str, Figure]:
    """All figures of a result, by the names of their files; the first one is published."""
    branch, section = branch_of(result), study.section()
    along = (study.axis, study.doublings)
    onset = float(result["contact_onset"]) if "contact_onset" in result else math.nan
    figure = bifurcation_figure(
        branch, section, *along, followed=study.sequential, onset=onset, marks=study.marks
    )
    return {"bifurcation": figure}

"""The figure of the geometry: platform, disk, and what is measured where (docs/model.md)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Arc, Circle, Rectangle

from bouncing_disk_ros.colours import DISK, INK, PLATFORM
from bouncing_disk_ros.matplotlib_figures import mark_in_pi, new_figure, typeset

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PHASE = 0.7366240020191286
"""Forcing phase of the impacts of the preset pizza_multiple_toss, rad; its phase lag is −PHASE."""


def geometry_figure() -> Figure:
    """Side view, top view, and one period of the motion."""
    figure = new_figure(11.0, 7.6)
    panels: Any = figure.subplot_mosaic(
        [["side", "top"], ["time", "time"]], height_ratios=[1.5, 1.0], width_ratios=[1.0, 1.05]
    )
    _side(panels["side"])
    _top(panels["top"])
    _time(panels["time"])
    return figure


def _arrow(axes: Any, begin: tuple[float, float], end: tuple[float, float], **style: Any) -> None:
    shape = {"arrowstyle": "<->", "shrinkA": 0, "shrinkB": 0, "color": INK, **style}
    axes.annotate("", xy=end, xytext=begin, arrowprops=shape)


def _bare(axes: Any, title: str) -> None:
    axes.set_title(title, loc="left")
    axes.set_aspect("equal")
    axes.axis("off")


def _side(axes: Any) -> None:
    """Heights, all from the mean height of the platform, up."""
    _bare(axes, "from the side: heights (m, up)")
    for level, text in ((0.0, "mean height, 0"), (0.5, "A"), (-0.5, "−A")):
        axes.plot([-1.7, 1.35], [level, level], ls=":", lw=1, color=INK)
        axes.text(1.4, level, text, va="center", color=INK)
    axes.add_patch(Rectangle((-1.0, 0.18), 2.0, 0.12, color=PLATFORM))
    axes.text(0.0, -0.08, "platform", color=PLATFORM, ha="center", va="top")
    axes.add_patch(Rectangle((-0.8, 1.1), 1.6, 0.12, color=DISK))
    axes.text(0.0, 1.27, "disk, mass m", color=DISK, ha="center")
    _arrow(axes, (-1.55, 0.0), (-1.55, 0.3), color=PLATFORM)
    axes.text(-1.6, 0.15, "s = A sin ωt", color=PLATFORM, ha="right", va="center")
    _arrow(axes, (-1.25, 0.0), (-1.25, 1.1), color=DISK)
    axes.text(-1.3, 0.7, "x", color=DISK, ha="right", va="center")
    axes.plot([-1.7, -1.0], [0.3, 0.3], lw=0.7, color=PLATFORM)
    axes.plot([-1.4, -0.8], [1.1, 1.1], lw=0.7, color=DISK)
    _arrow(axes, (0.0, 0.3), (0.0, 1.1))
    gap = typeset("gap x − s ≥ 0\nw_A = ẋ − ṡ\nat an impact")
    axes.text(0.06, 0.78, gap, va="center", color=INK, bbox={"color": "white", "pad": 1})
    _arrow(axes, (1.15, 1.45), (1.15, 0.85), arrowstyle="->")
    axes.text(1.2, 1.15, "g + P/m", va="center", color=INK)
    axes.set(xlim=(-2.6, 2.3), ylim=(-0.65, 1.6))


def _top(axes: Any) -> None:
    """Angles about the axis, positive counterclockwise as seen from above; radii of the disk."""
    _bare(axes, "from above: angles (rad, counterclockwise), radii (m)")
    axes.add_patch(Circle((0.0, 0.0), 1.25, color=PLATFORM, alpha=0.18))
    axes.add_patch(Circle((0.0, 0.0), 1.0, color=DISK, alpha=0.25))
    radii = (
        (0.8, "--", "a_e: friction acts here", -0.62, -0.52),
        (0.707, ":", "a_g: radius of gyration", -1.0, -0.76),
    )
    for radius, dashes, text, place, level in radii:
        axes.add_patch(Circle((0.0, 0.0), radius, fill=False, ls=dashes, lw=1.5, color=DISK))
        tip = (radius * math.cos(place), radius * math.sin(place))
        axes.annotate(
            typeset(text), xy=tip, xytext=(1.4, level), color=DISK, va="center",
            arrowprops={"arrowstyle": "-", "color": DISK, "lw": 0.7},
        )  # fmt: skip
    axes.plot([0.0, 1.45], [0.0, 0.0], ls=":", lw=1, color=INK)
    axes.text(1.5, 0.0, "angle 0", va="center", color=INK)
    marks = ((25.0, 1.25, PLATFORM, "β = Φ sin(ωt + θ)", 1.12), (100.0, 1.0, DISK, "α", 0.5))
    for angle, length, color, text, arc in marks:
        end = math.radians(angle)
        axes.plot([0.0, length * math.cos(end)], [0.0, length * math.sin(end)], lw=2, color=color)
        axes.add_patch(Arc((0.0, 0.0), 2 * arc, 2 * arc, theta2=angle, lw=1.2, color=color))
        half = 0.5 * end
        where = (arc + 0.06) * math.cos(half), (arc + 0.06) * math.sin(half)
        if color == PLATFORM:
            where = 1.4, 0.45
        axes.text(*where, text, color=color)
    axes.text(-1.2, 1.15, typeset("w_T = α̇ − β̇"), color=INK, ha="right")
    axes.set(xlim=(-2.1, 3.0), ylim=(-1.35, 1.35))


def _time(axes: Any) -> None:
    """One period: s, β, the phase lag between them, and the phases that have names."""
    axes.set_title("one period of the platform: the forcing phase τ = ωt modulo 2π", loc="left")
    turns = np.linspace(0.0, 2.0, 400)  # τ/π
    tau = math.pi * turns
    axes.plot(turns, np.sin(tau), color=PLATFORM, lw=2, label="s/A, axial")
    axes.plot(turns, np.sin(tau - PHASE), color=PLATFORM, lw=2, ls="--", label="β/Φ, angular")
    crests = 0.5, 0.5 + PHASE / math.pi
    _arrow(axes, (crests[0], 1.12), (crests[1], 1.12))
    lag = typeset("θ < 0: the angular motion lags, here by τ_imp")
    axes.text(0.5 * sum(crests), 1.2, lag, ha="center", color=INK)
    for place, height, text in (
        (PHASE / math.pi, -0.45, "τ_imp: impacts of the period-1\norbit; β̇ is largest there"),
        (1.5, 0.35, "3π/2: lowest point,\nwhere a toss from rest starts"),
    ):
        axes.axvline(place, color=DISK, lw=1, ls=":")
        axes.plot([place], [math.sin(math.pi * place)], "o", color=DISK)
        axes.text(place + 0.02, height, typeset(text), color=DISK, va="center")
    axes.set(xlim=(0.0, 2.0), ylim=(-1.15, 1.45), xlabel="forcing phase τ (rad)")
    mark_in_pi(axes.xaxis)
    axes.legend(loc="lower center")

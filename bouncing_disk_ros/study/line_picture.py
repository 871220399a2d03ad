"""Attractors along an axis as lines: their colours, shares and legend."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from bouncing_disk_ros.colours import ATTRACTORS, BLACK, GREY

STRONG = 6
"""So many attractors with the largest shares have a colour; all others are grey."""
_WHOLE = {"clip_on": False, "in_layout": False}
"""Dots at the ends of an axis are drawn whole; they move no panel."""


def line_colours(result: xr.Dataset) -> list[str]:
    """One colour for each line: black with contact, strong for the largest others, else grey."""
    names = [str(name) for name in result["line_name"].values]
    largest = np.nanmax(result["line_share"].values, axis=1) if names else np.empty(0)
    colors = [GREY] * len(names)
    strong = iter(ATTRACTORS[:STRONG])
    for i in np.argsort(-largest, kind="stable"):
        if names[i].split()[0].rstrip("…") in ("chattering", "rest"):
            colors[i] = BLACK
        elif (color := next(strong, None)) is not None:
            colors[i] = color
    return colors


def draw_shares(axes: Any, result: xr.Dataset, x: NDArray[np.float64], colors: list[str]) -> None:
    """Shares without contact of each line, and of the starts that come to contact."""
    for i, color in enumerate(colors):
        if color == BLACK:
            continue
        share = 100.0 * result["line_share_without_contact"].values[i]
        dot = "." if few(share) else ""
        axes.plot(x, share, "-", color=color, lw=1.4, marker=dot, **_WHOLE)
    contact = 100.0 * result["share_in_contact"].values
    axes.plot(x, contact, "-", color=BLACK, lw=1.4, marker="." if few(contact) else "")
    _mark_ends_of_contact(axes, result, x, contact, colors)
    axes.set_ylim(0.0, 103.0)  # a share of 100 % is seen beside the frame
    axes.set_ylabel("share of starts (%)")
    axes.set_title("starts that come to contact (black), and those that reach an attractor without",
                   fontsize=9)  # fmt: skip


def _mark_ends_of_contact(
    axes: Any, result: xr.Dataset, x: NDArray[np.float64], contact: NDArray[np.float64],
    colors: list[str],
) -> None:  # fmt: skip
    """Marks where the orbit that leaves contact ends on another attractor, in its colour."""
    for i, color in enumerate(colors):
        if color == BLACK:
            continue
        ends = _ends_of_contact(result, i)
        axes.plot(x[ends], contact[ends], "o", color=color, ms=5, mec=BLACK, mew=0.5, **_WHOLE)


def _ends_of_contact(result: xr.Dataset, line: int) -> NDArray[np.bool_]:
    """Where along the axis starts that come to contact end on a line."""
    share, direct = (result[f"line_{n}"].values[line] for n in ("share", "share_without_contact"))
    return np.asarray(share - direct > 1e-9)


def few(values: NDArray[np.float64]) -> bool:
    """Whether a line would not be seen: single values between missing ones."""
    known = np.isfinite(values)
    return bool(known.any() and known.sum() <= 3)


def line_legend(figure: Figure, result: xr.Dataset, colors: list[str]) -> None:
    """What the colours are, beneath the panels."""
    names = [str(name) for name in result["line_name"].values]
    contact = ", ".join(n for n, color in zip(names, colors, strict=True) if color == BLACK)
    handles = [Line2D([], [], color=BLACK, label=contact)] if contact else []
    handles += [
        Line2D([], [], color=color, label=name)
        for name, color in zip(names, colors, strict=True)
        if color not in (GREY, BLACK)
    ]
    if GREY in colors:
        handles.append(Line2D([], [], color=GREY, label="others"))
    if any(_ends_of_contact(result, i).any() for i, c in enumerate(colors) if c != BLACK):
        handles.append(Line2D([], [], marker="o", ls="", color="white", mec=BLACK,
                              label="contact leads to the attractor of this colour"))  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=2, fontsize=9, frameon=False)

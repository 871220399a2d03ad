"""The window of a side view of the disk, on the page and in animations.

It is to scale where that shows the motion; else heights are magnified.
"""

from __future__ import annotations

import math
from typing import NamedTuple

MARGIN = 1.15
"""The picture is so much wider than the disk."""
STILL = 1e-6
"""A motion of less than this part of the disk's diameter is none: nothing is magnified."""
LEAST_SHARE = 0.08
"""Of the window's height the motion fills this at least; below, heights are magnified."""


class SideWindow(NamedTuple):
    """Ranges of the side view, m. `magnification` of heights against widths; 1: to scale."""

    half_width: float
    low: float
    high: float
    magnification: float


def nice_above(value: float) -> float:
    """The smallest of 1, 2, 5 × a power of ten that is not below a value > 0."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= value * (1 - 1e-9))


def side_window(diameter: float, low: float, high: float, aspect: float) -> SideWindow:
    """A window that holds the disk's diameter and heights from `low` to `high`, all in m.

    `aspect`: height over width of the picture. To scale where the motion then fills LEAST_SHARE of
    the height or more; else heights are magnified by 1, 2 or 5 × a power of ten.
    """
    span = max(high - low, 1e-12 * diameter, 1e-300)
    width = MARGIN * diameter
    needed = 1.3 * span
    if needed > width * aspect:  # the motion is higher than the picture of the disk is wide
        height = nice_above(needed)
        width, magnification = height / aspect, 1.0
    else:
        magnification = 1.0
        if STILL * diameter < needed < LEAST_SHARE * width * aspect:
            magnification = nice_above(0.35 * width * aspect / needed) / 2.0
        height = width * aspect / magnification
    middle = 0.5 * (low + high)
    step = height / 10.0
    middle = round(middle / step) * step
    return SideWindow(0.5 * width, middle - 0.5 * height, middle + 0.5 * height, magnification)

"""Picture of a comparison with a reference case."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from bouncing_disk_ros.colours import BLUE, GREY, VERMILION
from bouncing_disk_ros.matplotlib_figures import light_grid, new_figure


def error_picture(
    found: NDArray[np.float64], missed: list[int], tolerance: float, title: str
) -> Figure:
    """The errors of time over the number of the event, with the events that are missed.

    `found` has a row for each event that is there: its number, the error (s), its condition.
    """
    figure = new_figure(8.0, 4.5)
    axes = figure.subplots()
    numbers, errors, conditions = found.reshape(-1, 3).T
    shown = errors > 0.0
    axes.semilogy(numbers[shown], errors[shown], "o-", color=BLUE, label="error of the time")
    grows = shown & (conditions > 0.0)
    if grows.any():
        first = errors[grows][0] / conditions[grows][0]
        axes.semilogy(
            numbers[grows], first * conditions[grows], ":", color=GREY,
            label="the first error, grown by the condition number",
        )  # fmt: skip
    axes.axhline(tolerance, color=GREY, lw=1.0, label=f"tolerance, {tolerance:g} s")
    for i, number in enumerate(missed):
        label = "missed" if i == 0 else None
        axes.axvline(number, color=VERMILION, ls="--", lw=1.0, label=label)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("event")
    axes.set_ylabel("|theirs − reference| (s)")
    axes.set_title(title, fontsize=11)
    axes.legend(loc="best", fontsize=9)
    light_grid(axes)
    return figure

"""The picture of two runs says which is which, and where they part."""

from __future__ import annotations

from functools import cache
from typing import Any

from matplotlib.figure import Figure

from bouncing_disk_ros import simulate
from bouncing_disk_ros.colours import PLATFORM
from bouncing_disk_ros.report.comparison_picture import two_runs_picture
from bouncing_disk_ros.run.what_if import TwoRuns, changes_of, what_if
from bouncing_disk_ros.units import NS
from support.figure_boxes import flaws


@cache
def beside(**change: float) -> TwoRuns:
    run = simulate(8.0, preset="pizza_multiple_toss")
    return what_if(run.inputs, changes_of(change), 8 * NS)


def picture(runs: TwoRuns) -> Figure:
    return two_runs_picture(runs, "changed", "a title")


def texts(axes: Any) -> list[str]:
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_both_runs_are_in_every_panel() -> None:
    runs = beside(friction=0.2)
    figure = picture(runs)
    heights, speeds, section = figure.axes
    assert flaws(figure) == []
    colors = {str(line.get_label()): line.get_color() for line in heights.lines}
    assert colors["platform s"] == PLATFORM, "as in all figures"
    assert texts(heights) == ["platform s", "disk x, recorded", "disk x, changed"]
    assert texts(speeds) == texts(section) == ["recorded", "changed"]
    assert runs.divergence_time_ns is not None
    low, high = heights.get_xlim()
    assert low <= runs.divergence_time_ns / NS < high < 8.0
    assert "recorded period-1" in figure.get_suptitle()


def test_two_platforms_are_drawn_when_they_differ() -> None:
    same, other = picture(beside(friction=0.2)), picture(beside(frequency=3.2))
    count = [len(figure.axes[0].lines) for figure in (same, other)]
    assert count[1] == count[0] + 1


def test_runs_that_never_part_are_shown_whole() -> None:
    runs = beside(friction=0.2)._replace(divergence_time_ns=None, divergence=None)
    figure = picture(runs._replace(second=runs.first))
    assert "never part" in figure.axes[0].get_title()

"""The picture of two runs says which is which, and where they part."""

from __future__ import annotations

from typing import Any

import pytest
from matplotlib.figure import Figure

from bouncing_disk_ros import simulate
from bouncing_disk_ros.analysis.recorded.two_runs import Shown
from bouncing_disk_ros.plots.two_runs import two_runs_picture
from bouncing_disk_ros.run.clock import NS
from bouncing_disk_ros.run.what_if import changes_of, what_if


def picture(**change: float) -> tuple[Figure, float | None]:
    run = simulate(8.0, preset="pizza_multiple_toss")
    runs = what_if(run.inputs, changes_of(change), 8 * NS)
    first, second = (
        Shown(label, t.impacts, t.rows, t.samples, t.close, t.rotor_speed, t.steady_since)
        for label, t in (("recorded", runs.first), ("changed", runs.second))
    )
    parted = None if runs.parted_ns is None else runs.parted_ns / NS
    return two_runs_picture(first, second, parted, "a title"), parted


def texts(axes: Any) -> list[str]:
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_both_runs_are_in_every_panel() -> None:
    figure, parted = picture(friction=0.2)
    heights, speeds, section = figure.axes
    assert texts(heights) == ["disk x, recorded", "disk x, changed", "platform s"]
    assert texts(speeds) == texts(section) == ["recorded", "changed"]
    assert parted is not None
    low, high = heights.get_xlim()
    assert low <= parted < high < 8.0
    assert "recorded period-1" in figure.get_suptitle()


def test_two_platforms_are_drawn_when_they_differ() -> None:
    same, other = picture(friction=0.2)[0], picture(frequency=3.2)[0]
    count = [len(figure.axes[0].lines) for figure in (same, other)]
    assert count[1] == count[0] + 1


@pytest.mark.parametrize("change", [{}, {"restitution": 0.5}])
def test_runs_that_never_part_are_shown_whole(change: dict[str, float]) -> None:
    figure, parted = picture(**change)
    assert parted is None
    assert "never part" in figure.axes[0].get_title()

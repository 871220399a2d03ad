"""The picture of a run: axes with symbol and unit, theory beside data, also of an empty run."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Motion, MotionInForce
from bouncing_disk_ros.matplotlib_figures import save_picture
from bouncing_disk_ros.report.run_picture import run_picture
from bouncing_disk_ros.report.run_record import RunRecord
from bouncing_disk_ros.run.programmes import load_programme
from bouncing_disk_ros.run.simulate import simulate
from support.figure_boxes import flaws
from support.recorded import listened

PHASE = r"forcing phase at impact $τ_{\mathrm{imp}}$ (rad)"


@cache
def first_toss() -> RunRecord:
    """The demonstration without DDS, aligned by hand."""
    programme = load_programme("first_toss_to_period_1")
    result = simulate(
        15.0, preset="pizza_multiple_toss", programme="first_toss_to_period_1", sample_rate=50.0,
        initial_with_platform=True, initial_axial_velocity=0.0, axial_amplitude=0.0,
        angular_amplitude=0.0, phase_lag=0.0, initial_forcing_phase=1.77,
    )  # fmt: skip
    record = listened(result)
    start = Motion(0.0, 0.0, 3.0, 0.0)
    for at_ns, target in programme.targets(start):
        record.motions.append(MotionInForce(at_ns - 333_000_000, at_ns, start, target, 0, 0.0))
        start = target
    last = record.motions[-1]
    record.motions.append(last._replace(begin_ns=last.end_ns, start=last.target))
    return record


def test_panels_say_what_they_show() -> None:
    figure = run_picture(first_toss(), "a title")
    labels = {(axes.get_xlabel(), axes.get_ylabel()) for axes in figure.axes}
    assert labels == {
        ("simulated time t (s)", "height x, s (mm)"),
        ("simulated time t (s)", "angular velocity α̇ (rad/s)"),
        (PHASE, r"impact velocity $w_{\mathrm{A}}$/(πg/ω)"),
        ("simulated time t (s)", PHASE),
    }
    assert flaws(figure) == []
    assert figure.get_suptitle().startswith("a title\nat the end: axial forcing Γ = 0.450")
    assert figure.get_suptitle().endswith("orbit found: period-1")


def points(line: Line2D) -> NDArray[np.float64]:
    return np.column_stack([np.asarray(line.get_xdata()), np.asarray(line.get_ydata())])


def test_theory_is_drawn_where_the_points_end() -> None:
    _, speeds, section, phases = run_picture(first_toss(), "t").axes
    cross = next(line for line in section.lines if line.get_marker() == "+")
    dots = next(line for line in section.lines if line.get_marker() == "o")
    # x and y of the rows are float32
    assert points(dots)[-1] == pytest.approx(points(cross)[0], abs=1e-6)
    dashed = [
        line for axes in (speeds, phases) for line in axes.lines if line.get_linestyle() == "--"
    ]
    levels = [points(line)[0, 1] for line in dashed]
    assert levels == pytest.approx([6 * math.pi * 1.4531049057854113, math.acos(20.0 / 27.0)])


def test_samples_not_received_leave_a_gap_and_hide_no_impact() -> None:
    """A line from impact to impact would be one through the air, below the parabola."""
    record = first_toss()
    begin, end = (float(record.rows["time"][place]) for place in (0, 3))
    kept = [state for state in record.states if state.time > end]
    kept += [state for state in record.states if begin - 0.2 < state.time < begin]
    figure = run_picture(replace(record, states=sorted(kept)), "t")
    heights, speeds, _, phases = figure.axes
    for axes, name in ((heights, "disk x"), (heights, "platform s"), (speeds, "disk α̇")):
        (line,) = (line for line in axes.lines if line.get_label() == name)
        x, y = points(line).T
        joined = np.isfinite(y[1:]) & np.isfinite(y[:-1])
        assert np.diff(x)[joined].max() < 0.1, "samples are 0.02 s apart"
        assert (x < begin).any()
    assert all(axes.get_xlim()[0] <= begin for axes in (speeds, phases))


def test_a_run_without_anything_gives_an_empty_picture(tmp_path: Path) -> None:
    figure = run_picture(RunRecord(first_toss().disk), "empty")
    save_picture(figure, tmp_path / "new" / "empty.png")
    assert (tmp_path / "new" / "empty.png").stat().st_size > 10_000
    assert figure.get_suptitle() == "empty"

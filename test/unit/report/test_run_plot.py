"""The pictures of a run and of two runs, and the summary; also where nothing was heard."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from bouncing_disk_ros import simulate
from bouncing_disk_ros.colours import PLATFORM
from bouncing_disk_ros.core.model import Motion, MotionInForce
from bouncing_disk_ros.matplotlib_figures import save_picture
from bouncing_disk_ros.report.comparison_picture import two_runs_picture
from bouncing_disk_ros.report.run_picture import run_picture
from bouncing_disk_ros.report.run_record import (
    HealthReport,
    RunRecord,
)
from bouncing_disk_ros.report.run_summary import last_orbit, lines, summary_of
from bouncing_disk_ros.run.programmes import load_programme
from bouncing_disk_ros.run.session import motion_of
from bouncing_disk_ros.run.what_if import TwoRuns, changes_of, what_if
from bouncing_disk_ros.units import NS
from support.figure_boxes import flaws
from support.recorded import listened
from support.shown import legend_of

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


# --- two runs -------------------------------------------------------------------------------------
@cache
def beside(**change: float) -> TwoRuns:
    run = simulate(8.0, preset="pizza_multiple_toss")
    return what_if(run.inputs, changes_of(change), 8 * NS)


def picture(runs: TwoRuns) -> Figure:
    return two_runs_picture(runs, "changed", "a title")


def test_both_runs_are_in_every_panel() -> None:
    runs = beside(friction=0.2)
    figure = picture(runs)
    heights, speeds, section = figure.axes
    assert flaws(figure) == []
    colors = {str(line.get_label()): line.get_color() for line in heights.lines}
    assert colors["platform s"] == PLATFORM, "as in all figures"
    assert legend_of(heights) == ["platform s", "disk x, recorded", "disk x, changed"]
    assert legend_of(speeds) == legend_of(section) == ["recorded", "changed"]
    assert runs.divergence_time_ns is not None
    low, high = heights.get_xlim()
    assert low <= runs.divergence_time_ns / NS < high < 8.0
    assert "recorded period-1" in figure.get_suptitle()


def test_two_platforms_are_drawn_when_they_differ_and_runs_that_never_part_whole() -> None:
    same, other = picture(beside(friction=0.2)), picture(beside(frequency=3.2))
    count = [len(figure.axes[0].lines) for figure in (same, other)]
    assert count[1] == count[0] + 1
    runs = beside(friction=0.2)._replace(divergence_time_ns=None, divergence=None)
    figure = picture(runs._replace(second=runs.first))
    assert "never part" in figure.axes[0].get_title()


# --- the summary ----------------------------------------------------------------------------------
def a_run() -> RunRecord:
    """Ten seconds and a little on the period-1 orbit, as a listener would keep them."""
    result = simulate(10.1, preset="pizza_multiple_toss", sample_rate=20.0)
    record = listened(result)
    motion = motion_of(result.parameters)
    record.motions.append(MotionInForce(0, 0, motion, motion, 0, 0.0))
    record.health += [
        HealthReport(100.0, 1.0, 1e-5, 1e-4, 1e-3, 1e-16),
        HealthReport(108.0, 9.0, 3e-5, 2e-4, 5e-4, 2e-16),
    ]
    record.inputs = 1
    return record


def test_summary_of_a_period_one_run() -> None:
    record = a_run()
    summary = summary_of(record)
    assert summary.orbit.is_period_one
    assert summary.impacts == len(record.rows) == 31  # at 0, 1/3, ... 10 s
    assert summary.axial_forcing == pytest.approx(0.45, rel=1e-12)
    assert summary.rotor_speed == pytest.approx(summary.predicted_speed, rel=1e-12)
    assert summary.orbit.forcing_phases[0] == pytest.approx(summary.predicted_phase, abs=1e-9)
    assert summary.real_time_factor == 1.0
    assert summary.lateness == (2e-5, 2e-4, 1e-3)
    assert summary.residual == 2e-16
    assert (summary.lost, summary.inputs) == (0, 1)
    text = "\n".join(lines(summary))
    assert "orbit found               period-1: τ_imp 0.736624 rad (theory 0.736624)" in text
    assert "rotor speed               27.390382 rad/s" in text
    assert "p50 0.02 ms, p99 0.20 ms, largest 1.00 ms" in text


def test_nothing_heard_is_not_a_number() -> None:
    summary = summary_of(RunRecord(a_run().disk))
    assert summary.impacts == summary.inputs == 0
    assert not summary.orbit.impacts
    for value in (summary.rotor_speed, summary.predicted_speed, summary.real_time_factor):
        assert math.isnan(value)
    assert [line.split()[-2:] for line in lines(summary)].count(["not", "known"]) == 2


def test_impacts_before_the_last_change_of_motion_do_not_count_for_the_orbit() -> None:
    record = a_run()
    motion = record.motions[0].target
    fading = MotionInForce(8_500_000_000, 9_000_000_000, motion, motion, 0, 0.0)
    record.motions.append(fading)
    assert record.motion is None
    record.motions.append(fading._replace(begin_ns=9_000_000_000))
    assert record.motion == motion
    assert not last_orbit(record).impacts  # 4 impacts are too few

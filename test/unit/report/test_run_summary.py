"""The summary of a run: figures from what was heard, nothing made up where nothing arrived."""

from __future__ import annotations

import math

import pytest

from bouncing_disk_ros.core.model import MotionInForce
from bouncing_disk_ros.report.run_record import (
    HealthReport,
    RunRecord,
)
from bouncing_disk_ros.report.run_summary import last_orbit, lines, summary_of
from bouncing_disk_ros.run.session import motion_of
from bouncing_disk_ros.run.simulate import simulate
from support.recorded import listened


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

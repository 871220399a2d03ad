"""The report on runs with known answers: orbits, estimates, speeds and energy; and on nothing."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros import parameters
from bouncing_disk_ros.errors import counted
from bouncing_disk_ros.report.estimate import Estimate
from bouncing_disk_ros.report.report_panels import panels
from bouncing_disk_ros.report.report_text import lines, path_text, transient_text
from bouncing_disk_ros.report.run_record import (
    UNKNOWN_DISK,
    HealthReport,
    RecordSource,
    RunRecord,
)
from bouncing_disk_ros.report.run_report import Report, report_of
from bouncing_disk_ros.report.spans import time_decimals
from bouncing_disk_ros.report.transient import Transient, TransientKind
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.session import motion_of
from support.checks import refused, there
from support.pinned_results import Act, recorded, report, words


def made(folder: Path, seconds: float, acts: tuple[Act, ...] = (), **values: Any) -> Report:
    """The report on a run that begins on the period-1 orbit."""
    return report(recorded(folder, seconds, acts, preset="pizza_multiple_toss", **values))


@pytest.fixture(scope="module")
def settled(tmp_path_factory: pytest.TempPathFactory) -> Report:
    """The period-1 orbit with a friction that slips at first."""
    return made(tmp_path_factory.mktemp("bags"), 40.0, friction=0.02)


def test_orbit_speed_and_estimates_are_those_of_the_run(settled: Report) -> None:
    (part,) = settled.segments
    assert part.orbit is not None
    assert part.orbit.is_period_one
    # eq. 4: cos τ_imp = (1 − ε)/((1 + ε) Γ) = 20/27
    assert part.orbit.forcing_phases[0] == pytest.approx(math.acos(20 / 27), abs=1e-9)
    motion = there(part.segment.motion)
    expected = math.tau * 3.0 * motion.angular_amplitude * math.cos(
        math.acos(20 / 27) + motion.phase_lag
    )  # fmt: skip
    assert part.settled.value == pytest.approx(expected, rel=1e-12)
    said = words(settled)
    assert said["τ_imp"] == "0.736624 rad, theory 0.736624"
    assert said["axial forcing Γ"] == "0.450000"
    assert "linear from" in said["transient"]
    assert settled.restitution.value == pytest.approx(0.5, rel=1e-12)
    assert settled.friction.value == pytest.approx(0.02, rel=1e-12)
    assert said["restitution ε"].endswith("; in force 0.5")
    assert said["friction μ"].startswith("0.02 ± ")


def test_a_change_of_motion_makes_segments_and_the_choice_is_free(tmp_path: Path) -> None:
    motion = motion_of(parameters.complete(load_preset("pizza_multiple_toss")))
    target = motion._replace(axial_amplitude=0.045)
    found = made(tmp_path, 30.0, ((20.0, "command", (1.0, *target)),))
    assert [part.segment.motion for part in found.segments] == [motion, target]
    assert found.shown == 0
    assert report(tmp_path / "run", "last").shown == 1
    assert report(tmp_path / "run", "2").shown_rows["time"].min() >= 21.0
    refused("segment: got '3', allowed: longest, last, or a number", report, tmp_path / "run", "3")
    # both segments have the same disk: the estimate is from all impacts but those of the fade
    assert found.restitution.impacts == sum(part.rows for part in found.segments)
    text = "\n".join(lines(found))
    assert "  1     0.000  20.667  start of the record  0.4500       63  period-1" in text
    assert "  2    21.000  30.000  change of motion     0.5089       26  period-2" in text


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({}, "from 21.333 to 27.39 rad/s within "),  # a jump at the first impact has no rate
        ({"axial_amplitude": 0.0, "angular_amplitude": 0.0, "initial_with_platform": True,
          "initial_axial_velocity": 0.0}, "none: 0 rad/s throughout"),
    ],
)  # fmt: skip
def test_a_speed_that_takes_no_time_has_no_rate(
    values: dict[str, Any], said: str, tmp_path: Path
) -> None:
    assert words(made(tmp_path, 10.0, **values))["transient"].startswith(said)


def test_only_rows_of_impacts(tmp_path: Path) -> None:
    others = ("disk/inputs", "platform/motion", "joint_states", "disk/rotor_speed", "/diagnostics")
    found = made(tmp_path, 10.0, without=others)
    (part,) = found.segments
    assert there(part.orbit).is_period_one
    assert math.isnan(found.restitution.value)
    said = words(found)
    assert said["platform"] == "platform/motion is not in this bag"
    assert said["restitution ε"] == "not identifiable: the disk's parameters are not known"
    assert said["real time"] == "/diagnostics is not in this bag"
    section = panels(found, 100)[2].series[0]
    np.testing.assert_allclose(section.y, -4.0 / 3.0, rtol=1e-6)  # float32; −2/(1 + ε)


def test_a_pause_is_no_slow_simulation() -> None:
    record = RunRecord(UNKNOWN_DISK, known=[(0.0, math.inf)])
    for stamp, simulated, running in ((0, 0, True), (1, 1, True), (2, 1, False), (9, 1, False),
                                      (10, 2, True), (11, 3, True)):  # fmt: skip
        record.health.append(
            HealthReport(stamp, simulated, 1e-4, 1e-3, 1e-2, 1e-16, running=running)
        )
    real = there(report_of(record, RecordSource("a")).real_time)
    assert [pace.reached for pace in real.paces] == [1.0]
    assert real.lateness == (1e-4, 1e-3, 1e-2)


def test_panels_say_what_was_downsampled_and_the_return_map_shows_where_its_points_are(
    settled: Report,
) -> None:
    """The phases of a settled orbit lie close together: the diagonal is as long as they need."""
    speed, phases, section, pairs, *_ = panels(settled, 50)
    assert len(phases.series[0].x) == 50
    assert phases.note == f"50 of {len(settled.rows)} impact rows, chosen at random. "
    assert "of 400 samples: least and greatest of each group" in speed.note
    assert section.note.startswith("50 of ")
    assert pairs.note.startswith("50 of ")
    assert all(not panel.note for panel in panels(settled, 10_000)[:4])
    returns = panels(settled, 10_000)[3]
    diagonal, impacts = returns.series
    both = np.concatenate((impacts.x, impacts.y))
    assert np.ptp(both) < 0.5 * math.pi
    assert diagonal.x[0] < both.min() <= both.max() < diagonal.x[1]
    assert diagonal.x[1] - diagonal.x[0] < 1.3 * np.ptp(both) + 0.11
    assert not returns.x_is_phase
    np.testing.assert_array_equal(diagonal.x, diagonal.y)


def test_many_segments_are_listed_in_part(tmp_path: Path) -> None:
    strikes = tuple((0.2 * number, "impulse", (0.0, 0.0)) for number in range(1, 50))
    found = made(tmp_path, 10.0, strikes)
    assert len(found.segments) == 50
    assert "(30 earlier segments not listed)" in "\n".join(lines(found))


def test_words_of_numbers_and_of_a_transient_of_a_few_steps() -> None:
    known = Estimate(1.0, 0.9, 1.1, 25, "")
    none = Estimate(math.nan, math.nan, math.nan, 0, "not linear")
    found = Transient(TransientKind.EXPONENTIAL, True, 24.0, 27.4, known, none, math.nan, "")
    assert transient_text(found).startswith("exponential from 24 to 27.4 rad/s, time constant")
    steps = found._replace(time_constant=known._replace(low=0.6, high=2.0))
    assert transient_text(steps).startswith("no curve fitted: too few speeds")
    assert path_text(-1e-17, 27.39) == "from 0 to 27.39 rad/s"
    assert path_text(-0.0, 0.0) == "from 0 to 0 rad/s"
    assert [counted(number, "row") for number in (0, 1, 2)] == ["0 rows", "1 row", "2 rows"]
    assert [time_decimals(length) for length in (0.0, 60.0, 1.0, 0.5, 0.034)] == [3, 3, 3, 5, 6]

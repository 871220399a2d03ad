"""The report on runs with known answers: orbits, estimates, speeds and energy; and on nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import ImpactKind
from bouncing_disk_ros.errors import InputError, counted
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.report.estimate import Estimate
from bouncing_disk_ros.report.impact_energy import impact_energy
from bouncing_disk_ros.report.report_panels import panels
from bouncing_disk_ros.report.report_text import lines, path_text, transient_text
from bouncing_disk_ros.report.run_record import (
    UNKNOWN_DISK,
    Change,
    HealthReport,
    RunRecord,
    State,
)
from bouncing_disk_ros.report.run_report import RecordSource, Report, report_of
from bouncing_disk_ros.report.spans import time_decimals
from bouncing_disk_ros.report.transient import Transient, TransientKind
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.session import Session
from support.pinned_results import words

NS = 1_000_000_000


def session_of(**values: Value) -> Session:
    preset = load_preset("pizza_multiple_toss")
    return Session(parameters.complete({**preset, **values}), lambda _: None, paused=True)


def heard(session: Session, until: float, record: RunRecord | None = None) -> RunRecord:
    """Advance with samples at 10 Hz and a report every second, as a listener would keep them."""
    simulation = session.simulation
    if record is None:
        disks, known = [(0.0, simulation.disk)], [(0.0, math.inf)]
        record = RunRecord(simulation.disk, disks=disks, known=known)
        record.motions.append(simulation.motion_in_force)
    for tick in range(session.time_ns * 10 // NS + 1, round(10 * until) + 1):
        while session.advance(tick * NS // 10):
            pass
        now = session.time_ns / NS
        sample = simulation.sample()
        record.states.append(
            State(
                now,
                sample.axial_position,
                sample.platform_position,
                sample.angular_velocity,
                sample.unwrapped_angle,
            )
        )
        if simulation.motion_in_force != record.motions[-1]:
            record.motions.append(simulation.motion_in_force)
        if tick % 10 == 5:  # impacts of period 1 are at multiples of 1/3 s
            energy = simulation.energy()
            record.health.append(
                HealthReport(1000.0 + now, now, 1e-4, 2e-4, 3e-4, 1e-16, behind=0.01, asked="1",
                       energy=energy)
            )  # fmt: skip
        record.chunks += session.take_rows()
    return record


@pytest.fixture(scope="module")
def settled() -> Report:
    """The period-1 orbit with a friction that slips at first."""
    return report_of(heard(session_of(friction=0.02), 40.0), RecordSource("a"))


def test_orbit_speed_and_estimates_are_those_of_the_run(settled: Report) -> None:
    (part,) = settled.segments
    assert part.orbit is not None
    assert part.orbit.is_period_one
    # eq. 4: cos τ_imp = (1 − ε)/((1 + ε) Γ) = 20/27
    assert part.orbit.forcing_phases[0] == pytest.approx(math.acos(20 / 27), abs=1e-9)
    motion = part.segment.motion
    assert motion is not None
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


def test_losses_from_the_rows_are_those_of_the_books(settled: Report) -> None:
    check = settled.ledger
    assert check is not None
    assert (check.begin, check.end, check.missing, check.summed) == (0.0, 39.5, 0, 0)
    # each side sums about a hundred terms to rounding
    assert check.rows_axial == pytest.approx(check.ledger_axial, rel=1e-12)
    assert check.rows_friction == pytest.approx(check.ledger_friction, rel=1e-12)
    assert check.rows_friction > 0.1
    assert check.rows == 119  # at 0, 1/3 ... 39 1/3 s
    rings = [part for part in panels(settled, 100)[4].series if "from the impacts" in part.name]
    for part, field in zip(rings, ("loss_impact_axial", "loss_impact_friction"), strict=True):
        energy = settled.record.health[-1].energy
        assert part.y[-1] == pytest.approx(getattr(energy, field), rel=1e-12)


def test_rows_of_chatters_are_left_out_of_the_books() -> None:
    """At Γ = 0.4, from rest: chatters every cycle; their rows are counted, not guessed."""
    session = session_of(axial_amplitude=0.4 * math.pi * 10.0 / (6.0 * math.pi) ** 2,
                         initial_with_platform=True, initial_axial_velocity=0.0)  # fmt: skip
    report = report_of(heard(session, 10.0), RecordSource("a"))
    check = report.ledger
    assert check is not None
    assert check.summed > 5
    assert check.rows_axial < check.ledger_axial
    # in a chatter nearly all of m w²/2 is lost; gravity and platform are constant to 1e-3 in it
    missing = check.ledger_axial - check.rows_axial
    assert missing == pytest.approx(check.in_summed, rel=0.05)
    energies = impact_energy(report.rows, session.simulation.disk)
    assert np.all(energies.friction[energies.summed] == 0.0)
    tail = report.rows[:1].copy()  # of one impact, after which endless ones are within rounding
    tail["kind"], tail["count"] = ImpactKind.CHATTER_TAIL, 1
    assert impact_energy(tail, session.simulation.disk).summed.tolist() == [True]


def test_a_change_of_motion_makes_segments_and_the_choice_is_free() -> None:
    session = session_of()
    record = heard(session, 20.0)
    motion = session.simulation.latest_target
    session.command([(21 * NS, motion._replace(axial_amplitude=0.045))])
    heard(session, 30.0, record)
    report = report_of(record, RecordSource("a"))
    assert [part.segment.motion for part in report.segments] == [
        motion, motion._replace(axial_amplitude=0.045)
    ]  # fmt: skip
    assert report.shown == 0
    assert report_of(record, RecordSource("a"), "last").shown == 1
    assert report_of(record, RecordSource("a"), "2").shown_rows["time"].min() >= 21.0
    with pytest.raises(InputError, match="segment: got '3', allowed: longest, last, or a number"):
        report_of(record, RecordSource("a"), "3")
    # both segments have the same disk: the estimate is from all impacts but those of the fade
    assert report.restitution.impacts == sum(part.rows for part in report.segments)
    text = "\n".join(lines(report))
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
def test_a_speed_that_takes_no_time_has_no_rate(values: dict[str, Value], said: str) -> None:
    report = report_of(heard(session_of(**values), 10.0), RecordSource("a"))
    assert words(report)["transient"].startswith(said)


def test_chaos_is_named_with_its_exponent() -> None:
    """Γ = 0.55 is in the chaotic band (bifurcations end at 0.5426)."""
    amplitude = 0.55 * math.pi * 10.0 / (6.0 * math.pi) ** 2
    report = report_of(heard(session_of(axial_amplitude=amplitude), 300.0), RecordSource("a"))
    said = words(report)
    assert said["orbit found"].startswith("chaotic, from ")
    value, unit = said["Lyapunov exponent"].split()[:2]
    assert float(value) > 0.0
    assert unit == "per"


def test_only_rows_of_impacts() -> None:
    record = heard(session_of(), 10.0)
    bare = RunRecord(UNKNOWN_DISK, chunks=record.chunks)
    report = report_of(
        bare, RecordSource("a", missing=("disk/inputs", "/diagnostics", "platform/motion"))
    )
    (part,) = report.segments
    assert part.orbit is not None
    assert part.orbit.is_period_one
    assert math.isnan(report.restitution.value)
    said = words(report)
    assert said["platform"] == "platform/motion is not in this bag"
    assert said["restitution ε"] == "not identifiable: the disk's parameters are not known"
    assert said["real time"] == "/diagnostics is not in this bag"
    section = panels(report, 100)[2].series[0]
    np.testing.assert_allclose(section.y, -4.0 / 3.0, rtol=1e-6)  # float32; −2/(1 + ε)


def test_a_pause_is_no_slow_simulation() -> None:
    record = RunRecord(UNKNOWN_DISK, known=[(0.0, math.inf)])
    for stamp, simulated, running in ((0, 0, True), (1, 1, True), (2, 1, False), (9, 1, False),
                                      (10, 2, True), (11, 3, True)):  # fmt: skip
        record.health.append(
            HealthReport(stamp, simulated, 1e-4, 1e-3, 1e-2, 1e-16, running=running)
        )
    real = report_of(record, RecordSource("a")).real_time
    assert real is not None
    assert [pace.reached for pace in real.paces] == [1.0]
    assert real.lateness == (1e-4, 1e-3, 1e-2)


def test_thinned_series_say_so(settled: Report) -> None:
    speed, phases, section, pairs, *_ = panels(settled, 50)
    assert len(phases.series[0].x) == 50
    assert phases.note == f"50 of {len(settled.rows)} impact rows, chosen at random. "
    assert "of 400 samples: least and greatest of each group" in speed.note
    assert section.note.startswith("50 of ")
    assert pairs.note.startswith("50 of ")
    assert all(not panel.note for panel in panels(settled, 10_000)[:4])


def test_many_segments_are_listed_in_part() -> None:
    record = heard(session_of(), 10.0)
    record.changes += [Change(0.2 * number, "impulse") for number in range(1, 50)]
    report = report_of(record, RecordSource("a"))
    assert len(report.segments) == 50
    assert "(30 earlier segments not listed)" in "\n".join(lines(report))


def test_the_return_map_shows_where_its_points_are(settled: Report) -> None:
    """The phases of a settled orbit lie close together: the diagonal is as long as they need."""
    pairs = panels(settled, 10_000)[3]
    diagonal, impacts = pairs.series
    phases = np.concatenate((impacts.x, impacts.y))
    assert np.ptp(phases) < 0.5 * math.pi
    assert diagonal.x[0] < phases.min() <= phases.max() < diagonal.x[1]
    assert diagonal.x[1] - diagonal.x[0] < 1.3 * np.ptp(phases) + 0.11
    assert not pairs.x_is_phase
    np.testing.assert_array_equal(diagonal.x, diagonal.y)


def test_heights_are_those_of_the_last_periods(settled: Report) -> None:
    heights = panels(settled, 10_000)[6]
    assert settled.chosen is not None
    segment = settled.chosen.segment
    assert segment.motion is not None
    platform, disk, impacts = heights.series
    assert disk.x.min() >= segment.end - 6.0 / segment.motion.frequency
    assert np.all(np.diff(disk.x) >= 0.0)
    assert np.max(np.abs(platform.y)) <= 1e3 * segment.motion.axial_amplitude * (1.0 + 1e-9)
    assert len(impacts.x) >= 5
    assert np.isin(impacts.x, disk.x).all(), "the path goes through the impacts"


def test_a_transient_of_a_few_steps_has_no_curve() -> None:
    known = Estimate(1.0, 0.9, 1.1, 25, "")
    none = Estimate(math.nan, math.nan, math.nan, 0, "not linear")
    found = Transient(TransientKind.EXPONENTIAL, True, 24.0, 27.4, known, none, math.nan, "")
    assert transient_text(found).startswith("exponential from 24 to 27.4 rad/s, time constant")
    steps = found._replace(time_constant=known._replace(low=0.6, high=2.0))
    assert transient_text(steps).startswith("no curve fitted: too few speeds")


def test_words_of_numbers() -> None:
    assert path_text(-1e-17, 27.39) == "from 0 to 27.39 rad/s"
    assert path_text(-0.0, 0.0) == "from 0 to 0 rad/s"
    assert [counted(number, "row") for number in (0, 1, 2)] == ["0 rows", "1 row", "2 rows"]
    assert [time_decimals(length) for length in (0.0, 60.0, 1.0, 0.5, 0.034)] == [3, 3, 3, 5, 6]

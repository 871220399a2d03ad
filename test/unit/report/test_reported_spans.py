"""Reports on what is easily told of another time, run or platform: each span is the run's own."""

from __future__ import annotations

import math
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros import bag
from bouncing_disk_ros.core.offset import QUINTIC, Knot, OffsetState
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.nodes.replay.bag_streams import Recorded, replay_bag
from bouncing_disk_ros.nodes.replay.replay_text import comparison_lines
from bouncing_disk_ros.proof.bag_proof import BagProver
from bouncing_disk_ros.report.bag_report import with_options
from bouncing_disk_ros.report.recorded_runs import RecordedRuns
from bouncing_disk_ros.report.report_panels import energy_panel, panels
from bouncing_disk_ros.report.run_report import Report
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.trajectory_validation import Splice
from bouncing_disk_ros.run.what_if import changes_of, what_if
from support.checks import refused, there
from support.pinned_results import report, words
from support.recorded import NS, START_NS, Act, RecordedRun

PRESET = "pizza_multiple_toss"


def made(
    folder: Path, seconds: float, acts: dict[float, Act] | None = None, **given: Any
) -> Report:
    with bag.Writer(folder / "run") as writer:
        RecordedRun(writer, **{"preset": PRESET, "gravity": 10.0, **given}).run(seconds, acts)
    return report(folder / "run")


def reset(session: Session) -> None:
    session.reset()


# --- runs -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("numbered", [True, False])
def test_two_runs_in_one_bag_are_two(tmp_path: Path, numbered: bool) -> None:
    """The second run begins with its first message, not with its first impact."""
    other: dict[str, Any] = {"axial_amplitude": 0.036, "initial_height": 0.3}
    with bag.Writer(tmp_path / "run") as writer:
        for place, more in enumerate((dict[str, Any](), other)):
            run = RecordedRun(
                writer, "", START_NS + 60 * place * NS, preset=PRESET, gravity=10.0,
                without=("disk/inputs", "disk/rotor_speed", "/diagnostics"), numbered=numbered,
                **more,
            )  # fmt: skip
            run.run(8.0)
    for number, amplitude in ((1, None), (2, 0.036)):
        found = report(tmp_path / "run", run=number)
        assert found.source.runs == 2
        assert len(found.segments) == 1, found.segments
        motion = there(found.segments[0].segment.motion)
        assert amplitude is None or motion.axial_amplitude == amplitude
        assert found.restitution.value == pytest.approx(0.5, abs=1e-12)
        assert found.restitution.high - found.restitution.low < 1e-9
    refused("run: got 3, allowed: 1 to 2", report, tmp_path / "run", run=3)


@pytest.mark.parametrize(
    ("begin", "without"), [(0.0, ()), (4.0, ()), (4.0, ("disk/inputs",)), (0.0, ("disk/inputs",))]
)
def test_replay_proof_and_report_agree_on_the_runs(
    tmp_path: Path, begin: float, without: tuple[str, ...]
) -> None:
    """The recorder hears the second run late: its rows and times rise behind those of the first."""
    first, second = tmp_path / "run", {"initial_height": 0.3, "begin": begin, "without": without}
    with bag.Writer(first) as writer:
        RecordedRun(writer, preset=PRESET, gravity=10.0).run(2.0)
        given: dict[str, Any] = {"preset": PRESET, "gravity": 10.0, **second}
        RecordedRun(writer, "", START_NS + 60 * NS, **given).run(8.0)
    reports = [report(first, run=number) for number in (1, 2)]
    assert [found.source.runs for found in reports] == [2, 2]
    with bag.open(first) as opened:
        replayed = replay_bag(Recorded(opened))
        runs = list(RecordedRuns(opened, "/disk/inputs", "/disk/impacts"))
        prover = BagProver(
            opened, with_options(ArgumentParser()).parse_args([str(first), "--prove", "--run", "1"])
        )
        assert len(list(prover.work())) > 5
        assert next(prover.lines(interrupted=False)).endswith("0.000 s to 2.000 s")
    assert replayed.identical
    assert replayed.left_over == 0
    assert len(runs) == len(replayed.runs) == 2
    for found, one, run in zip(reports, replayed.runs, runs, strict=True):
        is_replayed = found.record.known != []
        assert (one.start_ns is not None) == is_replayed
        assert (one.rows if is_replayed else one.not_compared) == len(found.rows)
        assert run.end_ns / NS == pytest.approx(found.end, abs=1e-6)


# --- the platform ---------------------------------------------------------------------------------
def test_an_offset_that_is_not_in_the_bag_is_seen_by_the_impacts(tmp_path: Path) -> None:
    def lift(session: Session) -> None:
        knots = tuple(
            Knot(session.time_ns + k * NS // 2, OffsetState(0.01 * (-1) ** k), QUINTIC)
            for k in range(1, 20)
        )
        session.trajectory(Splice(session.time_ns, knots, None))

    without = ("platform/offset", "disk/inputs")
    found = made(tmp_path, 12.0, {2.0: lift}, without=without)
    assert math.isnan(found.restitution.value)
    said = words(found)
    assert "impacts are off the platform of the record, by up to 0.0" in said["restitution ε"]
    assert "impacts are off the platform of the record" in said["not so"]
    known = made(tmp_path / "known", 12.0, {2.0: lift})
    assert known.restitution.value == pytest.approx(0.5, abs=1e-9)


def test_an_orbit_that_a_loop_holds_is_found_though_it_is_unstable(tmp_path: Path) -> None:
    phase = fixed_point(0.052 * (6.0 * math.pi) ** 2 / (math.pi * 10.0), 0.5).state.forcing_phase

    def hold(session: Session) -> None:
        knot = Knot(session.time_ns + NS, OffsetState(0.0), QUINTIC)
        session.trajectory(Splice(session.time_ns, (knot,), None))

    at = {"axial_amplitude": 0.052, "initial_forcing_phase": phase}
    for act, name in ((None, "unresolved"), (hold, "period-1")):
        found = made(tmp_path / name, 8.0, {2.0: act} if act else None, **at)
        assert there(found.segments[0].orbit).name == name
        assert words(found)["orbit found"].startswith(name)


# --- windows --------------------------------------------------------------------------------------
@pytest.mark.parametrize("without", [(), ("disk/inputs", "platform/motion")])
def test_the_line_of_the_ledger_ends_at_a_reset(tmp_path: Path, without: tuple[str, ...]) -> None:
    """A line across it would show losses that become smaller."""
    found = made(tmp_path, 12.0, {7.5: reset}, without=without)
    losses = [one for one in energy_panel(found, 1000).series if one.name.startswith("loss")]
    assert len(losses) == 3
    for line in losses:
        (gap,) = np.flatnonzero(np.isnan(line.x))
        assert (line.x[gap - 1], line.x[gap + 1]) == (7.0, 8.0)
        for part in (line.y[:gap], line.y[gap + 1 :]):
            assert np.all(np.diff(part) >= 0.0)


def test_contact_after_an_impact_without_restitution_is_seen(tmp_path: Path) -> None:
    """ε = 0: one impact, then contact; nothing is drawn below the platform."""
    found = made(tmp_path, 6.0, restitution=0.0, axial_amplitude=0.005,
                 without=("joint_states", "disk/rotor_speed"))  # fmt: skip
    part = there(found.chosen)
    assert there(part.orbit).name == "in contact"
    assert math.isnan(part.settled.value), "impacts do not tell the mean in contact"
    drawn = {series.name: series for series in panels(found, 1000)[6].series}
    if "disk x" in drawn:
        assert np.all(drawn["disk x"].y >= drawn["platform s"].y - 1e-9)


# --- means ----------------------------------------------------------------------------------------
def test_the_mean_at_the_end_is_over_whole_periods_and_all_messages(tmp_path: Path) -> None:
    """Chattering turns the disk unevenly; two messages a period of the orbit are not enough."""
    given: dict[str, Any] = {"axial_amplitude": 0.4 * math.pi * 10.0 / (6.0 * math.pi) ** 2,
             "initial_with_platform": True, "initial_axial_velocity": 0.0}  # fmt: skip
    with bag.Writer(tmp_path / "run") as writer:
        run = RecordedRun(writer, preset=PRESET, gravity=10.0, without=("joint_states",), **given)
        angles = {0.0: run.session.simulation.sample().unwrapped_angle}
        for _ in range(120):
            run.run(0.1)
            sample = run.session.simulation.sample()
            angles[round(sample.time_ns / NS, 1)] = sample.unwrapped_angle
    for topics in ((), ("disk/rotor_speed", "disk/inputs", "platform/motion")):
        part = there(report(tmp_path / "run", topics=topics).chosen)
        mean = part.settled
        begin, end = round(mean.begin, 1), round(mean.end, 1)
        assert mean.value == pytest.approx((angles[end] - angles[begin]) / (end - begin), abs=1e-9)
    assert words(report(tmp_path / "run"))["at the end"].count(" s to ") == 1


# --- words ----------------------------------------------------------------------------------------


def test_absent_and_silent_topics_are_told_apart(tmp_path: Path) -> None:
    with bag.Writer(tmp_path / "run") as writer:
        writer.add_topic("/disk/rotor_speed", "geometry_msgs/msg/TwistStamped", [bag.OfferedQos()])
        run = RecordedRun(writer, preset=PRESET, without=("disk/rotor_speed", "/diagnostics"))
        run.run(2.0)
    found = report(tmp_path / "run")
    assert found.source.missing == ("/diagnostics", "disk/phase")
    assert found.source.empty == ("disk/rotor_speed",)
    said = words(found)
    assert said["without messages"] == "disk/rotor_speed"
    assert said["real time"] == "/diagnostics is not in this bag"
    assert found.source.absence("disk/rotor_speed") == "in this bag without messages"


def test_a_replay_goes_as_far_as_any_topic_shows(tmp_path: Path) -> None:
    """Contact has no impacts: nothing else shows that the run went on; a what-if needs it too."""
    still: dict[str, Any] = {
        "axial_amplitude": 0.001,
        "angular_amplitude": 0.5,
        "initial_with_platform": True,
        "initial_axial_velocity": 0.0,
    }
    with bag.Writer(tmp_path / "run") as writer:
        writer.add_topic("/disk/impacts", "sensor_msgs/msg/PointCloud2", [bag.OfferedQos()])
        RecordedRun(writer, preset=PRESET, initial_height=0.0, **still).run(4.0)
    with bag.open(tmp_path / "run") as opened:
        recorded = Recorded(opened)
        (found,) = replay_bag(recorded).runs
        assert found.rows == 0
        assert found.end_ns == pytest.approx(4 * NS, abs=10)
        for changes, said in (
            ({}, "the two never differ: 0 impacts and 2001 samples are equal"),
            ({"friction": 0.01}, "they differ, though no impact does (0 impacts): by samples from"),
        ):
            runs = what_if(recorded.run(1).records, changes_of(changes), found.end_ns)
            assert said in comparison_lines(runs, "")[-1]

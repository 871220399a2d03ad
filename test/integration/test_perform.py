"""`perform` and `echo_impacts` with a simulator in another process, over DDS."""

from __future__ import annotations

import csv
import io
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.nodes.performer import cancelling
from bouncing_disk_ros.report.impact_text import csv_heading
from bouncing_disk_ros.ros.from_messages import msg_to_motion
from bouncing_disk_ros.run.input_replay import advance_to, apply, restored
from support.processes import Process, Starter, environment
from support.ros_peer import Peer

RUNNING = r"running at"


@pytest.fixture
def simulator(start: Starter) -> Process:
    """A simulator on the period-1 orbit of the preset, running."""
    process = start("simulator", "--ros-args", "-p", "preset:=pizza_multiple_toss")
    process.wait_for(RUNNING)
    return process


@pytest.fixture
def programme(tmp_path: Path) -> Path:
    """A short programme with an alignment."""
    file = tmp_path / "short.yaml"
    file.write_text(
        "description: a short one\n"
        "align: {time: 0.6, forcing_phase: 2.0}\n"
        "points:\n"
        "  - {time: 0.4, axial_amplitude: 0.035}\n"
        "  - {time: 0.8, axial_amplitude: 0.03}\n"
        "trajectory:\n"
        "  - {time: 0.5, platform_axial: [0.004, 0.0]}\n"
    )
    return file


@pytest.fixture
def peer(ros_domain: int) -> Iterator[Peer]:
    peer = Peer()
    yield peer
    peer.close()


def test_a_programme_is_carried_out(
    start: Starter, simulator: Process, programme: Path, peer: Peer
) -> None:
    process = start("perform", str(programme))
    assert process.wait() == 0, process.output
    assert "short: a short one" in process.stdout
    assert "short: in force" in process.stdout
    peer.spin_until(lambda: "trajectory" in {record["kind"] for record in peer.records})
    (points,) = (record["points"] for record in peer.records if record["kind"] == "motion")
    (first, (first_amplitude, *_)), (second, (second_amplitude, *_)) = points
    assert (first_amplitude, second_amplitude) == (0.035, 0.03)
    # the points are 0.4 s apart to the nanosecond; simulated_time is a float64 of seconds
    assert second - first == pytest.approx(400_000_000, abs=2)
    simulation = restored(peer.records[0])
    for record in peer.records[1:]:
        advance_to(simulation, record["time_ns"])
        apply(simulation, record)
    advance_to(simulation, first + 200_000_000)  # `align`: 0.2 s after the first point
    assert simulation.sample().forcing_phase == pytest.approx(2.0, abs=1e-6)
    peer.spin_until(lambda: msg_to_motion(peer.latest("platform/motion")).end_ns == second)
    assert msg_to_motion(peer.latest("platform/motion")).target.axial_amplitude == 0.03

    def held() -> list[list[float]]:
        return [list(point.positions) for point in peer.latest("platform/offset").points]

    peer.spin_until(lambda: held() == [[0.004, 0.0]] * 2)


@pytest.mark.parametrize("clock", [False, True], ids=["wall clock", "published clock"])
def test_slow_motion_is_taken_into_account(start: Starter, programme: Path, clock: bool) -> None:
    published = ["-p", "publish_clock:=true"] if clock else []
    slow = start("simulator", "--ros-args", "-p", "real_time_factor:=0.5", *published)
    slow.wait_for(RUNNING)
    if clock:
        code, process = start.finish("perform", str(programme))
        assert code == 1
        assert "perform: the simulator publishes /clock: add --ros-args -p use_sim_time" in (
            process.stderr
        )
    follow = ["--ros-args", "-p", "use_sim_time:=true"] if clock else []
    code, process = start.finish("perform", str(programme), *follow)
    assert code == 0, process.output
    assert "takes 1.60 s" in process.stdout
    assert slow.end() == 0


@pytest.mark.parametrize(
    ("arguments", "code", "line"),
    [
        (["spin_upp"], 2, r"^perform: programme: got 'spin_upp', allowed: .*Did you mean spin_up"),
        ([], 2, r"^perform: programme: got '', allowed: first_toss_to_period_1, motor_start_and"),
        (["--ros-args", "-p", "programm:=x"], 2, r"^perform: parameter: .*Did you mean programme"),
        (["spin_up", "--ros-args", "-p", "lead:=-1.0"], 2, r"^perform: lead: got -1.0, allowed"),
        (
            ["spin_up", "--ros-args", "-p", "timeout:=0.5"],
            1,
            r"^perform: /platform/command has no subscriber after 0.5 s: .*ROS_DOMAIN_ID \(\d+\)",
        ),
    ],
)
def test_what_cannot_be_done_is_one_line(
    start: Starter, arguments: list[str], code: int, line: str
) -> None:
    found, process = start.finish("perform", *arguments)
    assert found == code, process.output
    assert process.stdout == ""
    assert len(process.stderr.splitlines()) == 1
    assert re.search(line, process.stderr)


def test_a_paused_simulator_is_named(start: Starter) -> None:
    paused = start("simulator", "--ros-args", "-p", "start_paused:=true")
    paused.wait_for(r"paused at|start_paused|active|at 0\.0")
    code, process = start.finish("perform", "spin_up")
    assert code == 1
    assert "perform: the simulator is paused: resume it first" in process.stderr


def test_a_first_toss_of_another_disk_is_refused(start: Starter) -> None:
    start("simulator", "--ros-args", "-p", "preset:=swum").wait_for(RUNNING)
    code, process = start.finish("perform", "first_toss_to_period_1")
    assert code == 2, process.output
    assert len(process.stderr.splitlines()) == 1
    assert "first_toss_to_period_1: got 'Γ = 0.0001009', allowed: a disk for" in process.stderr


def test_a_free_running_simulator_is_named(start: Starter) -> None:
    free = start("simulator", "--ros-args", "-p", "real_time_factor:=0.0")
    free.wait_for(RUNNING)
    code, process = start.finish("perform", "spin_up")
    assert code == 1
    assert "perform: the simulator runs as fast as it can" in process.stderr


def test_perform_is_interrupted(start: Starter, simulator: Process) -> None:
    process = start("perform", "spin_up")
    process.wait_for(r"^sent:")
    assert process.end(signal.SIGINT) == 130
    (line,) = process.stderr.splitlines()
    assert line.startswith("perform: interrupted; the simulator goes on with spin_up. A programme")
    assert line.endswith(cancelling("/platform/command"))


def test_echo_impacts_counts_rows(start: Starter, simulator: Process) -> None:
    code, process = start.finish("echo_impacts", "--ros-args", "-p", "count:=4")
    assert code == 0, process.output
    heading, units, *rows = process.stdout.splitlines()
    assert heading.split()[:4] == ["index", "time", "cycles", "τ/2π"]
    assert units.split()[0] == "s"
    assert len(rows) == 4
    indices = [int(row.split()[0]) for row in rows]
    assert np.all(np.diff(indices) == 1)
    assert all(row.split()[3] == "0.11724" for row in rows)  # τ_imp/2π of Γ = 0.45


def test_echo_impacts_once_as_csv(start: Starter, simulator: Process) -> None:
    code, process = start.finish(
        "echo_impacts", "--ros-args", "-p", "once:=true", "-p", "csv:=true"
    )
    assert code == 0, process.output
    assert process.stdout.splitlines()[0] == csv_heading()
    (row,) = csv.DictReader(io.StringIO(process.stdout))
    assert list(row) == list(IMPACT_DTYPE.names or ())
    assert float(row["axial_impact_velocity"]) == pytest.approx(-20.0 / 9.0, rel=1e-9)


def test_echo_impacts_into_head(start: Starter, simulator: Process) -> None:
    """The reader goes away after two lines: no traceback, no complaint."""
    script = (
        f"{sys.executable} -m bouncing_disk_ros echo_impacts | head -2; echo ${{PIPESTATUS[0]}}"
    )
    done = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, timeout=60, env=environment()
    )
    told = [line for line in done.stderr.splitlines() if "waiting for /disk/impacts" not in line]
    assert told == []  # on a busy machine it waits, and says so
    assert done.stdout.splitlines()[0].split()[0] == "index"
    assert done.stdout.splitlines()[2:] == ["0"]


def test_echo_impacts_waits_and_says_for_what(start: Starter) -> None:
    process = start("echo_impacts")
    process.wait_for(
        r"echo_impacts: waiting for /disk/impacts in ROS_DOMAIN_ID \d+: no node publishes it"
    )
    assert process.end(signal.SIGINT) == 0
    code, process = start.finish("echo_impacts", "--ros-args", "-p", "timeout:=0.5")
    assert code == 1
    assert process.stderr == "echo_impacts: no impact on /disk/impacts for 0.5 s\n"


@pytest.mark.parametrize("name", ["perform", "echo_impacts", "demo"])
def test_help_needs_no_ros_graph(start: Starter, name: str) -> None:
    code, process = start.finish(name, "--help")
    assert code == 0
    assert process.stdout.startswith(f"usage: {name}")
    assert "parameters (--ros-args -p NAME:=VALUE):" in process.stdout

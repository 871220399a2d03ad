"""`perform` and `echo_impacts` with a simulator in another process, over DDS."""

from __future__ import annotations

import csv
import io
import re
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.nodes.performer import cancelling
from bouncing_disk_ros.report.impact_text import csv_heading
from bouncing_disk_ros.ros.from_messages import msg_to_motion
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.input_replay import advance_to, apply, restored
from support.processes import Process, Starter, ends, finished
from support.ros_peer import Peer

RUNNING = r"running at"


@pytest.fixture(scope="module")
def simulator(ros_domain: int) -> Iterator[Process]:
    """A simulator on the period-1 orbit of the preset, running, for all tests of a worker."""
    starter = Starter()
    process = starter("simulator", "--ros-args", "-p", "preset:=pizza_multiple_toss")
    process.wait_for(RUNNING)
    yield process
    starter.close()


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
def peer(simulator: Process) -> Iterator[Peer]:
    """A peer of the simulator, which begins anew from its start."""
    peer = Peer()
    peer.settle()
    peer.publish("platform/command", JointTrajectory())
    assert peer.call(Trigger, "reset").success
    peer.spin_until(lambda: any(record["kind"] == "reset" for record in peer.records))
    yield peer
    peer.close()


def test_a_programme_is_carried_out(start: Starter, programme: Path, peer: Peer) -> None:
    process = start("perform", str(programme))
    assert process.wait() == 0, process.output
    assert "short: a short one" in process.stdout
    assert "short: in force" in process.stdout

    def sent() -> list[Record]:
        """The newest two inputs that move the platform; those of other tests may come late."""
        moves = ("motion", "trajectory")
        found = [record for record in peer.records if record["kind"] in moves]
        return [record for record in found if record.get("points", True)][-2:]

    peer.spin_until(lambda: [record["kind"] for record in sent()] == ["motion", "trajectory"])
    points = sent()[0]["points"]
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


def test_a_published_clock_is_asked_for(start: Starter, programme: Path) -> None:
    peer = Peer("slow")
    peer.simulator(namespace="slow", real_time_factor=0.5, publish_clock=True)
    here = ("--ros-args", "-r", "__ns:=/slow")
    refused = start("perform", str(programme), *here)
    peer.spin_until(lambda: not refused.running)
    assert refused.wait() == 1
    assert "perform: the simulator publishes /clock: add --ros-args -p use_sim_time" in (
        refused.stderr
    )
    process = start("perform", str(programme), *here, "-p", "use_sim_time:=true")
    peer.spin_until(lambda: not process.running)
    assert process.wait() == 0, process.output
    assert "takes 1.60 s" in process.stdout
    peer.close()


@pytest.mark.parametrize(
    ("seconds", "line"),
    [
        ([], "no time on /clock, which use_sim_time needs"),
        # stamps by such a clock are in the past of the simulator, or in its far future
        ([10, 2_000_000_000], "another node publishes /clock, not the simulator, whose stamps are"),
    ],
)
def test_the_clock_of_another_node_is_refused(
    start: Starter, peer: Peer, seconds: list[int], line: str
) -> None:
    own = "/clock_of_another_node"
    publisher = peer.node.create_publisher(Clock, own, 10)
    options = ("-p", "use_sim_time:=true", "-p", "timeout:=10.0", "-r", f"/clock:={own}")
    times: list[int | None] = [*seconds] or [None]
    for second in times:
        process = start("perform", "spin_up", "--ros-args", *options)

        def ended(process: Process = process, second: int | None = second) -> bool:
            if second is not None:
                publisher.publish(Clock(clock=Time(sec=second)))
            return not process.running

        peer.spin_until(ended)
        assert process.wait() == 1
        assert process.stderr.splitlines()[-1].startswith(f"perform: {line}")
        assert "sent:" not in process.stdout
    peer.node.destroy_publisher(publisher)


def test_a_simulator_in_lockstep_is_left_alone(start: Starter) -> None:
    """Its time stood until a reset: no controller had announced the programme."""
    peer = Peer("locked")
    peer.simulator(namespace="locked", lockstep="tick")
    refused = start("perform", "spin_up", "--ros-args", "-r", "__ns:=/locked")
    peer.spin_until(lambda: not refused.running)
    assert refused.wait() == 1
    assert "perform: the simulator is in lockstep: it would wait for a" in refused.stderr
    peer.close()


def test_a_simulator_that_is_not_there_is_named(capfd: pytest.CaptureFixture[str]) -> None:
    nowhere = ("--ros-args", "-p", "timeout:=0.5", "-r", "__ns:=/nowhere")
    code, out, (told,) = ends(capfd, "perform", "spin_up", *nowhere)
    assert (code, out) == (1, "")
    said = r"perform: /nowhere/platform/command has no subscriber after 0.5 s: .*DOMAIN_ID \("
    assert re.match(said, told)


@pytest.mark.parametrize(
    ("name", "changes", "code", "line"),
    [
        ("spin_up", {"paused": True}, 1, "the simulator is paused: resume it first"),
        ("spin_up", {"real_time_factor": 0.0}, 1, "the simulator runs as fast as it can"),
        ("first_toss_to_period_1", {"restitution": 0.9}, 2, "allowed: a disk for"),
    ],
)
def test_a_simulator_that_does_not_suit_is_named(
    capfd: pytest.CaptureFixture[str], peer: Peer, name: str, changes: dict[str, Any], code: int,
    line: str,
) -> None:  # fmt: skip
    before = {"real_time_factor": 1.0, "restitution": 0.5}
    values = {one: value for one, value in changes.items() if one != "paused"}
    if values:
        assert peer.set_parameters(**values).successful
    else:
        peer.call(SetBool, "pause", SetBool.Request(data=True))
    found, _, lines = ends(capfd, "perform", name)
    peer.set_parameters(**before)
    peer.call(SetBool, "pause", SetBool.Request(data=False))
    assert found == code
    assert lines[-1].startswith("perform: ")
    assert line in lines[-1]


def test_perform_is_interrupted(start: Starter, peer: Peer) -> None:
    process = start("perform", "spin_up")
    process.wait_for(r"^sent:")
    assert process.end(signal.SIGINT) == 130
    (line,) = process.stderr.splitlines()
    assert line.startswith("perform: interrupted; the simulator goes on with spin_up. A programme")
    assert line.endswith(cancelling("/platform/command"))


def test_echo_impacts_counts_rows(capfd: pytest.CaptureFixture[str], peer: Peer) -> None:
    code, out, _ = ends(capfd, "echo_impacts", "--ros-args", "-p", "count:=4")
    assert code == 0
    heading, units, *rows = out.splitlines()
    assert heading.split()[:4] == ["index", "time", "cycles", "τ/2π"]
    assert units.split()[0] == "s"
    assert len(rows) == 4
    indices = [int(row.split()[0]) for row in rows]
    assert np.all(np.diff(indices) == 1)
    assert all(row.split()[3] == "0.11724" for row in rows)  # τ_imp/2π of Γ = 0.45


def test_echo_impacts_once_as_csv(capfd: pytest.CaptureFixture[str], peer: Peer) -> None:
    given = ("--ros-args", "-p", "once:=true", "-p", "csv:=true")
    code, out, _ = ends(capfd, "echo_impacts", *given)
    assert code == 0
    assert out.splitlines()[0] == csv_heading()
    (row,) = csv.DictReader(io.StringIO(out))
    assert list(row) == list(IMPACT_DTYPE.names or ())
    assert float(row["axial_impact_velocity"]) == pytest.approx(-20.0 / 9.0, rel=1e-9)


def test_echo_impacts_into_head(start: Starter, simulator: Process) -> None:
    """The reader goes away after two lines: no traceback, no complaint."""
    script = (
        f"{sys.executable} -m bouncing_disk_ros echo_impacts | head -2; echo ${{PIPESTATUS[0]}}"
    )
    done = finished("bash", "-c", script)
    told = [line for line in done.stderr.splitlines() if "waiting for /disk/impacts" not in line]
    assert told == []  # on a busy machine it waits, and says so
    assert done.stdout.splitlines()[0].split()[0] == "index"
    assert done.stdout.splitlines()[2:] == ["0"]


def test_echo_impacts_waits_and_says_for_what(
    start: Starter, capfd: pytest.CaptureFixture[str]
) -> None:
    nowhere = ("--ros-args", "-r", "__ns:=/nowhere")
    process = start("echo_impacts", *nowhere)
    process.wait_for(
        r"waiting for /nowhere/disk/impacts in ROS_DOMAIN_ID \d+: no node publishes it"
    )
    assert process.end(signal.SIGINT) == 0
    code, _, lines = ends(capfd, "echo_impacts", *nowhere, "-p", "timeout:=0.5")
    assert code == 1
    assert lines == ["echo_impacts: no impact on /nowhere/disk/impacts for 0.5 s"]

"""`replay`: bags made by the tests and by simulator and recorder as processes, and exit codes."""

from __future__ import annotations

import os
import re
import signal
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from rclpy.serialization import serialize_message
from rosbags.rosbag2 import Reader
from std_msgs.msg import Float64, String
from std_srvs.srv import SetBool, Trigger

from bouncing_disk_ros import bag
from bouncing_disk_ros.nodes.replay import bag_streams, replay
from bouncing_disk_ros.ros.to_messages import impacts_to_msg, impulse_to_msg
from bouncing_disk_ros.run.command_validation import ImpulseRequest
from bouncing_disk_ros.run.input_records import to_json
from bouncing_disk_ros.units import NS
from support.driven import Driven, flipped
from support.processes import Starter, ends
from support.ros_peer import Peer

START_NS = 10**18
DEFAULT = ("/disk/inputs", "/disk/impacts")


def write(
    folder: Path, runs: Sequence[Driven], names: tuple[str, str] = DEFAULT,
    writer: bag.Writer | None = None, max_duration: float = 0.0,
) -> Path:  # fmt: skip
    """A bag as the recorder makes it, with a tenth of a second between messages."""
    inputs, impacts = names
    sent = [(at, inputs, String(data=to_json(r))) for run in runs for at, r in run.records]
    sent += [(at, impacts, impacts_to_msg(rows, 0)) for run in runs for at, rows in run.rows]
    own = writer or bag.Writer(folder, bag.Options(max_duration=max_duration))
    own.add_topic(inputs, "std_msgs/msg/String")
    own.add_topic(impacts, "sensor_msgs/msg/PointCloud2")
    for number, (at, topic, message) in enumerate(sorted(sent, key=lambda one: one[0])):
        stamp = START_NS + at * 10**8
        own.write(topic, serialize_message(message), stamp + 1000, stamp, number)
    if writer is None:
        own.close()
    return folder


@pytest.fixture(scope="module")
def driven() -> Driven:
    return Driven().drive(5)


@pytest.fixture
def run_1(driven: Driven, tmp_path: Path) -> Path:
    return write(tmp_path / "run_1", [driven])


# --- bags of one run ------------------------------------------------------------------------------
def flip(run: Driven, field: str) -> None:
    at, rows = run.rows[4]
    run.rows[4] = (at, flipped(rows, 1, field, 0))


def other_build(run: Driven) -> None:
    run.records[0][1]["version"] = "0.0.1"


def other_build_and_flip(run: Driven) -> None:
    other_build(run)
    flip(run, "time")


def lose(run: Driven) -> None:
    del run.rows[3]
    lost = next(i for i, (_, r) in enumerate(run.records) if i > 8 and r["kind"] == "motion")
    del run.records[lost]


@pytest.mark.parametrize(
    ("change", "code", "said"),
    [
        (lambda _: None, 0, r"replay identical: \d+ impacts\n$"),
        (lambda run: flip(run, "angular_velocity"), 3,
         r"replay differs: row \d+ at t = [\d.]+ s: angular_velocity: .*\n$"),
        (other_build, 0, r"recorded by version 0.0.1 \(this is"),
        (other_build_and_flip, 3,
         r"\nreplay differs, another build \(recorded by 0.0.1, this is .*\n$"),
        (lose, 0, r", 3 rows missing in the bag(?s:.*) is missing after (?s:.*)snapshot at "),
    ],
)  # fmt: skip
def test_a_replay_says_whether_a_bag_is_identical(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: Callable[[Driven], None],
    code: int, said: str,
) -> None:  # fmt: skip
    run = Driven().drive(5)
    change(run)
    assert replay.main([str(write(tmp_path / "bag", [run]))]) == code
    out = capsys.readouterr()
    assert re.search(said, out.out)
    assert out.err == ""


def test_a_bag_of_two_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first = Driven().drive(6)
    second = Driven(sent=first.sent).drive(7)
    folder = write(tmp_path / "two", [first, second])
    assert replay.main([str(folder)]) == 0
    out = capsys.readouterr().out
    assert "run 2: 0.000 s to " in out
    assert out.endswith(f"replay identical: {first.impacts + second.impacts} impacts\n")
    assert replay.main([str(folder), "--what-if", "restitution:=0.4"]) == 2
    assert "--run: got 'none, but" in capsys.readouterr().err
    assert replay.main([str(folder), "--what-if", "restitution:=0.4", "--run", "2"]) == 0
    assert f"impacts                {second.impacts} " in capsys.readouterr().out


# --- several simulators, remapped topics ----------------------------------------------------------
def test_several_simulators_are_chosen_by_namespace(
    driven: Driven, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    second = Driven().drive(8)
    folder = tmp_path / "bag"
    with bag.Writer(folder) as writer:
        write(folder, [driven], writer=writer)
        write(folder, [second], ("/second/disk/inputs", "/second/disk/impacts"), writer)
    assert replay.main([str(folder)]) == 2
    assert "several simulators are in the bag', allowed: one of /, /second" in (
        capsys.readouterr().err
    )
    for namespace, run in (("/", driven), ("second", second)):
        assert replay.main([str(folder), "--namespace", namespace]) == 0
        assert capsys.readouterr().out.endswith(f"identical: {run.impacts} impacts\n")
    assert replay.main([str(folder), "--namespace", "/third"]) == 2
    assert "--namespace: got '/third', allowed: /, /second" in capsys.readouterr().err


def test_remapped_topics(
    driven: Driven, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write(tmp_path / "bag", [driven], ("/what_drove", "/hits"))
    assert replay.main([str(folder)]) == 2
    assert "no disk/inputs" in (error := capsys.readouterr().err)
    assert "give --inputs with one of /what_drove" in error
    assert replay.main([str(folder), "--inputs", "/what_drove"]) == 2
    assert "give --impacts with one of /hits" in capsys.readouterr().err
    assert replay.main([str(folder), "--inputs", "/what_drove", "--impacts", "/hits"]) == 0


# --- bags that cannot be replayed -----------------------------------------------------------------
@pytest.mark.parametrize(
    ("records", "told"),
    [
        (lambda run: run.session.set_paused(True), "1 records without a snapshot"),
        (lambda run: run.session.snapshot(), "replay: none of the "),  # rows are from before it
        (lambda _: None, "/disk/inputs: got 'no messages'"),
    ],
)
def test_a_bag_without_what_a_replay_begins_with(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], records: Callable[[Driven], None], told: str
) -> None:
    run = Driven()
    run.advance(3.0)
    records(run)
    del run.records[0]
    assert replay.main([str(write(tmp_path / "bag", [run]))]) == 2
    error = capsys.readouterr().err
    assert told in error
    assert len(error.splitlines()) == 1


# --- what if --------------------------------------------------------------------------------------
def test_what_if_compares_and_draws(
    run_1: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figure = tmp_path / "figure.png"
    options = ["--what-if", "restitution:=0.3", "friction:=0.1", "--figure", str(figure)]
    assert replay.main([str(run_1), *options]) == 0
    out = capsys.readouterr().out
    assert "recorded" in out
    assert "restitution:=0.3 friction:=0.1" in out
    verdict = out.index("replay identical: ")
    assert verdict < out.index("what if, ") < out.index("they differ from ")
    assert out.splitlines()[-1] == f"figure: {figure}"
    assert figure.stat().st_size > 10_000


# --- processes ------------------------------------------------------------------------------------
def test_a_live_run_recorded_in_mid_run_is_identical(
    start: Starter, peer: Peer, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Commands, kicks, parameters, pause, steps and resets before and while it is recorded.

    The recording is gapless, has what belongs to it, and other tools count the same messages.
    """
    folder = tmp_path / "run"
    simulator = start("simulator", "--ros-args", "-p", "preset:=pizza_multiple_toss",
                      "-p", "snapshot_period:=0.5")  # fmt: skip
    peer.settle()
    peer.publish("platform/axial_amplitude", Float64(data=0.045))
    peer.wait_for_record("motion")
    peer.spin_until(lambda: len(peer.heard["disk/impacts"]) > 3)
    options = ("-p", "max_duration:=1.5", "-p", "compression:=lz4")
    recorder = start("recorder", str(folder), "--ros-args", *options)
    recorder.wait_for("subscribed to /disk/impacts")
    peer.command((0.4, {"axial_amplitude": 0.05, "frequency": 3.2}), (0.9, {"axial_amplitude": 0.04,
                 "frequency": 3.0}))  # fmt: skip
    peer.publish(
        "disk/impulse", impulse_to_msg(ImpulseRequest((0.0, 0.0, 0.1), (0.0, 0.0, 0.001), 0))
    )
    begun = peer.wait_for_record("impulse")["time_ns"] / NS
    assert peer.set_parameters(restitution=0.45, friction=0.4).successful
    assert peer.call(SetBool, "pause", SetBool.Request(data=True)).success
    peer.publish(
        "disk/impulse", impulse_to_msg(ImpulseRequest((0.0, 0.0, 0.05), (0.0, 0.0, 0.0), 0))
    )
    peer.wait_for_record("impulse")
    assert peer.call(Trigger, "step").success
    assert peer.call(SetBool, "pause", SetBool.Request(data=False)).success
    peer.spin_until(lambda: np.count_nonzero(peer.rows["time"] > begun) > 15)  # these are recorded
    assert peer.call(Trigger, "reset").success
    rows = len(peer.rows)
    peer.spin_until(lambda: len(peer.rows) > rows + 5)
    assert recorder.end(signal.SIGTERM) == 0
    assert not recorder.complaints
    assert simulator.end(signal.SIGINT) == 0
    with bag.open(folder) as run:
        assert run.complete
        for name in ("/disk/inputs", "/disk/impacts", "/disk/phase", "/platform/motion"):
            assert run.topics[name].count
        assert run.topics["/disk/inputs"].qos[0]["durability"] == "transient_local"
        preset = "preset/pizza_multiple_toss.yaml"
        assert {"versions.yaml", "recorder.yaml", preset} <= set(run.attachments)
        attached = yaml.safe_load(run.attachments["parameters/bouncing_disk.yaml"])
        assert run.notes["lost_impact_rows"] == "0"
        number = run.message_count
    assert attached["/bouncing_disk"]["ros__parameters"]["preset"] == "pizza_multiple_toss"
    with Reader(folder) as reader:
        assert sum(1 for _ in reader.messages()) == reader.message_count == number
    capfd.readouterr()
    assert replay.main([str(folder)]) == 0
    out, err = capfd.readouterr()
    lines = out.splitlines()
    assert lines[-1].startswith("replay identical: ")
    assert int(lines[-1].split()[2]) > 10
    assert ", 0 rows missing in the bag" in out
    assert err == ""
    files = sorted(folder.glob("*.mcap"))
    assert len(files) > 1
    for file in files:  # each begins with a snapshot
        assert replay.main([str(file)]) == 0


def test_a_signal_ends_it_with_130(
    driven: Driven, tmp_path: Path, capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """In the midst of events by the hundred million."""
    long = Driven(preset="", frequency=3000.0, axial_amplitude=1e-6)
    long.session.advance(2000 * 10**9, 1)  # its last row lies far ahead
    rows = driven.batches[-1][-1:].copy()
    rows["time"], rows["index"] = 1e5, 1e12
    long.rows.append((long.sent + 1, rows))
    replay_bag = bag_streams.replay_bag

    def interrupted(*given: Any) -> Any:
        threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGTERM)).start()
        return replay_bag(*given)

    monkeypatch.setattr(bag_streams, "replay_bag", interrupted)
    code, _, lines = ends(capfd, "replay", str(write(tmp_path / "long", [long])))
    assert (code, lines) == (130, ["replay: interrupted"])

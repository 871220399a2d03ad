"""The recorder as a process, with the simulator and with publishers of the test itself."""

from __future__ import annotations

import json
import re
import signal
import time
from array import array
from pathlib import Path

import numpy as np
import pytest
import yaml
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.rosbag2 import Reader
from std_msgs.msg import Float64MultiArray, String

from bouncing_disk_ros import bag
from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.run.input_records import from_json
from support.in_process import ends
from support.processes import PATIENCE, Process, Starter, recorder
from support.replayed import replayed
from support.talker import RELIABLE, Talker, wait_until

BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def counts(folder: Path) -> dict[str, int]:
    with bag.open(folder) as run:
        return {name: topic.count for name, topic in run.topics.items()}


def finish(process: Process, number: int = signal.SIGINT) -> None:
    assert process.end(number) == 0, process.output
    assert not process.complaints


def test_a_run_is_recorded_in_files_of_which_each_replays_alone(
    start: Starter, tmp_path: Path
) -> None:
    process = recorder(start, tmp_path / "run", "max_duration:=2.0", "compression:=lz4")
    simulator = start("simulator", "--ros-args", "-p", "preset:=pizza_multiple_toss")
    simulator.wait_for("running at")
    third = tmp_path / "run" / "run_2.mcap"
    wait_until(third.is_file)
    finish(process, signal.SIGTERM)
    assert "/disk/impacts" in process.stdout
    own = ("/disk/inputs", "/disk/phase", "/platform/motion")
    with bag.open(tmp_path / "run" / "run_1.mcap") as run:
        assert all(run.topics[name].count for name in own)
        rows = run.rows("/disk/impacts")
        records = [from_json(text) for text in run.columns("/disk/inputs", ["data"])["data"]]
    assert records[0]["kind"] == "snapshot"
    assert len(rows) > 0
    again, _ = replayed(records, round(float(rows["time"][-1]) * 1e9) + 1)
    first = int(np.searchsorted(again["index"], rows["index"][0]))
    assert again[first : first + len(rows)].tobytes() == rows.tobytes()
    with bag.open(tmp_path / "run") as run:  # records and rows are gapless, and nothing comes twice
        assert run.complete
        texts, rows = run.columns("/disk/inputs", ["data"])["data"], run.rows("/disk/impacts")
        number = run.message_count
        parameters = yaml.safe_load(run.attachments["parameters/bouncing_disk.yaml"])
        assert {"versions.yaml", "recorder.yaml", "preset/pizza_multiple_toss.yaml"} <= set(
            run.attachments
        )
        assert run.notes["lost_impact_rows"] == "0"
        assert run.topics["/disk/inputs"].qos[0]["durability"] == "transient_local"
    assert parameters["/bouncing_disk"]["ros__parameters"]["preset"] == "pizza_multiple_toss"
    index = [from_json(text)["index"] for text in texts]
    assert index == list(range(index[0], index[0] + len(index)))
    assert rows.dtype == IMPACT_DTYPE
    assert len(rows) > 3
    np.testing.assert_array_equal(rows["index"], np.arange(len(rows)) + rows["index"][0])
    with Reader(tmp_path / "run") as reader:
        assert sum(1 for _ in reader.messages()) == reader.message_count == number


def test_what_a_stalled_recorder_misses_is_counted(
    start: Starter, talker: Talker, tmp_path: Path
) -> None:
    process = recorder(start, tmp_path / "run", "topics:=/weak", "status_period:=0.05")
    publisher = talker.publisher("/weak", Float64MultiArray, BEST_EFFORT)
    message, sent = Float64MultiArray(data=array("d", range(1000))), 1
    publisher.publish(message)
    process.wait_for("recording: .* 1 messages")
    process.send(signal.SIGSTOP)
    for _ in range(4000):  # 32 MB: more than the middleware holds for a best-effort reader
        publisher.publish(message)
        sent += 1
    process.send(signal.SIGCONT)
    end = time.monotonic() + PATIENCE
    while not re.search(r", [1-9]\d* lost on the way", process.output):
        assert time.monotonic() < end, process.output  # a gap shows when something comes after it
        publisher.publish(message)
        sent += 1
        time.sleep(0.05)
    finish(process)
    match = process.wait_for(r"/weak +(\d+) recorded, lost on the way: (\d+)")
    with bag.open(tmp_path / "run") as run:
        sequences = [row.sequence for row in run.messages("/weak")]
    assert sequences[0] == 1
    assert len(sequences) == int(match[1])
    assert int(match[2]) > 0
    assert int(match[1]) + int(match[2]) == sequences[-1] <= sent


def test_what_the_queue_cannot_hold_is_told(start: Starter, talker: Talker, tmp_path: Path) -> None:
    process = recorder(start, tmp_path / "run", "topics:=/large", "queue_size:=0.001")
    publisher, sent = talker.publisher("/large", Float64MultiArray), 300
    message = Float64MultiArray(data=array("d", range(10_000)))
    for _ in range(sent):
        publisher.publish(message)
    publisher.wait_for_all_acked()
    finish(process)
    match = process.wait_for(r"/large +(\d+) recorded, lost on the way: 0(.*: (\d+))?")
    assert int(match[1]) + int(match[3] or 0) == sent
    with bag.open(tmp_path / "run") as run:
        assert run.message_count == int(match[1])
        dropped = json.loads(run.notes["received_but_not_recorded"])
    assert dropped.get("/large", 0) == int(match[3] or 0)


def test_losses_are_counted_by_publisher(start: Starter, talker: Talker, tmp_path: Path) -> None:
    """Not of two at once, whose numbers mix; one that begins again has lost nothing."""
    process = recorder(start, tmp_path / "run", "topics:=['/both', '/again']")
    first = talker.publisher("/both")
    second = talker.publisher("/both", node=talker.new_node("second"))
    for number in range(20):
        first.publish(String(data=f"first {number}"))
        if number % 3 == 0:
            second.publish(String(data=f"second {number}"))
    for publisher in (first, second):
        publisher.wait_for_all_acked()
    for _ in range(3):
        publisher = talker.publisher("/again")
        for number in range(10):
            publisher.publish(String(data=str(number)))
        publisher.wait_for_all_acked()
        talker.node.destroy_publisher(publisher)
    finish(process)
    assert "lost on the way: not countable: 2 publishers on the topic" in process.stdout
    assert "30 recorded, lost on the way: 0" in process.stdout
    assert counts(tmp_path / "run") == {"/both": 27, "/again": 30}


def test_topics_of_every_kind(start: Starter, talker: Talker, tmp_path: Path) -> None:
    early = talker.node.create_publisher(String, "/all/latched", LATCHED)
    early.publish(String(data="before the recorder"))
    process = recorder(
        start, tmp_path / "run", "regex:=/all/.*", "exclude:=.*/not", "status_period:=0.05"
    )
    talker.node.create_publisher(String, "/all/not", RELIABLE)
    talker.node.create_publisher(String, "/all/silent", RELIABLE)
    late = talker.publisher("/all/late")
    weak = talker.publisher("/all/weak", qos=BEST_EFFORT)
    empty = talker.publisher("/all/empty", Float64MultiArray)
    for publisher in (late, weak):
        publisher.publish(String(data="x"))
    empty.publish(Float64MultiArray())
    late.wait_for_all_acked()  # a subscription that asks for less is heard by both
    talker.publisher("/all/late", qos=BEST_EFFORT, node=talker.new_node("weaker")).publish(
        String(data="weaker")
    )
    process.wait_for("subscribed to /all/silent")
    process.wait_for("subscribed to /all/latched")
    process.wait_for("recording: .* 5 messages")
    finish(process)
    found = counts(tmp_path / "run")
    assert found == {f"/all/{n}": 1 for n in ("latched", "weak", "empty")} | {
        "/all/late": 2, "/all/silent": 0
    }  # fmt: skip
    with bag.open(tmp_path / "run") as run:
        assert run.columns("/all/latched")["data"][0] == "before the recorder"
        assert run.columns("/all/late")["data"].tolist() == ["x", "weaker"]
        assert run.columns("/all/empty")["data"].shape == (1, 0)
    with Reader(tmp_path / "run") as reader:
        assert sum(1 for _ in reader.messages()) == 5


def test_pause_resume_and_split(start: Starter, talker: Talker, tmp_path: Path) -> None:
    """Though time stands still: use_sim_time, as launch files set it, and nobody has a clock."""
    begun = time.time_ns()
    process = recorder(
        start, tmp_path / "run", "topics:=/text", "start_paused:=true", "status_period:=0.05",
        "use_sim_time:=true",
    )  # fmt: skip
    publisher = talker.publisher("/text")

    def say(text: str, number: int) -> None:
        publisher.publish(String(data=text))
        process.wait_for(rf"recording: .* {number} messages")

    assert talker.call("resume") == "recording"
    say("one", 1)
    assert talker.call("split") == "a new file was begun"
    say("two", 2)
    assert talker.call("pause") == "paused"
    publisher.publish(String(data="not this"))
    publisher.wait_for_all_acked()
    assert talker.call("resume") == "recording"
    say("three", 3)
    finish(process)
    assert "3 recorded, lost on the way: 0" in process.stdout
    assert sorted(file.name for file in (tmp_path / "run").glob("*.mcap")) == [
        "run_0.mcap", "run_1.mcap"]  # fmt: skip
    with bag.open(tmp_path / "run") as run:
        assert run.columns("/text")["data"].tolist() == ["one", "two", "three"]
        assert run.start_ns >= begun  # times of reception are the machine's
    with bag.open(tmp_path / "run" / "run_0.mcap") as run:
        assert run.columns("/text")["data"].tolist() == ["one"]


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["/proc/none/run"], "output: got '/proc/none/run', allowed: the name of a new folder"),
        (["--ros-args", "-p", "compression:=rar"], "compression: got 'rar', allowed: zstd, lz4"),
        (["--ros-args", "-p", "compresion:=lz4"], "Did you mean compression?"),
        (["--ros-args", "-p", "topics:=/2nd"], "topics: got '/2nd', allowed: names of topics"),
        (["--ros-args", "-p", "regex:='('"], "allowed: a regular expression"),
        (["--ros-args", "-p", "presets:=/none/none.yaml"], "recorder: preset: got"),
        # below what the head of each file takes
        (["--ros-args", "-p", "max_size:=0.002"], "got '0.002 MB', allowed: 0 for one file, or at"),
    ],
)
def test_bad_input_is_one_line(
    ros_domain: int, capfd: pytest.CaptureFixture[str], tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, arguments: list[str], line: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    code, _, (told,) = ends(capfd, "recorder", *arguments)
    assert code == 2
    assert line in told
    assert not list(tmp_path.iterdir())

"""The recorder as a process, with the simulator and with publishers of the test itself."""

from __future__ import annotations

import json
import re
import signal
import time
from array import array
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rosbags.rosbag2 import Reader
from std_msgs.msg import Float64MultiArray, String

from bouncing_disk_ros import bag
from support.processes import Process, Starter, recorder, wait_until
from support.ros_peer import RELIABLE, Peer, Talker

BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def counts(folder: Path) -> dict[str, int]:
    with bag.open(folder) as run:
        return {name: topic.count for name, topic in run.topics.items()}


def finish(process: Process, number: int = signal.SIGINT) -> None:
    assert process.end(number) == 0, process.output
    assert not process.complaints


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

    def publish_another() -> None:  # a gap shows when something comes after it
        nonlocal sent
        publisher.publish(message)
        sent += 1
        time.sleep(0.05)

    lost = re.compile(r", [1-9]\d* lost on the way")
    wait_until(lambda: lost.search(process.output), publish_another, lambda: process.output)
    finish(process)
    match = process.wait_for(r"/weak +(\d+) recorded, lost on the way: (\d+)")
    with bag.open(tmp_path / "run") as run:
        sequences = [row.sequence for row in run.messages("/weak")]
    assert sequences[0] == 1
    assert len(sequences) == int(match[1])
    assert int(match[2]) > 0
    assert int(match[1]) + int(match[2]) == sequences[-1] <= sent


def test_the_last_inputs_of_a_simulator_reach_a_recorder_that_stalls(
    start: Starter, ros_domain: int, tmp_path: Path
) -> None:
    """The middleware has no room for the inputs at first, and sends them again."""
    simulator = start("simulator", "--ros-args", "-p", "state_rate:=1000.0")
    simulator.wait_for("running at")
    process = recorder(start, tmp_path / "run")
    peer = Peer()
    peer.settle()
    peer.latest("joint_states")
    process.wait_for("subscribed to /disk/inputs")
    process.send(signal.SIGSTOP)
    heard = len(peer.heard["joint_states"])
    peer.spin_until(lambda: len(peer.heard["joint_states"]) > heard + 2000)
    sent = [0.0001 * k for k in range(1, 41)]
    for amplitude in sent:
        peer.command((0.0, {"axial_amplitude": amplitude}))
    peer.spin_until(lambda: sum(record["kind"] == "motion" for record in peer.records) == len(sent))
    simulator.send(signal.SIGINT)
    end = time.monotonic() + 1.0  # a simulator that does not wait ends within this time
    while simulator.running and time.monotonic() < end:
        time.sleep(0.01)
    process.send(signal.SIGCONT)
    assert simulator.wait() == 0
    assert process.end() == 0
    peer.close()
    with bag.open(tmp_path / "run") as run:
        decode = run.decoder("/disk/inputs")
        records = [json.loads(decode(row.data).data) for row in run.messages({"/disk/inputs"})]
    motions = [record["points"][0][1][0] for record in records if record["kind"] == "motion"]
    assert motions == sent


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


def test_topics_and_publishers_of_every_kind(
    start: Starter, talker: Talker, tmp_path: Path
) -> None:
    """Losses are not counted of two publishers at once; one that begins again has lost nothing."""
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
    first = talker.publisher("/all/both")
    second = talker.publisher("/all/both", node=talker.new_node("second"))
    for number in range(20):
        first.publish(String(data=f"first {number}"))
        if number % 3 == 0:
            second.publish(String(data=f"second {number}"))
    for publisher in (first, second):
        publisher.wait_for_all_acked()
    for _ in range(3):
        publisher = talker.publisher("/all/again")
        for number in range(10):
            publisher.publish(String(data=str(number)))
        publisher.wait_for_all_acked()
        talker.node.destroy_publisher(publisher)
    finish(process)
    process.wait_for("/all/both +27 recorded, lost on the way: not countable: 2 publishers on the")
    process.wait_for("/all/again +30 recorded, lost on the way: 0")
    found = counts(tmp_path / "run")
    assert found == {f"/all/{n}": 1 for n in ("latched", "weak", "empty")} | {
        "/all/late": 2, "/all/silent": 0, "/all/both": 27, "/all/again": 30
    }  # fmt: skip
    with bag.open(tmp_path / "run") as run:
        assert run.columns("/all/latched")["data"][0] == "before the recorder"
        assert run.columns("/all/late")["data"].tolist() == ["x", "weaker"]
        assert run.columns("/all/empty")["data"].shape == (1, 0)
    with Reader(tmp_path / "run") as reader:
        assert sum(1 for _ in reader.messages()) == 62


def test_pause_resume_and_split(start: Starter, talker: Talker, tmp_path: Path) -> None:
    """Though time stands still: use_sim_time, as launch files set it, and nobody has a clock.

    What the recorder itself publishes is not recorded and does not count.
    """
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup it is ignored, by children too
    heard: list[DiagnosticArray] = []
    talker.node.create_subscription(DiagnosticArray, "/diagnostics", heard.append, 10)
    begun = time.time_ns()
    process = recorder(
        start, tmp_path / "run", "topics:=/text /diagnostics", "start_paused:=true",
        "status_period:=0.05",
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
    talker.spin_until(lambda: len(heard) > 1)
    publisher, before = talker.publisher("/diagnostics", DiagnosticArray), len(heard)
    for _ in range(10):
        publisher.publish(DiagnosticArray())
    talker.spin_until(lambda: len(heard) > before + 10)
    publisher.wait_for_all_acked()
    finish(process, signal.SIGHUP)  # as by SIGTERM: the terminal was closed
    process.wait_for("/text +3 recorded, lost on the way: 0")
    process.wait_for("/diagnostics +10 recorded, lost on the way: 0")
    assert sorted(file.name for file in (tmp_path / "run").glob("*.mcap")) == [
        "run_0.mcap", "run_1.mcap"]  # fmt: skip
    with bag.open(tmp_path / "run") as run:
        assert run.columns("/text")["data"].tolist() == ["one", "two", "three"]
        assert run.start_ns >= begun  # times of reception are the machine's
    with bag.open(tmp_path / "run" / "run_0.mcap") as run:
        assert run.columns("/text")["data"].tolist() == ["one"]

"""The simulator in real time in the process of the test, watched and commanded over DDS.

Assertions on time use simulated stamps and instants of the record, never the time of arrival.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool, Trigger

from bouncing_disk_ros.niceness import SWITCH_SECONDS
from bouncing_disk_ros.nodes.simulator import clocks
from bouncing_disk_ros.parameters import DEFAULTS
from bouncing_disk_ros.ros.from_messages import msg_to_joints, msg_to_motion, time_to_ns
from bouncing_disk_ros.run.session import motion_of
from bouncing_disk_ros.units import NS
from support.ros_peer import Peer
from support.wrong_commands import WRONG, wrench


def test_a_stamped_programme_is_reached_when_asked_and_moves_the_platform_so(peer: Peer) -> None:
    # long enough for a busy machine to publish it while it is in force
    peer.simulator(crossfade_duration=1.0, state_rate=200.0)
    peer.settle()
    peer.spin_until(lambda: peer.heard["joint_states"])
    peer.publisher("platform/command")  # found before the time is taken
    asked = peer.now_ns() + 2 * NS
    values = {"axial_amplitude": 0.02, "angular_amplitude": 0.3, "frequency": 4.0, "phase_lag": 1.0}
    peer.command((0.0, values), stamp_ns=asked)
    peer.spin_until(lambda: msg_to_motion(peer.latest("platform/motion")).start[0] == 0.02)
    steady = msg_to_motion(peer.heard["platform/motion"][-1])
    assert steady.start == steady.target == tuple(values.values())
    fades = [
        msg for msg in peer.heard["platform/motion"] if msg_to_motion(msg).start != steady.start
    ]
    fade_msg = next(msg for msg in fades if msg_to_motion(msg).target == steady.target)
    # the stamp of the end, in ROS time, is what was asked, to the nanosecond
    begun = time_to_ns(fade_msg.header.stamp)
    assert begun + time_to_ns(fade_msg.points[1].time_from_start) == asked
    assert time_to_ns(fade_msg.points[1].time_from_start) == NS
    # from there on the platform moves as asked, in a hundred samples (a busy reader misses some)

    def later() -> list[JointState]:
        states = peer.heard["joint_states"]
        return [msg for msg in states if time_to_ns(msg.header.stamp) > asked]

    peer.spin_until(lambda: len(later()) >= 100)
    for msg in later():
        tau = steady.forcing_phase + math.tau * 4.0 * (time_to_ns(msg.header.stamp) - asked) / NS
        joints = msg_to_joints(msg)
        assert joints["platform_axial"][0] == pytest.approx(0.02 * math.sin(tau), abs=1e-9)
        assert joints["platform_rotation"][0] == pytest.approx(0.3 * math.sin(tau + 1), abs=1e-9)


def test_wrong_commands_of_every_kind_are_refused_and_nothing_changes(
    peer: Peer, capfd: pytest.CaptureFixture[str]
) -> None:
    peer.simulator()
    peer.settle()
    for topic, msg, _ in WRONG:
        peer.publish(topic, msg)
    lines: list[str] = []

    def told() -> int:
        """Refusals on the log: one for each line, and those that a line counts besides."""
        lines.extend(line for line in capfd.readouterr().err.splitlines() if "refused:" in line)
        more = [re.search(r"\(and (\d+) more", line) for line in lines]
        return len(more) + sum(int(match[1]) for match in more if match)

    peer.spin_until(lambda: refused(peer)[0] == told() == len(WRONG))
    assert any(reason in refused(peer)[1] for _, _, reason in WRONG)
    assert len(lines) < len(WRONG)  # one a second for each reason
    assert {record["kind"] for record in peer.records} <= {"snapshot", "pause"}
    motions = [msg_to_motion(msg) for msg in peer.heard["platform/motion"]]
    assert {motion.start for motion in motions} == {motion.target for motion in motions}
    assert {motion.target for motion in motions} == {motion_of(DEFAULTS)}
    # and it runs on: the right command after all the wrong ones is taken
    peer.command((0.0, {"frequency": 2.5}))
    peer.spin_until(lambda: msg_to_motion(peer.latest("platform/motion")).target.frequency == 2.5)


def refused(peer: Peer) -> tuple[int, str]:
    """How many inputs the newest diagnostics count as refused, and why the last was."""
    values = peer.diagnostic("inputs")[2]
    return int(values["refused"]), values["last refusal"]


def test_stamp_and_simulated_time_of_the_motion_lie_on_the_line_in_force(peer: Peer) -> None:
    peer.simulator()
    peer.settle()

    def offset() -> int:
        """Where simulated time 0 would lie in ROS time, by the newest motion."""
        msg = peer.latest("platform/motion")
        return time_to_ns(msg.header.stamp) - msg_to_motion(msg).begin_ns

    changes: list[Callable[[], Any]] = [
        lambda: peer.call(SetBool, "pause", SetBool.Request(data=False)),
        lambda: peer.call(Trigger, "reset"),
        lambda: peer.set_parameters(real_time_factor=1),
    ]
    for change in changes:
        peer.call(SetBool, "pause", SetBool.Request(data=True))
        before = offset()
        peer.call(SetBool, "pause", SetBool.Request(data=False))
        peer.spin_until(lambda: offset() != before)  # noqa: B023
        change()
        heard = len(peer.heard["joint_states"])
        peer.spin_until(lambda: len(peer.heard["joint_states"]) > heard + 20)  # noqa: B023
        # samples of the line in force lie on the grid of 10 ms of simulated time
        stamp = time_to_ns(peer.heard["joint_states"][-1].header.stamp)
        assert (stamp - offset()) % (NS // 100) == 0


def test_a_late_subscriber_gets_motion_phase_and_the_whole_record(peer: Peer) -> None:
    peer.simulator(start_paused=True)
    peer.settle()
    peer.command((0.0, {"axial_amplitude": 0.02}))
    peer.spin_until(lambda: peer.records and peer.records[-1]["kind"] == "motion")
    late = Peer()
    assert msg_to_motion(late.latest("platform/motion")).target.axial_amplitude == 0.02
    late.spin_until(lambda: len(late.records) == len(peer.records))
    assert late.records[0]["kind"] == "snapshot"
    late.spin_until(lambda: late.phases == ["paused"])
    late.close()


@pytest.mark.parametrize(
    ("before", "beside"),
    [(0.005, SWITCH_SECONDS), (SWITCH_SECONDS / 2.0, SWITCH_SECONDS / 2.0)],
    ids=["Python's default", "a shorter one"],
)
def test_ticks_wait_for_no_longer_than_the_switch_interval(
    peer: Peer, before: float, beside: float
) -> None:
    """A study beside a simulator held the interpreter's lock for Python's 5 ms at a time."""
    own = sys.getswitchinterval()
    sys.setswitchinterval(before)
    try:
        peer.simulator()
        assert sys.getswitchinterval() == pytest.approx(beside)
    finally:
        sys.setswitchinterval(own)


def test_a_node_may_be_destroyed_twice(peer: Peer) -> None:
    """As any node of rclpy. It waited for the subscribers of topics that were gone: a traceback."""
    peer.simulator().destroy_node()  # and once more by the peer


def test_two_nodes_in_two_namespaces_keep_apart(warm_kernels: None) -> None:
    left, right = Peer("left"), Peer("right")
    for name in ("left", "right"):
        left.simulator(namespace=name, preset="pizza_multiple_toss")
    left.command((0.0, {"axial_amplitude": 0.02}))
    left.wait_for_record("motion")
    inputs = ("inputs", "left/bouncing_disk")
    left.spin_until(lambda: left.diagnostic(*inputs)[2]["accepted"] == "2")
    left.spin_until(lambda: msg_to_motion(left.latest("platform/motion")).target[0] == 0.02)
    assert msg_to_motion(right.latest("platform/motion")).target.axial_amplitude != 0.02
    assert "motion" not in {record["kind"] for record in right.records}
    assert left.diagnostic("inputs", "right/bouncing_disk")[2]["accepted"] == "1"
    left.close()
    right.close()


def test_two_nodes_in_one_namespace_are_warned_of(peer: Peer) -> None:
    peer.simulator()
    peer.simulator("other")

    def warned() -> bool:
        _, message, _ = peer.diagnostic("inputs")
        return "another node publishes platform/motion" in message

    peer.spin_until(warned)


def test_a_later_publisher_of_the_clock_is_warned_of(
    peer: Peer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clocks, "YOUNG_NS", 0)  # else it may have been there first
    peer.simulator(publish_clock=True)

    def warned() -> bool:
        _, message, _ = peer.diagnostic("real time")
        return "another node publishes /clock" in message

    assert not warned()
    other = peer.node.create_publisher(Clock, "/clock", 1)
    peer.spin_until(warned)
    peer.node.destroy_publisher(other)
    peer.spin_until(lambda: not warned())


# --- speed ----------------------------------------------------------------------------------------
def test_free_running_is_faster_than_the_clock_and_loses_nothing(peer: Peer) -> None:
    peer.simulator(start_paused=True, rotor_speed_rate=1.0, state_rate=1.0)
    peer.settle()
    assert peer.set_parameters(real_time_factor=0.0).successful
    peer.call(SetBool, "pause", SetBool.Request(data=False))
    began = peer.now_ns()
    peer.spin_until(lambda: len(peer.rows) > 3000)
    peer.call(SetBool, "pause", SetBool.Request(data=True))
    elapsed = (peer.now_ns() - began) / NS
    # records may be found only after the service has answered
    peer.spin_until(lambda: bool(peer.records) and bool(peer.records[-1].get("paused")))
    assert peer.records[-1]["time_ns"] / NS > 3.0 * elapsed


def test_a_simulator_that_cannot_keep_up_says_so_and_stays_alive(
    peer: Peer, capfd: pytest.CaptureFixture[str]
) -> None:
    peer.simulator(preset="swum", real_time_factor=100000.0, state_rate=1.0)
    peer.settle()
    peer.spin_until(lambda: peer.diagnostic("real time")[0] == 2)
    said = r"\[ERROR\].*real time: running, .* behind: lower real_time_factor"
    assert re.search(said, capfd.readouterr().err)
    assert peer.set_parameters(restitution=0.4).successful
    assert peer.call(SetBool, "pause", SetBool.Request(data=True)).success
    assert peer.set_parameters(real_time_factor=1.0).successful
    assert peer.call(SetBool, "pause", SetBool.Request(data=False)).success
    peer.spin_until(lambda: peer.diagnostic("real time")[:2] == (0, "running"))  # anew, from here


def test_a_long_step_leaves_services_and_diagnostics_alive_and_can_be_cancelled(
    peer: Peer, capfd: pytest.CaptureFixture[str]
) -> None:
    peer.simulator(start_paused=True, frequency=1e-6)
    peer.settle()
    assert "under way" in peer.call(Trigger, "step").message
    for _ in range(2):
        peer.next_diagnostics()
        assert peer.diagnostic("real time")[1] == "stepping"
        peer.spin_until(lambda: peer.latest("disk/run_state").position[0] == 4.0)  # another topic
    peer.publish("disk/impulse", wrench("z", 0.001))
    peer.wait_for_record("impulse")
    assert peer.call(Trigger, "reset").success  # which ends it as well
    assert "under way" in peer.call(Trigger, "step").message
    assert peer.call(SetBool, "pause", SetBool.Request(data=True)).message.startswith("paused at")
    peer.spin_until(lambda: peer.diagnostic("real time")[1] == "paused")
    said = capfd.readouterr().err
    for line in ("accepted: disk/impulse: 0.001 N·s", "accepted: ~/reset", "accepted: ~/pause"):
        assert line in said


def test_an_ultrasonic_motor_publishes_every_impact(peer: Peer) -> None:
    """It chatters: rows of both kinds."""
    peer.simulator(preset="swum", axial_amplitude=7.2e-7)
    peer.settle()
    peer.spin_until(lambda: peer.heard["disk/impacts"])
    peer.heard["disk/impacts"].clear()
    peer.spin_until(lambda: sum(msg.width for msg in peer.heard["disk/impacts"]) > 60_000)
    rows = peer.rows
    steps = np.diff(rows["index"])
    (gaps,) = np.nonzero(steps != 1.0)
    assert not len(gaps), [(rows["index"][i], steps[i], rows["time"][i]) for i in gaps[:5]]
    order = rows["cycles"] + rows["forcing_phase"] / math.tau
    assert np.all(np.diff(order) >= 0.0)
    assert {msg.width for msg in peer.heard["disk/impacts"]} <= set(range(1, 1001))
    assert set(rows["kind"]) == {0, 1}
    peer.next_diagnostics()
    assert float(peer.diagnostic("energy")[2]["residual / throughput"]) < 1e-10

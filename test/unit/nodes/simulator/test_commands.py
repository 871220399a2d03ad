"""Commands from their bytes to the session: what is wrong changes nothing, and costs little."""

from __future__ import annotations

from typing import Any

import pytest
from geometry_msgs.msg import WrenchStamped
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.limits import INPUTS_AHEAD
from bouncing_disk_ros.run.health import Pending
from bouncing_disk_ros.topics import OFFSET_JOINTS
from bouncing_disk_ros.units import NS
from support.commanded import WALL_NS, CommandedSession
from support.wrong_commands import OFFSETS, WRONG, trajectory, wrench


@pytest.mark.parametrize(("topic", "msg", "reason"), WRONG)
def test_a_wrong_command_is_refused_with_its_reason(topic: str, msg: Any, reason: str) -> None:
    commanded = CommandedSession()
    before = commanded.session.simulation.snapshot()
    assert not commanded.take(topic, serialize_message(msg))
    assert commanded.last is not None
    assert commanded.last.line.startswith(topic)
    assert reason in commanded.last.line
    assert len(commanded.records) == 1  # the snapshot at its start
    assert commanded.session.simulation.snapshot() == before


def test_right_commands_are_taken() -> None:
    commanded = CommandedSession()
    assert commanded.take("platform/frequency", serialize_message(Float64(data=2.5)))
    assert commanded.take("disk/impulse", serialize_message(wrench("z", 0.1)))
    programme = trajectory(["axial_amplitude", "phase_lag"], ([0.02, 1.0], 1), ([0.03, 2.0], 3))
    assert commanded.take("platform/command", serialize_message(programme))
    assert commanded.refused == 0
    kinds = [record["kind"] for record in commanded.records]
    assert kinds == ["snapshot", "motion", "impulse", "motion"]
    (first, second) = commanded.records[-1]["points"]
    assert second[0] - first[0] == 2 * NS
    assert first[1] == [0.02, 0.5, 2.5, 1.0]


def test_what_is_wrong_in_itself_is_refused_before_the_session_is_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    commanded = CommandedSession()
    asked: list[str] = []

    def closed(field: str) -> Any:
        asked.append(field)
        raise InputError(field, "an input while inactive", "inputs while active")

    monkeypatch.setattr(commanded, "open_session", closed)
    for topic, msg, _ in WRONG:
        assert not commanded.take(topic, serialize_message(msg))
    # of the stamps that are too old, and of a start that depends on where the offset is
    assert set(asked) == {"platform/command", "disk/impulse", OFFSETS}
    assert not commanded.take("disk/impulse", serialize_message(WrenchStamped()))
    assert commanded.last is not None
    assert "while inactive" in commanded.last.line


def test_impulses_ahead_do_not_pile_up_without_end() -> None:
    commanded = CommandedSession()
    later = wrench("z", 0.1)
    later.header.stamp.sec = WALL_NS // NS + 3600
    for _ in range(INPUTS_AHEAD):
        assert commanded.take("disk/impulse", serialize_message(later))
    assert not commanded.take("disk/impulse", serialize_message(later))
    assert commanded.last is not None
    assert "a command behind 1000 that have not acted yet" in commanded.last.line
    commanded.session.reset()
    assert commanded.take("disk/impulse", serialize_message(later))


def test_accepted_commands_are_logged_with_what_is_pending() -> None:
    commanded = CommandedSession()
    programme = trajectory(["axial_amplitude"], ([0.02], 10), ([0.03], 20))
    assert commanded.take("platform/command", serialize_message(programme))
    (line,) = commanded.lines
    assert "2 point(s)" in line
    assert "pending: 2 motion(s), the first at 9.66666666" in line
    later = wrench("z", 0.1)
    later.header.stamp.sec = WALL_NS // NS + 5
    assert commanded.take("disk/impulse", serialize_message(later))
    assert "2 motion(s), 1 impulse(s), the first at 5.000000000 s" in commanded.lines[-1]
    assert commanded.take("platform/command", serialize_message(trajectory([])))
    assert "pending motions are cancelled; pending: 1 impulse(s)" in commanded.lines[-1]


def test_wrong_trajectories_leave_the_one_in_force_alone() -> None:
    commanded = CommandedSession()
    moving = trajectory(["platform_axial"], ([0.01], 1), ([0.02], 3))
    assert commanded.take(OFFSETS, serialize_message(moving))
    assert not commanded.session.advance(NS // 2)
    before = commanded.session.simulation.snapshot()
    many = JointTrajectory(joint_names=["platform_axial"], points=[moving.points[0]] * 100_000)
    for msg in (many, *(msg for topic, msg, _ in WRONG if topic == OFFSETS)):
        assert not commanded.take(OFFSETS, serialize_message(msg))
        assert commanded.last is not None
        assert "\n" not in commanded.last.line
        assert len(commanded.last.line) < 400
    assert commanded.session.simulation.snapshot() == before
    assert [record["kind"] for record in commanded.records] == ["snapshot", "trajectory"]


def test_trajectories_that_wait_for_their_stamps_are_pending() -> None:
    commanded = CommandedSession()
    for sec, names in ((6, ["platform_axial"]), (5, ["platform_rotation"]), (7, OFFSET_JOINTS)):
        later = trajectory(list(names), ([0.01] * len(names), 1))
        later.header.stamp.sec = WALL_NS // NS + sec
        assert commanded.take("platform/joint_trajectory", serialize_message(later))
    assert "pending: 3 offset(s), the first at 5.000000000 s" in commanded.lines[-1]
    assert not commanded.session.advance(5 * NS)
    assert commanded.session.pending == Pending(trajectories=2, next_ns=6 * NS)
    nothing = trajectory([])
    assert commanded.take("platform/joint_trajectory", serialize_message(nothing))
    assert commanded.session.pending == Pending()


@pytest.mark.parametrize(("ahead", "remarked"), [(86_399, False), (3 * 86_400, True)])
def test_a_stamp_more_than_a_day_ahead_is_accepted_with_a_remark(
    ahead: int, remarked: bool
) -> None:
    commanded = CommandedSession()
    later, programme = wrench("z", 0.1), trajectory(["frequency"], ([2.0], 0))
    for msg, topic in ((later, "disk/impulse"), (programme, "platform/command")):
        msg.header.stamp.sec = WALL_NS // NS + ahead
        assert commanded.take(topic, serialize_message(msg))
        assert ("its stamp lies 3 days ahead" in commanded.lines[-1]) is remarked

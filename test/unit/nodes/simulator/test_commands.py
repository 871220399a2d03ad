"""Commands from their bytes to the session: what is wrong changes nothing, and costs little."""

from __future__ import annotations

from typing import Any

import pytest
from rclpy.serialization import serialize_message
from std_msgs.msg import Float64

from bouncing_disk_ros.core.schedule import Pending
from bouncing_disk_ros.limits import INPUTS_AHEAD
from bouncing_disk_ros.run.command_validation import PointRequest
from bouncing_disk_ros.run.trajectory_validation import TrajectoryRequest
from bouncing_disk_ros.topics import OFFSET_JOINTS
from bouncing_disk_ros.units import NS
from support.checks import there
from support.commanded import WALL_NS, CommandedSession
from support.wrong_commands import WRONG, trajectory, wrench


def test_a_wrong_command_is_refused_with_its_reason() -> None:
    commanded = CommandedSession()
    before = commanded.session.simulation.snapshot()
    for topic, msg, reason in WRONG:
        assert not commanded.take(topic, serialize_message(msg)), reason
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


def test_impulses_ahead_do_not_pile_up_without_end() -> None:
    commanded = CommandedSession()
    later = wrench("z", 0.1)
    later.header.stamp.sec = WALL_NS // NS + 3600
    for _ in range(INPUTS_AHEAD):
        assert commanded.take("disk/impulse", serialize_message(later))
    assert not commanded.take("disk/impulse", serialize_message(later))
    assert "a command behind 1000 that have not acted yet" in there(commanded.last).line
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


def offset(*points: PointRequest, **fields: Any) -> TrajectoryRequest:
    return TrajectoryRequest(**{"names": ("platform_axial",), "points": points, **fields})


LATER = 10**9
BEYOND_LIMITS = [
    (offset(PointRequest((0.0,), 1, (), (0.0,))), "without velocities"),
    (offset(PointRequest((0.0,), 0)), "a later point too"),
    (offset(PointRequest((0.6,), LATER, (0.0,))), "offset_limit"),
    (offset(PointRequest((0.4,), 10**8, (0.0,))), "offset_speed_limit"),
    (offset(PointRequest((0.1,), LATER)), "a jump of the velocity"),
    (offset(PointRequest((0.1,), LATER, (0.5,))), "a jump of the velocity"),
    (offset(PointRequest((0.0,), 1), PointRequest((0.0,), LATER, (0.0,))),
     "same kinds of values"),
]  # fmt: skip


def test_an_offset_beyond_its_limits_changes_nothing() -> None:
    limits = {"offset_limit": 0.5, "offset_speed_limit": 2.0, "offset_acceleration_limit": 200.0}
    commanded = CommandedSession(**limits)
    assert not commanded.session.advance(2 * NS)
    before = commanded.session.simulation.snapshot()
    for request, said in BEYOND_LIMITS:
        assert not commanded.commands.accept(request)
        assert said in there(commanded.last).line
    assert commanded.session.simulation.snapshot() == before


def test_knots_ahead_are_limited() -> None:
    commanded = CommandedSession()
    now = WALL_NS + 3600 * NS
    points = [PointRequest((0.0,), t * 10**6) for t in range(1, 1001)]
    accepted = [
        commanded.commands.accept(offset(*points, stamp_ns=now + k * 10**12)) for k in range(20)
    ]
    assert sum(accepted) == 9  # of a thousand knots and a hold each
    assert "10000" in there(commanded.last).line
    assert commanded.commands.accept(offset())
    assert commanded.commands.accept(offset(*points, stamp_ns=now))


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

"""Random offset trajectories as serialized messages: valid ones, and wrong ones of every kind."""

from __future__ import annotations

import random
from array import array

from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.limits import COMMAND_POINTS
from bouncing_disk_ros.ros.to_messages import ns_to_duration, ns_to_time
from bouncing_disk_ros.topics import OFFSET_JOINTS
from support.random_commands import NO_NUMBERS, NS, Command, between, flipped, packed

TOPIC = "platform/joint_trajectory"
_JOINTS = ([OFFSET_JOINTS[0]], [OFFSET_JOINTS[1]], list(OFFSET_JOINTS), list(OFFSET_JOINTS[::-1]))


class RandomTrajectories:
    """Draws trajectories; `now_ns` of ROS time goes into stamps."""

    def __init__(self, rng: random.Random) -> None:
        self.rng = rng

    def trajectory(self, now_ns: int) -> JointTrajectory:
        """Lines, cubics or quintics of one joint or both, now or at a stamp; some cancel."""
        rng = self.rng
        msg = JointTrajectory(joint_names=list(rng.choice(_JOINTS)))
        stated, after, rate = rng.randrange(1, 4), 0, between(rng, 1.0, 1e3)
        for _ in range(rng.choice([0, 1, 1, 2, 5, 20])):
            point = JointTrajectoryPoint(positions=self._values(msg, 0.1 / rate))
            if stated > 1:
                point.velocities = self._values(msg, 0.1)
            if stated > 2:
                point.accelerations = self._values(msg, 0.1 * rate)
            after += 1000 + round(between(rng, 0.01, 1.0) / rate * NS)
            point.time_from_start = ns_to_duration(after)
            msg.points.append(point)
        if rng.random() < 0.5:
            msg.header.stamp = ns_to_time(now_ns + rng.randrange(NS // 10))
        return msg

    def _values(self, msg: JointTrajectory, scale: float) -> array[float]:
        return array("d", [self.rng.gauss(0.0, scale) for _ in msg.joint_names])

    def valid(self, now_ns: int) -> Command:
        """A valid trajectory."""
        return Command(TOPIC, packed(self.trajectory(now_ns)))

    def wrong(self, now_ns: int) -> Command:
        """A trajectory with a fault; a flipped bit may leave one that is valid."""
        rng, msg = self.rng, self.trajectory(now_ns)
        while not msg.points:
            msg = self.trajectory(now_ns)
        last = msg.points[-1]
        match rng.randrange(8):
            case 0:
                last.positions[0] = rng.choice(NO_NUMBERS)
            case 1:
                msg.joint_names[-1] = rng.choice(["x", "", "é" * 50, "frequency", "platform_axia"])
            case 2:
                msg.joint_names = [OFFSET_JOINTS[0]] * 2
            case 3:
                msg.points.append(last)  # not later than the one before it
            case 4:
                msg.header.stamp.sec = rng.choice([1, -5, now_ns // NS - 1000])
            case 5:
                msg.points = [last] * rng.choice([COMMAND_POINTS + 1, 20 * COMMAND_POINTS])
            case 6:
                return Command(TOPIC, flipped(rng, packed(msg)))
            case _:
                data = packed(msg)
                return Command(TOPIC, data[: rng.randrange(len(data))])
        return Command(TOPIC, packed(msg))

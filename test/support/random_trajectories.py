"""Random offset trajectories of the platform as serialized messages: valid, and wrong ones."""

from __future__ import annotations

import math
import random

from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.limits import COMMAND_POINTS
from bouncing_disk_ros.ros.conversions import ns_to_duration, ns_to_time
from bouncing_disk_ros.topics import OFFSET_JOINTS
from support.random_commands import NS, Command, between, flipped, packed

TOPIC = "platform/joint_trajectory"
LARGEST = 0.01
"""m and rad: of an offset that the disk can follow for seconds."""


def random_trajectory(rng: random.Random, now_ns: int) -> JointTrajectory:
    """Lines, cubics or quintics of one joint or both, now or at a stamp; some without points."""
    count = rng.choice([1, 1, 2])
    msg = JointTrajectory(joint_names=rng.sample(OFFSET_JOINTS, count))
    stated = rng.randrange(3)
    after = 0
    for _ in range(rng.choice([0, 1, 1, 2, 5])):
        after += 1000 + round(between(rng, 1e5, 1e8))
        point = JointTrajectoryPoint(time_from_start=ns_to_duration(after))
        for field, size in (("positions", 1.0), ("velocities", 10.0), ("accelerations", 100.0)):
            if field == "positions" or stated:
                largest = size * LARGEST
                setattr(point, field, [rng.uniform(-largest, largest) for _ in range(count)])
            if field == "velocities" and stated == 1:
                break
        msg.points.append(point)
    if rng.random() < 0.5:
        msg.header.stamp = ns_to_time(now_ns + rng.randrange(NS // 10))
    return msg


def valid_command(rng: random.Random, now_ns: int) -> Command:
    """A trajectory that is accepted, or refused alone for what is in force."""
    return Command(TOPIC, packed(random_trajectory(rng, now_ns)))


def wrong_command(rng: random.Random, now_ns: int) -> Command:
    """A trajectory with a fault; a flipped bit may leave one that is valid."""
    msg = random_trajectory(rng, now_ns)
    no_number = rng.choice([math.nan, math.inf, -math.inf, 1e300])
    point = JointTrajectoryPoint(positions=[no_number] * len(msg.joint_names))
    point.time_from_start = ns_to_duration(NS)
    match rng.randrange(8):
        case 0:
            msg.points = [point]
        case 1:
            msg.joint_names = [rng.choice(["x", "", "é" * 50, "frequency"])] * len(msg.joint_names)
            msg.points = msg.points or [point]
        case 2:
            msg.header.stamp.sec = rng.choice([1, -5])
            msg.points = [JointTrajectoryPoint(positions=[0.0] * len(msg.joint_names))]
        case 3:
            msg.points = [*msg.points, *msg.points] or [point]
        case 4:
            msg.points = [JointTrajectoryPoint(positions=[0.0] * 3, effort=[1.0])]
        case 5:
            msg.points = [point] * (COMMAND_POINTS + 1)
        case 6:
            return Command(TOPIC, flipped(rng, packed(msg)))
        case _:
            data = packed(msg)
            return Command(TOPIC, data[: rng.randrange(len(data))])
    return Command(TOPIC, packed(msg))

"""Wrong commands of every kind, each with what the line of its refusal says."""

from __future__ import annotations

import math
from typing import Any

from geometry_msgs.msg import WrenchStamped
from std_msgs.msg import Float64
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.limits import COMMAND_POINTS
from bouncing_disk_ros.ros.to_messages import impulse_to_msg
from bouncing_disk_ros.run.command_validation import ImpulseRequest
from bouncing_disk_ros.topics import OFFSET_JOINTS


def trajectory(
    names: list[str], *points: tuple[list[float], int], **fields: Any
) -> JointTrajectory:
    msg = JointTrajectory(joint_names=names)
    for positions, sec in points:
        point = JointTrajectoryPoint(positions=positions)
        point.time_from_start.sec = sec
        for field, value in fields.items():
            setattr(point, field, value)
        msg.points.append(point)
    return msg


def old(msg: Any) -> Any:
    msg.header.stamp.sec = 1
    return msg


def wrench(axis: str, value: float) -> WrenchStamped:
    msg = WrenchStamped()
    setattr(msg.wrench.force, axis, value)
    return msg


NAN, INF = math.nan, math.inf
OFFSETS = "platform/joint_trajectory"
WRONG: list[tuple[str, Any, str]] = [
    ("platform/command", trajectory(["frequency"], ([NAN], 0)), "frequency (Hz): got nan"),
    ("platform/command", trajectory(["frequency"], ([INF], 0)), "frequency (Hz): got inf"),
    ("platform/command", trajectory(["frequency"], ([0.0], 0)), "frequency (Hz): got 0.0"),
    ("platform/command", trajectory(["axial_amplitude"], ([-1.0], 0)), "(m): got -1.0"),
    ("platform/command", trajectory(["amplitude"], ([1.0], 0)), "joint_names: got 'amplitude'"),
    ("platform/command", trajectory(["frequency"] * 2, ([1.0, 2.0], 0)), "each name once"),
    ("platform/command", trajectory(["frequency"], ([1.0, 2.0], 0)), "got '2 values', allowed: 1"),
    ("platform/command", trajectory([], ([], 0)), "joint_names: got 'no names'"),
    ("platform/command", trajectory(["frequency"], ([1.0], 2), ([2.0], 1)), "increasing"),
    ("platform/command", trajectory(["frequency"], ([1.0], -1)), "allowed: >= 0 s"),
    ("platform/command", trajectory(["frequency"], ([1.0], 0), velocities=[1.0]), "velocities"),
    ("platform/command", trajectory(["frequency"], ([1.0], 0), effort=[1.0]), "effort"),
    ("platform/command", trajectory(["frequency"], ([1.0], 1), ([1.0], 1)), "> 1 s, strictly"),
    (
        "platform/command",
        trajectory(["frequency"], ([1.0], 0), ([1.0, 2.0], 1)),
        "points[1].positions: got '2 values'",
    ),
    ("platform/command", old(trajectory(["frequency"], ([1.0], 0))), "header.stamp"),
    ("platform/command", old(trajectory(["frequency"], ([1.0], 0), ([1.0], 1))), " s old"),
    ("platform/command", old(trajectory([])), " s old"),
    (
        "platform/axial_amplitude",
        Float64(data=-0.5),
        "platform/axial_amplitude (m): got -0.5",
    ),
    ("platform/frequency", Float64(data=NAN), "platform/frequency (Hz): got nan"),
    ("disk/impulse", wrench("z", NAN), "wrench.force.z: got nan"),
    (OFFSETS, trajectory(["platform_axial"], ([NAN], 1)), "positions platform_axial (m): got nan"),
    (OFFSETS, trajectory(["platform_rotation"], ([INF], 1)), "platform_rotation (rad): got inf"),
    (OFFSETS, trajectory(["platform_axial"], ([0.0], 1), velocities=[NAN]), "(m/s): got nan"),
    (OFFSETS, trajectory(["platform_axial"], ([2e6], 1)), "(m): got 2000000.0"),
    (OFFSETS, trajectory(["platform_tilt"], ([0.0], 1)), "joint_names: got 'platform_tilt'"),
    (OFFSETS, trajectory([*OFFSET_JOINTS, "frequency"], ([0.0] * 3, 1)), "got 'frequency'"),
    (OFFSETS, trajectory(["platform_axial"] * 2, ([0.0] * 2, 1)), "each name once"),
    (OFFSETS, trajectory([], ([], 1)), "joint_names: got 'no names'"),
    (OFFSETS, trajectory(["platform_axial"], ([0.0], 2), ([0.0], 2)), "strictly increasing"),
    (OFFSETS, trajectory(["platform_axial"], ([0.0], 2), ([0.0], 1)), "strictly increasing"),
    (OFFSETS, trajectory(["platform_axial"], ([0.0], -1)), "allowed: >= 0 s"),
    (OFFSETS, trajectory(["platform_axial"], ([0.0], 1), effort=[1.0]), "effort: got 'values'"),
    (OFFSETS, trajectory(["platform_axial"], ([5.0], 0)), "the offset's own state there"),
    (OFFSETS, trajectory(["platform_axial"], ([0.0, 0.0], 1)), "got '2 values', allowed: 1"),
    (OFFSETS, old(trajectory(["platform_axial"], ([0.0], 1))), "command_tolerance"),
    (
        OFFSETS,
        trajectory(["platform_axial"], *(([0.0], sec) for sec in range(1, COMMAND_POINTS + 2))),
        f"{COMMAND_POINTS + 1}",
    ),
    ("disk/impulse", wrench("x", 1.0), "wrench.force.x: got 1.0, allowed: 0"),
    ("disk/impulse", wrench("x", NAN), "wrench.force.x: got nan"),
    ("disk/impulse", wrench("z", 1e300), "wrench.force.z: got 1e+300, allowed: a finite"),
    (
        "disk/impulse",
        impulse_to_msg(ImpulseRequest((0.0, 0.0, 0.0), (0.0, 2.0, 0.0), 0)),
        "wrench.torque.y: got 2.0, allowed: 0",
    ),
    ("disk/impulse", old(wrench("z", 1.0)), "header.stamp"),
]

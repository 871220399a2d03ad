"""The message of platform/joint_trajectory from the middleware's bytes (see `serialized`)."""

from __future__ import annotations

import struct

from bouncing_disk_ros.limits import COMMAND_POINTS
from bouncing_disk_ros.ros.serialized import (
    HEAD,
    Layouts,
    cut_off,
    names_at,
    numbers_at,
    opened,
)
from bouncing_disk_ros.run.command_validation import too_many
from bouncing_disk_ros.run.trajectory_validation import TrajectoryPoint, TrajectoryRequest
from bouncing_disk_ros.units import NS

_VALUES = ("positions", "velocities", "accelerations")


def trajectory_from_bytes(field: str, data: bytes) -> TrajectoryRequest:
    """The offset trajectory asked by a trajectory_msgs/JointTrajectory, not validated yet."""
    layouts = opened(field, data)
    try:
        sec, nanosec, length = layouts.beginning.unpack_from(data, HEAD)
        names, at = names_at(layouts, field, data, HEAD + 12 + length)
        at += -at % 4
        (count,) = layouts.number.unpack_from(data, at)
        if count > COMMAND_POINTS:
            raise too_many(f"{field} points", count, COMMAND_POINTS)
        at += 4
        points = []
        for i in range(count):
            point, at = _point(layouts, f"{field} points[{i}]", data, at)
            points.append(point)
    except struct.error:
        raise cut_off(field, data) from None
    return TrajectoryRequest(names, tuple(points), sec * NS + nanosec, field)


def _point(layouts: Layouts, field: str, data: bytes, at: int) -> tuple[TrajectoryPoint, int]:
    values = []
    for name in _VALUES:
        found, at = numbers_at(layouts, data, at, f"{field}.{name}")
        values.append(found)
    effort, at = numbers_at(layouts, data, at)
    at += -at % 4
    sec, nanosec = layouts.duration.unpack_from(data, at)
    positions, velocities, accelerations = values
    after = sec * NS + nanosec
    point = TrajectoryPoint(positions, velocities, accelerations, bool(effort), after)
    return point, at + layouts.duration.size

"""The command topics' messages as they come from the middleware: serialized, sizes checked first.

rclpy makes a message of Python objects before anyone can say how large it is: measured, it takes 2
to 30 times as long for a small one, and 0.2 s for 100 kB of empty points. rosbags, which decodes
the messages of bags, takes 15 µs for one point (here 7), 9 ms for a thousand (1.4) and 32 ms for
160 kB of empty points (0.004). Here the bytes (XCDR1, as ROS 2 sends them) are read directly into
requests, nothing beyond a limit is read, and whatever else they hold is an InputError.
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Iterator
from typing import NamedTuple

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import too_many
from bouncing_disk_ros.limits import (
    COMMAND_BYTES,
    COMMAND_NAMES,
    COMMAND_POINTS,
    SHOWN_TEXT,
)
from bouncing_disk_ros.run.command_validation import (
    ImpulseRequest,
    PointRequest,
    ProgrammeRequest,
)
from bouncing_disk_ros.run.trajectory_validation import TrajectoryRequest
from bouncing_disk_ros.topics import MOTION_NAMES
from bouncing_disk_ros.units import NS

HEAD = 4
"""Bytes before the content, which name the encoding; alignment counts from their end."""
_NAMES = {name.encode(): name for name in MOTION_NAMES}
_VALUES = ("positions", "velocities", "accelerations")


class Layouts(NamedTuple):
    """How to read parts of messages in one order of bytes."""

    order: str
    number: struct.Struct
    value: struct.Struct
    beginning: struct.Struct  # stamp, length of the frame's name
    wrench: struct.Struct
    duration: struct.Struct


def _layouts(order: str) -> Layouts:
    formats = ("I", "d", "iII", "6d", "iI")
    return Layouts(order, *(struct.Struct(order + one) for one in formats))


_LAYOUTS = {b"\x00\x00": _layouts(">"), b"\x00\x01": _layouts("<")}
"""Encoding, the first two bytes -> how to read what follows."""


@functools.lru_cache(maxsize=64)
def _regular_point(order: str, names: int, aligned: bool) -> struct.Struct:
    """A point with a position for each name and nothing that is not supported.

    `aligned`: its numbers follow their count at once.
    """
    return struct.Struct(f"{order}I{'' if aligned else '4x'}{names}d3IiI")


def opened(field: str, data: bytes) -> Layouts:
    """How to read a message; InputError when it is too large or in another encoding."""
    if len(data) > COMMAND_BYTES:
        raise InputError(field, f"{len(data)} bytes", f"at most {COMMAND_BYTES} bytes")
    layouts = _LAYOUTS.get(data[:2])
    if layouts is None:
        raise InputError(field, data[:HEAD], "bytes in the encoding of ROS 2 (XCDR1)")
    return layouts


def cut_off(field: str, data: bytes) -> InputError:
    """The error of a message that ends too early."""
    return InputError(field, f"{len(data)} bytes that end too early", "a whole message")


# --- messages -------------------------------------------------------------------------------------
def value_from_bytes(name: str, field: str, data: bytes) -> ProgrammeRequest:
    """One value now (std_msgs/Float64 of platform/<name>) as the programme it stands for."""
    layouts = opened(field, data)
    try:
        values = layouts.value.unpack_from(data, HEAD)
    except struct.error:
        raise cut_off(field, data) from None
    return ProgrammeRequest((name,), (PointRequest(values, 0),), field=field, is_value=True)


def impulse_from_bytes(field: str, data: bytes) -> ImpulseRequest:
    """The impulse asked by a geometry_msgs/WrenchStamped, not validated yet."""
    layouts = opened(field, data)
    try:
        sec, nanosec, length = layouts.beginning.unpack_from(data, HEAD)
        at = HEAD + 12 + length
        numbers = layouts.wrench.unpack_from(data, at + (HEAD - at) % 8)
    except struct.error:
        raise cut_off(field, data) from None
    return ImpulseRequest(numbers[:3], numbers[3:], sec * NS + nanosec, field)


def programme_from_bytes(field: str, data: bytes) -> ProgrammeRequest:
    """The programme asked by a trajectory_msgs/JointTrajectory, not validated yet."""
    return ProgrammeRequest(*_trajectory(field, data), field)


def trajectory_from_bytes(field: str, data: bytes) -> TrajectoryRequest:
    """The offset trajectory asked by a trajectory_msgs/JointTrajectory, not validated yet."""
    return TrajectoryRequest(*_trajectory(field, data), field)


def _trajectory(field: str, data: bytes) -> tuple[tuple[str, ...], tuple[PointRequest, ...], int]:
    """The names, the points and the stamp in ns of a trajectory_msgs/JointTrajectory."""
    layouts = opened(field, data)
    try:
        names, stamp_ns, count, at = _beginning(layouts, field, data)
        points = _regular_points(layouts.order, data, at, len(names), count)
        if len(points) < count:
            points = tuple(_any_points(layouts, field, data, at, count))
    except struct.error:
        raise cut_off(field, data) from None
    return names, points, stamp_ns


# --- parts of a trajectory ------------------------------------------------------------------------
def _beginning(layouts: Layouts, field: str, data: bytes) -> tuple[tuple[str, ...], int, int, int]:
    """The names, the stamp in ns, how many points there are, and where they begin."""
    sec, nanosec, length = layouts.beginning.unpack_from(data, HEAD)
    names, at = names_at(layouts, field, data, HEAD + 12 + length)
    at += -at % 4
    (count,) = layouts.number.unpack_from(data, at)
    if count > COMMAND_POINTS:
        raise too_many(f"{field} points", count, COMMAND_POINTS)
    return names, sec * NS + nanosec, count, at + 4


def names_at(layouts: Layouts, field: str, data: bytes, at: int) -> tuple[tuple[str, ...], int]:
    """The names, each at most a little longer than a line of the log shows it; where they end."""
    at += -at % 4
    (count,) = layouts.number.unpack_from(data, at)
    if count > COMMAND_NAMES:
        raise too_many(f"{field} joint_names", count, COMMAND_NAMES)
    at += 4
    names: tuple[str, ...] = ()
    for _ in range(count):
        at += -at % 4
        (length,) = layouts.number.unpack_from(data, at)
        at += 4
        end = at + min(max(length - 1, 0), SHOWN_TEXT + 1)
        name = _NAMES.get(data[at:end])
        names += (data[at:end].decode(errors="replace") if name is None else name,)
        at += length
    return names, at


def _regular_points(
    order: str, data: bytes, at: int, names: int, count: int
) -> tuple[PointRequest, ...]:
    """The points when all are regular, which is quick; else none."""
    points = []
    for _ in range(count):
        regular = _regular_point(order, names, at % 8 == 0 or names == 0)
        if at + regular.size > len(data):
            return ()
        found = regular.unpack_from(data, at)
        if found[0] != names or found[-5:-2] != (0, 0, 0):
            return ()
        points.append(PointRequest(found[1:-5], found[-2] * NS + found[-1]))
        at += regular.size
    return tuple(points)


def _any_points(
    layouts: Layouts, field: str, data: bytes, at: int, count: int
) -> Iterator[PointRequest]:
    for i in range(count):
        values = []
        for name in _VALUES:
            found, at = numbers_at(layouts, data, at, f"{field} points[{i}].{name}")
            values.append(found)
        positions, velocities, accelerations = values
        effort, at = numbers_at(layouts, data, at)
        at += -at % 4
        sec, nanosec = layouts.duration.unpack_from(data, at)
        at += layouts.duration.size
        after_ns = sec * NS + nanosec
        yield PointRequest(positions, after_ns, velocities, accelerations, bool(effort))


def numbers_at(
    layouts: Layouts, data: bytes, at: int, field: str = ""
) -> tuple[tuple[float, ...], int]:
    """Numbers and where they end; without a `field` only the first, however many there are."""
    at += -at % 4
    (count,) = layouts.number.unpack_from(data, at)
    at += 4
    if not count:
        return (), at
    if field and count > COMMAND_NAMES:
        raise too_many(field, count, COMMAND_NAMES)
    at += (HEAD - at) % 8
    wanted = count if field else 1
    return struct.unpack_from(f"{layouts.order}{wanted}d", data, at), at + 8 * count

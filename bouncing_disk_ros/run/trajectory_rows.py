"""Offset trajectories as Python and YAML give them: rows of a time and values by joint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.parameters import plain
from bouncing_disk_ros.run.time_map import FAR_NS, nanoseconds
from bouncing_disk_ros.run.trajectory_validation import TrajectoryPoint, TrajectoryRequest
from bouncing_disk_ros.topics import OFFSET_JOINTS
from bouncing_disk_ros.units import NS

_MOST = 3  # position, velocity, acceleration


def trajectory_of(
    rows: Sequence[tuple[Any, Mapping[str, Any]]], field: str = "trajectory"
) -> TrajectoryRequest:
    """The request that (time in s, {joint: values}) stand for; not validated yet.

    Values are a position, or a list of position, velocity and acceleration as far as given. The
    first row's joints are those of all.
    """
    for i, row in enumerate(rows):
        fits = isinstance(row, (list, tuple)) and len(row) == 2 and isinstance(row[1], Mapping)
        if not fits:
            raise InputError(f"{field}[{i}]", row, "(time in s, {joint: values})")
    names = tuple(rows[0][1]) if rows else ()
    points = []
    for i, (time, values) in enumerate(rows):
        where = f"{field}[{i}]"
        for name in values:
            if name not in OFFSET_JOINTS:
                hint = closest(str(name), OFFSET_JOINTS)
                raise InputError(where, name, " and ".join(OFFSET_JOINTS), hint)
        if set(values) != set(names):
            raise InputError(where, ", ".join(values), ", ".join(names) + ", as in the first point")
        stated = [_numbers(f"{where} {name}", values[name]) for name in names]
        if len({len(one) for one in stated}) > 1:
            raise InputError(where, values, "as many values for each joint")
        columns = [tuple(column) for column in zip(*stated, strict=True)]
        positions, velocities, accelerations = [*columns, (), (), ()][:_MOST]
        after = _time(f"{where} time", time)
        points.append(TrajectoryPoint(positions, velocities, accelerations, after_ns=after))
    return TrajectoryRequest(names, tuple(points), field=field)


def _numbers(field: str, given: Any) -> list[float]:
    value = plain(given)
    values = list(value) if isinstance(value, (list, tuple)) else [value]
    numbers = [plain(one) for one in values]
    if not 1 <= len(numbers) <= _MOST or not all(type(one) in (int, float) for one in numbers):
        raise InputError(field, given, "a position, or position, velocity and acceleration")
    return [float(one) for one in numbers]  # type: ignore[arg-type]


def _time(field: str, given: Any) -> int:
    seconds = plain(given)
    number = seconds if isinstance(seconds, (int, float)) else -1.0
    if isinstance(number, bool) or not 0.0 <= number <= FAR_NS / NS:
        raise InputError(field, given, "seconds >= 0")
    return nanoseconds(number)

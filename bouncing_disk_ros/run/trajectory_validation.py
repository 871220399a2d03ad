"""Offset trajectories: validation of requests, and requests from rows of Python and YAML."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from bouncing_disk_ros.core.offset import (
    CUBIC,
    LINE,
    QUINTIC,
    Extremes,
    Knot,
    Lane,
    Offset,
    OffsetState,
)
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.field_checks import number, out_of_range, plain
from bouncing_disk_ros.limits import KNOTS_AHEAD
from bouncing_disk_ros.parameters import TABLE, Value
from bouncing_disk_ros.run.command_validation import Instant, PointRequest, check_names, too_old
from bouncing_disk_ros.run.time_map import FAR_NS, nanoseconds
from bouncing_disk_ros.topics import OFFSET_JOINTS
from bouncing_disk_ros.units import NS

SHORTEST_NS = 1_000
"""ns: between two knots at least; what is relative to the platform is rounded on its speeds."""
_STATED = ("positions", "velocities", "accelerations")
_UNITS = dict(zip(OFFSET_JOINTS, ("m", "rad"), strict=True))
_LIMITS = ("offset_limit", "offset_speed_limit", "offset_acceleration_limit")
_RATES = ("", "/s", "/s²")
_EQUAL = 1e-12  # a first point at once may be off by this (m, rad and per s) or this part


class TrajectoryRequest(NamedTuple):
    """An offset trajectory as it was asked."""

    names: tuple[str, ...]
    points: tuple[PointRequest, ...]
    stamp_ns: int = 0
    field: str = "platform/joint_trajectory"


class Splice(NamedTuple):
    """An accepted trajectory: where it begins, and the knots of each joint.

    None: the joint is left alone; no knots: what has not begun is cancelled.
    """

    begin_ns: int
    axial: tuple[Knot, ...] | None
    angular: tuple[Knot, ...] | None


def validate_trajectory(request: TrajectoryRequest) -> None:
    """Validate all that does not depend on when it arrives; sizes first."""
    check_names(request.field, request.names, len(request.points), OFFSET_JOINTS)
    for i, point in enumerate(request.points):
        _check_point(request, i, point)


def _check_point(request: TrajectoryRequest, i: int, point: PointRequest) -> None:
    field, count = f"{request.field} points[{i}]", len(request.names)
    if point.has_effort:
        raise InputError(f"{field}.effort", "values", "none", "The platform is moved, not pushed.")
    for name, values in zip(_STATED, point.stated, strict=True):
        if len(values) != count and (values or name == "positions"):
            allowed = f"{count}, one for each joint name"
            raise InputError(f"{field}.{name}", f"{len(values)} values", allowed)
    if point.accelerations and not point.velocities:
        raise InputError(f"{field}.accelerations", "values", "none without velocities")
    first = request.points[0]
    if [bool(values) for values in point.stated] != [bool(values) for values in first.stated]:
        given = ", ".join(n for n, v in zip(_STATED, point.stated, strict=True) if v)
        raise InputError(field, given, "the same kinds of values as points[0]")
    for stated, rate, limit, values in zip(_STATED, _RATES, _LIMITS, point.stated, strict=False):
        for name, value in zip(request.names, values, strict=False):
            most = float(TABLE[limit].default)
            if not abs(value) <= most:  # so is nan
                where = f"{field}.{stated} {name} ({_UNITS[name]}{rate})"
                raise out_of_range(where, value, -most, most)
    _check_time(request, i, point)


def _check_time(request: TrajectoryRequest, i: int, point: PointRequest) -> None:
    field = f"{request.field} points[{i}].time_from_start"
    given = f"{point.after_ns / NS:g} s"
    if i == 0:
        if point.after_ns < 0:
            raise InputError(field, given, ">= 0 s")
        return
    before = request.points[i - 1].after_ns
    if point.after_ns < before + SHORTEST_NS:
        allowed = f">= {(before + SHORTEST_NS) / NS:g} s, strictly increasing"
        raise InputError(field, given, allowed)


def schedule_trajectory(
    request: TrajectoryRequest, instant: Instant, offset: Offset, values: Mapping[str, Value]
) -> Splice:
    """A validated trajectory at the instant of its arrival, on top of the offset accepted so far.

    Points that are past when it begins are left out while later ones remain. `values`: parameters,
    whose limits what results must keep.
    """
    field = request.field
    age = instant.age(instant.effect(request.stamp_ns, 0))
    begin = max(instant.effect(request.stamp_ns, 0), instant.now_ns)
    if not request.points:
        names = request.names or OFFSET_JOINTS
        axial, angular = (() if joint in names else None for joint in OFFSET_JOINTS)
        return Splice(instant.now_ns, axial, angular)
    if begin > FAR_NS:
        raise InputError(f"{field} header.stamp", request.stamp_ns, "at most a century on")
    joints: dict[str, tuple[Knot, ...]] = {}
    for j, name in enumerate(request.names):
        lane: Lane = offset[OFFSET_JOINTS.index(name)]
        knots = _knots(request, j, instant, begin, lane)
        if not knots and request.points[-1].after_ns == 0:
            raise InputError(f"{field} points", "the present state alone", "a later point too")
        if not knots:
            last = instant.effect(request.stamp_ns, request.points[-1].after_ns)
            if last > begin:
                where = f"{field} points[{len(request.points) - 1}].time_from_start"
                given = f"{request.points[-1].after_ns / NS:g} s"
                raise InputError(where, given, f">= {SHORTEST_NS / NS:g} s after the begin")
            raise too_old(field, max(instant.age(last), age), instant)
        joints[name] = knots
    splice = Splice(begin, joints.get(OFFSET_JOINTS[0]), joints.get(OFFSET_JOINTS[1]))
    _check_limits(request, splice, instant, offset, values)
    return splice


def _knots(
    request: TrajectoryRequest, j: int, instant: Instant, begin: int, lane: Lane
) -> tuple[Knot, ...]:
    """The knots of one joint that lie ahead."""
    knots: list[Knot] = []
    for i, point in enumerate(request.points):
        stated = [values[j] for values in point.stated if values]
        at = instant.effect(request.stamp_ns, point.after_ns)
        state = OffsetState(*stated)
        if i == 0 and point.after_ns == 0 and at >= begin:
            _check_start(request, j, state, len(stated), lane.spliced_state(begin))
            continue
        if at <= begin:
            continue
        if at > FAR_NS:
            where = f"{request.field} time_from_start"
            raise InputError(where, f"{point.after_ns / NS:g} s", "at most a century")
        earliest = knots[-1].at_ns if knots else begin
        if at >= earliest + SHORTEST_NS:
            knots.append(Knot(at, state, (LINE, CUBIC, QUINTIC)[len(stated) - 1]))
    return tuple(knots)


def _check_start(
    request: TrajectoryRequest, j: int, given: OffsetState, count: int, wanted: OffsetState
) -> None:
    """A first point at once must be where the offset is."""
    for stated, mine, there in zip(_STATED[:count], given, wanted, strict=False):
        if abs(mine - there) > _EQUAL * max(1.0, abs(there)):
            where = f"{request.field} points[0].{stated} {request.names[j]} at time_from_start 0"
            hint = "The platform cannot jump: leave this point out, or give it time."
            raise InputError(where, mine, f"the offset's own state there, {there!r}", hint)


@cache
def _newest_extremes() -> Callable[[Lane], Extremes]:
    """A compiled function, of which tools that only read trajectories know nothing."""
    from bouncing_disk_ros.core.offset_extremes import newest_extremes

    return newest_extremes


def _check_limits(
    request: TrajectoryRequest,
    splice: Splice,
    instant: Instant,
    offset: Offset,
    values: Mapping[str, Value],
) -> None:
    """InputError where what results would pass a limit."""
    limits = [float(values.get(name, TABLE[name].default)) for name in _LIMITS]
    largest = [float(TABLE[name].default) for name in _LIMITS]
    result = offset.spliced(splice.begin_ns, instant.now_ns, splice.axial, splice.angular)
    ahead = result.trimmed(instant.now_ns).pieces
    if ahead > KNOTS_AHEAD:
        raise InputError(f"{request.field} points", f"{ahead} knots that lie ahead",
                         f"at most {KNOTS_AHEAD}", "Cancel some, or wait.")  # fmt: skip
    for name, lane, knots in zip(OFFSET_JOINTS, result, splice[1:], strict=True):
        if knots is None:
            continue
        found = _newest_extremes()(lane)
        reached: Extremes = found
        for what, rate, most, value in zip(_LIMITS, _RATES, limits, reached[:3], strict=True):
            if not value <= most:
                where = f"{request.field} {name} ({_UNITS[name]}{rate})"
                raise InputError(where, f"up to {value:.6g}", f"at most {most:g} ({what})")
        if limits[2] < largest[2] and reached.jump > 0.0:
            where = f"{request.field} {name}"
            given = f"a jump of the velocity by {reached.jump:.6g} {_UNITS[name]}/s"
            allowed = f"no jump with offset_acceleration_limit {limits[2]:g}"
            hint = "Give velocities, and end at rest."
            raise InputError(where, given, allowed, hint)


def describe_trajectory(splice: Splice) -> str:
    """An accepted trajectory in a few words, for a log."""
    parts = []
    for name, knots in zip(OFFSET_JOINTS, splice[1:], strict=True):
        if knots:
            end = knots[-1]
            way = (
                f"{len(knots)} knot(s) from {splice.begin_ns / NS:.9f} s to {end.at_ns / NS:.9f} s"
            )
            parts.append(f"{name}: {way}, ends at {end.state.position:g} {_UNITS[name]}")
        elif knots is not None:
            parts.append(f"{name}: what has not begun is cancelled")
    return "; ".join(parts)


def splice_of(begin_ns: int, joints: Mapping[str, object]) -> Splice:
    """An accepted trajectory from its record (see `as_record`)."""
    lanes: list[tuple[Knot, ...] | None] = []
    for name in OFFSET_JOINTS:
        rows = joints.get(name)
        if rows is None:
            lanes.append(None)
            continue
        assert isinstance(rows, (list, tuple))
        knots = (Knot(int(at), OffsetState(*state), int(degree)) for at, degree, *state in rows)
        lanes.append(tuple(knots))
    return Splice(begin_ns, lanes[0], lanes[1])


def as_record(splice: Splice) -> dict[str, list[list[float | int]]]:
    """Rows [instant in ns, degree, position, velocity, acceleration] for each joint given."""
    return {
        name: [[knot.at_ns, knot.degree, *knot.state] for knot in knots]
        for name, knots in zip(OFFSET_JOINTS, splice[1:], strict=True)
        if knots is not None
    }


# ------------------------------------------------------------------------------------------------
# Offset trajectories as Python and YAML give them: rows of a time and values by joint.


_MOST = 3  # position, velocity, acceleration


def trajectory_of(rows: Sequence[tuple[Any, Mapping[str, Any]]]) -> TrajectoryRequest:
    """The request that (time in s, {joint: values}) stand for; not validated yet.

    Values are a position, or a list of position, velocity and acceleration as far as given. The
    first row's joints are those of all.
    """
    for i, row in enumerate(rows):
        fits = isinstance(row, (list, tuple)) and len(row) == 2 and isinstance(row[1], Mapping)
        if not fits:
            raise InputError(f"trajectory[{i}]", row, "(time in s, {joint: values})")
    names = tuple(rows[0][1]) if rows else ()
    points = []
    for i, (time, values) in enumerate(rows):
        where = f"trajectory[{i}]"
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
        after = instant(f"{where} time", time)
        points.append(PointRequest(positions, after, velocities, accelerations))
    return TrajectoryRequest(names, tuple(points), field="trajectory")


def _numbers(field: str, given: Any) -> list[float]:
    value = plain(given)
    values = list(value) if isinstance(value, (list, tuple)) else [value]
    numbers = [plain(one) for one in values]
    if not 1 <= len(numbers) <= _MOST or not all(type(one) in (int, float) for one in numbers):
        raise InputError(field, given, "a position, or position, velocity and acceleration")
    return [float(one) for one in numbers]  # type: ignore[arg-type]


def instant(field: str, given: object) -> int:
    """Seconds of simulated time, a number of Python or NumPy, as whole nanoseconds."""
    try:
        return nanoseconds(number(field, plain(given), 0.0, FAR_NS / NS))
    except InputError:
        raise InputError(field, given, "a finite number of seconds >= 0") from None

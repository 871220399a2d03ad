"""Validation of commands: a request becomes an accepted input or an InputError.

Pure functions: nothing changes here. Times are whole nanoseconds; a stamp of 0 means now.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple, Protocol

from bouncing_disk_ros.core.model import Motion
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.field_checks import too_many
from bouncing_disk_ros.limits import COMMAND_NAMES, COMMAND_POINTS
from bouncing_disk_ros.parameters import TABLE
from bouncing_disk_ros.run.time_map import FAR_NS, TimeMap, scaled
from bouncing_disk_ros.topics import MOTION_NAMES, MOTION_UNITS
from bouncing_disk_ros.units import NS

MAX_IMPULSE = 1e12
"""Largest impulse accepted, N·s or N·m·s: beyond it the numbers mean nothing."""


class PointRequest(NamedTuple):
    """One point as it was asked: values for each name, in their order; () where not given."""

    positions: tuple[float, ...]
    after_ns: int = 0  # since the stamp
    velocities: tuple[float, ...] = ()
    accelerations: tuple[float, ...] = ()
    has_effort: bool = False

    @property
    def stated(self) -> tuple[tuple[float, ...], ...]:
        """Positions, velocities and accelerations."""
        return self.positions, self.velocities, self.accelerations


class ProgrammeRequest(NamedTuple):
    """A programme of platform motions as it was asked."""

    names: tuple[str, ...]
    points: tuple[PointRequest, ...]
    stamp_ns: int = 0
    field: str = "platform/command"
    is_value: bool = False  # one value of a topic of its own, not a point of a programme


class ImpulseRequest(NamedTuple):
    """A requested impulse: forces and torques about x, y, z hold impulses."""

    force: tuple[float, float, float]
    torque: tuple[float, float, float]
    stamp_ns: int = 0
    field: str = "disk/impulse"


class Instant(NamedTuple):
    """When a command arrives: the instant at which it can act, and how stamps map."""

    now_ns: int
    times: TimeMap
    tolerance_ns: int  # of ROS time

    def effect(self, stamp_ns: int, after_ns: int) -> int:
        """Simulated instant of stamp + after; may lie in the past."""
        if stamp_ns == 0:
            return self.now_ns + scaled(after_ns, self.times.slope)
        return self.times.to_simulated(stamp_ns + after_ns)

    def age(self, effect_ns: int) -> int:
        """How late an effect would be, ns of ROS time; not positive when it lies ahead."""
        return scaled(self.now_ns - effect_ns, 1.0 / self.times.slope)


DAY_NS = 86_400 * NS


class Stamped(Protocol):
    """A request with a stamp."""

    @property
    def stamp_ns(self) -> int:
        """ROS time, ns; 0: now."""


def far_ahead(request: Stamped, instant: Instant) -> str:
    """A remark on a stamp that lies more than a day ahead; empty for any other."""
    if request.stamp_ns == 0:
        return ""
    ahead_ns = -instant.age(instant.effect(request.stamp_ns, 0))
    if ahead_ns <= DAY_NS:
        return ""
    return f"its stamp lies {ahead_ns / DAY_NS:.3g} days ahead: check the sender's clock"


_ROWS = {name: TABLE[name] for name in MOTION_NAMES}
_BOUNDS = {name: row.bounds for name, row in _ROWS.items()}
_ALLOWED = {name: row.allowed for name, row in _ROWS.items()}
_UNSUPPORTED = ("velocities", "accelerations", "effort")
Changes = tuple[Mapping[str, float], ...]
"""What each point of a programme changes: values of the motion by name."""


def accept_programme(
    request: ProgrammeRequest, instant: Instant, latest: Motion
) -> tuple[tuple[int, Motion], ...]:
    """The points of an accepted programme, (instant, full target) in strictly increasing time.

    Names left out inherit `latest`, the newest accepted target. Points older than the tolerance are
    left out while later ones remain; an empty result cancels what is pending.
    """
    return schedule_programme(request, validate_programme(request), instant, latest)


def validate_programme(request: ProgrammeRequest) -> Changes:
    """Validate all of a programme that does not depend on when it arrives; sizes first."""
    check_names(request.field, request.names, len(request.points), MOTION_NAMES)
    changes = _changes(request)
    _check_increasing(request)
    return changes


def schedule_programme(
    request: ProgrammeRequest, changes: Changes, instant: Instant, latest: Motion
) -> tuple[tuple[int, Motion], ...]:
    """The points of a validated programme at the instant of its arrival, as `accept_programme`."""
    if not changes:
        _check_age(request.field, request.stamp_ns, instant)
        return ()
    accepted: list[tuple[int, Motion]] = []
    earliest, age = instant.now_ns, 0
    for point, values in zip(request.points, changes, strict=True):
        effect = instant.effect(request.stamp_ns, point.after_ns)
        age = instant.age(effect)
        if age > instant.tolerance_ns:
            continue
        effect = max(effect, earliest)
        if effect > FAR_NS:
            raise InputError(
                f"{request.field} time_from_start",
                f"{point.after_ns / NS:g} s",
                "at most a century",
            )
        accepted.append((effect, latest._replace(**values)))
        earliest = effect + 1
    if not accepted:
        raise too_old(request.field, age, instant)
    return tuple(accepted)


def validate_impulse(request: ImpulseRequest) -> None:
    """Validate all of an impulse that does not depend on when it arrives."""
    for kind, vector in (("force", request.force), ("torque", request.torque)):
        for axis, value in zip("xyz", vector, strict=True):
            if not math.isfinite(value) or abs(value) > MAX_IMPULSE:
                allowed = f"a finite impulse up to {MAX_IMPULSE:g}"
                raise InputError(f"{request.field} wrench.{kind}.{axis}", value, allowed)
            if axis != "z" and value != 0.0:
                raise InputError(f"{request.field} wrench.{kind}.{axis}", value, "0",
                                 "The disk moves along and about z only.")  # fmt: skip


def schedule_impulse(request: ImpulseRequest, instant: Instant) -> tuple[int, float, float]:
    """A validated impulse: its instant, axial impulse (N·s), angular impulse (N·m·s)."""
    effect = instant.effect(request.stamp_ns, 0)
    _check_age(request.field, request.stamp_ns, instant)
    if effect > FAR_NS:
        raise InputError(f"{request.field} header.stamp", request.stamp_ns, "at most a century on")
    return max(effect, instant.now_ns), request.force[2], request.torque[2]


def check_names(field: str, names: Sequence[str], points: int, known: Sequence[str]) -> None:
    """Validate the number of points, and names of joints, of which these are `known`."""
    if len(names) > COMMAND_NAMES:
        raise too_many(f"{field} joint_names", len(names), COMMAND_NAMES)
    if points > COMMAND_POINTS:
        raise too_many(f"{field} points", points, COMMAND_POINTS)
    field = f"{field} joint_names"
    for name in names:
        if name not in known:
            hint = partial(closest, name, known)
            raise InputError(field, name, "any of " + ", ".join(known), hint)
    if len(set(names)) < len(names):
        raise InputError(field, ", ".join(names), "each name once")
    if points and not names:
        raise InputError(field, "no names", "at least one of " + ", ".join(known))


def _changes(request: ProgrammeRequest) -> Changes:
    """What each point changes, every value checked."""
    names = request.names
    bounds = [_BOUNDS[name] for name in names]
    changes = []
    for i, point in enumerate(request.points):
        if len(point.positions) != len(names) or any(point[2:]):
            raise _wrong_shape(request, i)
        values = {}
        for name, value, (low, high) in zip(names, point.positions, bounds, strict=True):
            if type(value) is not float or not low <= value <= high:
                value = _checked_value(request, i, name, value)
            values[name] = math.remainder(value, math.tau) if name == "phase_lag" else value
        changes.append(values)
    return tuple(changes)


def _wrong_shape(request: ProgrammeRequest, i: int) -> InputError:
    point, field = request.points[i], f"{request.field} points[{i}]"
    for name, given in zip(_UNSUPPORTED, point[2:], strict=True):
        if given:
            return InputError(f"{field}.{name}", "values", "none",
                              "A cross-fade needs positions and time_from_start only.")  # fmt: skip
    count, wanted = f"{len(point.positions)} values", len(request.names)
    return InputError(f"{field}.positions", count, f"{wanted}, one for each joint name")


def _checked_value(request: ProgrammeRequest, i: int, name: str, given: object) -> float:
    """What is no double, cast where that is possible; InputError for the rest."""
    if type(given) is not float:
        with contextlib.suppress(InputError):
            return float(TABLE[name].checked(given))
    where = request.field if request.is_value else f"{request.field} points[{i}] {name}"
    hint = "To stop the platform, set the amplitudes to 0." if name == "frequency" else ""
    raise InputError(f"{where} ({MOTION_UNITS[name]})", given, _ALLOWED[name], hint)


def _check_increasing(request: ProgrammeRequest) -> None:
    before = -1
    for i, point in enumerate(request.points):
        if point.after_ns <= before:
            allowed = ">= 0 s" if i == 0 else f"> {before / NS:g} s, strictly increasing"
            raise InputError(f"{request.field} points[{i}].time_from_start",
                             f"{point.after_ns / NS:g} s", allowed)  # fmt: skip
        before = point.after_ns


def _check_age(field: str, stamp_ns: int, instant: Instant) -> None:
    age = instant.age(instant.effect(stamp_ns, 0))
    if age > instant.tolerance_ns:
        raise too_old(field, age, instant)


def too_old(field: str, age: int, instant: Instant) -> InputError:
    """The error of a command whose stamp is too old."""
    allowed = f"0 (now) or at most {instant.tolerance_ns / NS:g} s old (command_tolerance)"
    return InputError(f"{field} header.stamp", f"{age / NS:.6g} s old", allowed,
                      "Stamps are ROS time since 1970: count from those of the messages "
                      "heard, or use a synchronised clock.")  # fmt: skip


def describe(points: Sequence[tuple[int, Motion]]) -> str:
    """An accepted programme in a few words, for a log."""
    if not points:
        return "pending motions are cancelled"
    last = points[-1][1]
    values = ", ".join(f"{name} {value:g}" for name, value in zip(MOTION_NAMES, last, strict=True))
    return f"{len(points)} point(s) from {points[0][0] / NS:.9f} s on, ends with {values}"

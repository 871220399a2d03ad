"""Rulings on commands: what was asked, at which clock, becomes an accepted input or an InputError.

Pure functions: nothing changes here. Times are whole nanoseconds; a stamp of 0 means now.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bouncing_disk_ros.core.model import Motion
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.parameters import TABLE
from bouncing_disk_ros.run.clock import FAR_NS, NS, TimeMap, scaled
from bouncing_disk_ros.topics import MOTION_NAMES, MOTION_UNITS

MAX_IMPULSE = 1e12
"""Largest impulse accepted, N·s or N·m·s: beyond it the numbers mean nothing."""


@dataclass(frozen=True)
class PointRequest:
    """One point as it was asked; `extras` are fields that were given and are not supported."""

    positions: tuple[float, ...]
    after_ns: int  # since the stamp
    extras: tuple[str, ...] = ()


@dataclass(frozen=True)
class ProgrammeRequest:
    """A programme of platform motions as it was asked."""

    names: tuple[str, ...]
    points: tuple[PointRequest, ...]
    stamp_ns: int = 0
    field: str = "platform/command"
    is_value: bool = False  # one value of a topic of its own, not a point of a programme


@dataclass(frozen=True)
class KickRequest:
    """A kick as it was asked: forces and torques about x, y, z hold impulses."""

    force: tuple[float, float, float]
    torque: tuple[float, float, float]
    stamp_ns: int = 0
    field: str = "disk/impulse"


@dataclass(frozen=True)
class Instant:
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


def rule_programme(
    request: ProgrammeRequest, instant: Instant, latest: Motion
) -> tuple[tuple[int, Motion], ...]:
    """The points of an accepted programme, (instant, full target) in strictly increasing time.

    Names left out inherit `latest`, the newest accepted target. Points older than the tolerance are
    left out while later ones remain; an empty result cancels what is pending.
    """
    _check_names(request)
    targets = [_target(request, i, latest) for i in range(len(request.points))]
    _check_increasing(request)
    if not targets:
        _check_age(request.field, request.stamp_ns, 0, instant)
        return ()
    accepted: list[tuple[int, Motion]] = []
    earliest = instant.now_ns
    for point, target in zip(request.points, targets, strict=True):
        effect = instant.effect(request.stamp_ns, point.after_ns)
        if instant.age(effect) > instant.tolerance_ns:
            continue
        effect = max(effect, earliest)
        if effect > FAR_NS:
            raise InputError(
                f"{request.field} time_from_start",
                f"{point.after_ns / NS:g} s",
                "at most a century",
            )
        accepted.append((effect, target))
        earliest = effect + 1
    if not accepted:
        _check_age(request.field, request.stamp_ns, request.points[-1].after_ns, instant)
    return tuple(accepted)


def rule_kick(request: KickRequest, instant: Instant) -> tuple[int, float, float]:
    """An accepted kick: instant, axial impulse (N·s), angular impulse (N·m·s)."""
    for kind, vector in (("force", request.force), ("torque", request.torque)):
        for axis, value in zip("xyz", vector, strict=True):
            field = f"{request.field} wrench.{kind}.{axis}"
            if not math.isfinite(value) or abs(value) > MAX_IMPULSE:
                raise InputError(field, value, f"a finite impulse up to {MAX_IMPULSE:g}")
            if axis != "z" and value != 0.0:
                raise InputError(field, value, "0", "The disk moves along and about z only.")
    effect = instant.effect(request.stamp_ns, 0)
    _check_age(request.field, request.stamp_ns, 0, instant)
    if effect > FAR_NS:
        raise InputError(f"{request.field} header.stamp", request.stamp_ns, "at most a century on")
    return max(effect, instant.now_ns), request.force[2], request.torque[2]


def _check_names(request: ProgrammeRequest) -> None:
    field = f"{request.field} joint_names"
    seen: set[str] = set()
    for name in request.names:
        if name not in MOTION_NAMES:
            raise InputError(field, name, "any of " + ", ".join(MOTION_NAMES),
                             closest(name, MOTION_NAMES))  # fmt: skip
        if name in seen:
            raise InputError(field, ", ".join(request.names), "each name once")
        seen.add(name)
    if request.points and not request.names:
        raise InputError(field, "no names", "at least one of " + ", ".join(MOTION_NAMES))


def _target(request: ProgrammeRequest, i: int, latest: Motion) -> Motion:
    """The full target of one point, every value checked."""
    point, names = request.points[i], request.names
    field = f"{request.field} points[{i}]"
    if point.extras:
        raise InputError(f"{field}.{point.extras[0]}", "values", "none",
                         "A cross-fade needs positions and time_from_start only.")  # fmt: skip
    if len(point.positions) != len(names):
        given = f"{len(point.positions)} values"
        raise InputError(f"{field}.positions", given, f"{len(names)}, one for each joint name")
    values: dict[str, float] = {}
    for name, position in zip(names, point.positions, strict=True):
        where = request.field if request.is_value else f"{field} {name}"
        values[name] = _checked_value(where, name, position)
    return latest._replace(**values)


def _checked_value(field: str, name: str, given: float) -> float:
    try:
        value = float(TABLE[name].checked(given))
    except InputError as error:
        hint = "To stop the platform, set the amplitudes to 0." if name == "frequency" else ""
        raise InputError(f"{field} ({MOTION_UNITS[name]})", given, error.allowed, hint) from None
    return math.remainder(value, math.tau) if name == "phase_lag" else value


def _check_increasing(request: ProgrammeRequest) -> None:
    before = -1
    for i, point in enumerate(request.points):
        if point.after_ns <= before:
            allowed = ">= 0 s" if i == 0 else f"> {before / NS:g} s, strictly increasing"
            raise InputError(f"{request.field} points[{i}].time_from_start",
                             f"{point.after_ns / NS:g} s", allowed)  # fmt: skip
        before = point.after_ns


def _check_age(field: str, stamp_ns: int, after_ns: int, instant: Instant) -> None:
    age = instant.age(instant.effect(stamp_ns, after_ns))
    if age > instant.tolerance_ns:
        allowed = f"0 (now) or at most {instant.tolerance_ns / NS:g} s old (command_tolerance)"
        raise InputError(f"{field} header.stamp", f"{age / NS:.6g} s old", allowed,
                         "Is the sender's clock the simulator's?")  # fmt: skip


def describe(points: Sequence[tuple[int, Motion]]) -> str:
    """An accepted programme in a few words, for a log."""
    if not points:
        return "what was pending is cancelled"
    last = points[-1][1]
    values = ", ".join(f"{name} {value:g}" for name, value in zip(MOTION_NAMES, last, strict=True))
    return f"{len(points)} point(s), ends with {values}"

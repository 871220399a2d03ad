"""Checkpoints of a run: records as plain numbers and back, to the bit, with every value checked.

Floats go through Python's shortest round-trip form, so JSON keeps them exactly. A checkpoint may
come from a damaged or foreign file: a type, shape, size or range that does not fit raises
InputError, before any kernel sees the number. Three keys keep old names: `kicks` are impulses,
`held` in a simulation are unreported rows, `books` is the energy ledger. The offset trajectories
come last.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.layout import FADE, FLIGHT, HELD, NEVER, SLIDING, STEADY, STICKING
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.offset import (
    CONSTANT,
    CUBIC,
    LINE,
    QUINTIC,
    Knot,
    Lane,
    Offset,
    OffsetState,
    Plan,
    Segment,
    hold,
)
from bouncing_disk_ros.core.schedule import Fade, Impulse
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import items, number, only_names, row, whole
from bouncing_disk_ros.field_checks import plain as plain_number

FORMAT = 1
"""Version of the checkpoint's layout; another one is refused."""
MOST_INPUTS = 100_000
"""Most cross-fades, impulses or unreported rows that a checkpoint may hold."""

_LATEST = int(NEVER) // 2  # ns, of an instant
_Item = TypeVar("_Item")
Range = tuple[float, float]

# Ranges far beyond those of the parameters: within them no kernel overflows or runs for ever.
_LARGEST = 1e100
_ANY: Range = (-_LARGEST, _LARGEST)
POSITIVE: Range = (0.0, _LARGEST)
_TURN: Range = (0.0, math.tau)
_FREE: Mapping[str, Range] = {}
_MOTION: Mapping[str, Range] = {
    "frequency": (1e-9, 1e9), "axial_amplitude": POSITIVE, "angular_amplitude": POSITIVE,
}  # fmt: skip
_DISK: Mapping[str, Range] = {
    **dict.fromkeys(("brake_torque", "load_inertia", "friction", "friction_radius"), POSITIVE),
    **dict.fromkeys(("mass", "gyration_radius"), (1e-100, _LARGEST)),
    "restitution": (0.0, 1.0),
}
_PUSHES = ("axial impulse", "angular impulse")
_STATE_WHOLES = {
    "ns": (0, _LATEST), "phase": (FLIGHT, HELD), "rows": (0, 2**53), "cycles": (-(2**53), 2**53),
    "turns": (-(2**62), 2**62), "slip_sign": (-1, 1), "spin_sign": (-1, 1),
    "rows_entered": (0, 2**9 - 1),
}  # fmt: skip
_STATE_NUMBERS: Mapping[str, Range] = {"sub": (0.0, 1.0), "tau": _TURN, "gap": POSITIVE}


def instant(name: str, value: object) -> int:
    """An instant of simulated time, ns."""
    return whole(name, value, 0, _LATEST)


def made(
    name: str, values: object, make: Callable[[str, Any], _Item], most: int = MOST_INPUTS
) -> list[_Item]:
    """A list of at most `most` items, each made by make(name, item)."""
    return [make(f"{name}[{i}]", value) for i, value in enumerate(items(name, values, most))]


def _numbers(
    name: str,
    values: object,
    names: Sequence[str],
    ranges: Mapping[str, Range] = _FREE,
) -> list[float]:
    """A number for each name, within its range where it has one."""
    return [
        number(f"{name} {field}", plain_number(value), *ranges.get(field, _ANY))
        for field, value in zip(names, row(name, values, names), strict=True)
    ]


def motion(name: str, values: object) -> Motion:
    """A platform motion from its four numbers."""
    return Motion(*_numbers(name, values, Motion._fields, _MOTION))


def point(name: str, values: object) -> tuple[int, Motion]:
    """A point of a programme, from [ns, motion]."""
    at, target = row(name, values, ("instant", "motion"))
    return whole(f"{name} instant", plain_number(at)), motion(f"{name} motion", target)


def disk(name: str, values: object) -> Disk:
    """Disk, contact and loads from their numbers."""
    found = Disk(*_numbers(name, values, Disk._fields, _DISK))
    load = found.gravity + found.preload / found.mass
    if not 0.0 < load < _LARGEST:
        raise InputError(f"{name} gravity + preload/mass", load, "more than 0")
    return found


def initial(name: str, values: object) -> InitialState:
    """An initial state from its numbers; the axial velocity may be None."""
    given: list[Any] = [plain_number(one) for one in row(name, values, InitialState._fields)]
    found = InitialState(*given)
    for field, value in found._asdict().items():
        if value is not None or field != "axial_velocity":
            number(f"{name} {field}", value, *(POSITIVE if field == "height" else _ANY))
    return found


def pending_fade(name: str, values: object) -> Fade:
    """A cross-fade that has not begun, from [begin ns, end ns, motion]."""
    begin, end, target = row(name, values, ("begin", "end", "motion"))
    instant(f"{name} begin", begin)
    whole(f"{name} end", end, begin + 1, _LATEST)
    return Fade(begin, end, motion(f"{name} motion", target))


def queued_impulse(name: str, values: object) -> Impulse:
    """An impulse that has not acted, from [ns, N·s, N·m·s]."""
    at, *pushes = row(name, values, ("instant", *_PUSHES))
    return Impulse(instant(name, at), *_numbers(name, pushes, _PUSHES))


def in_order(name: str, instants: Sequence[int]) -> None:
    """Raise InputError for instants that fall."""
    if any(later < earlier for earlier, later in itertools.pairwise(instants)):
        raise InputError(name, list(instants[:4]), "rising instants")


def plain(record: NDArray[np.void]) -> dict[str, Any]:
    """The one element of a structured array as {field: number}."""
    return {name: record[name][0].item() for name in record.dtype.names or ()}


def record(name: str, values: object, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Inverse of `plain`; a missing or an unknown field, or no plain number, raises InputError."""
    r = np.zeros(1, dtype)
    for field, value in only_names(name, values, dtype.names or ()).items():
        kind = dtype[field]
        if kind.kind in "iu":
            bits = 8 * kind.itemsize
            low = -(2 ** (bits - 1)) if kind.kind == "i" else 0
            r[field] = whole(f"{name} {field}", value, low, low + 2**bits - 1)
        else:
            r[field] = number(f"{name} {field}", value, *_ANY)
    return r


def table(
    name: str, values: object, rows: Sequence[str], columns: Sequence[str]
) -> NDArray[np.float64]:
    """A table of finite numbers with these rows and columns."""
    lists = zip(rows, row(name, values, rows), strict=True)
    return np.array([_numbers(f"{name} {part}", one, columns) for part, one in lists])


def check_state(r: np.void) -> None:
    """Raise InputError for a state record with a value out of its range."""
    for name, (least, most) in _STATE_WHOLES.items():
        whole(f"state {name}", int(r[name]), least, most)
    for name, (low, high) in _STATE_NUMBERS.items():
        number(f"state {name}", float(r[name]), low, high)
    slip, spin = int(r["slip_sign"]), int(r["spin_sign"])
    if r["phase"] in (SLIDING, HELD) and slip == 0:
        raise InputError("state slip_sign", slip, "-1 or 1 while sliding or held")
    if r["phase"] == STICKING and slip != 0:
        raise InputError("state slip_sign", slip, "0 while sticking")
    if r["phase"] == HELD and spin != 0:
        raise InputError("state spin_sign", spin, "0 while held")


def check_motion(r: np.void) -> None:
    """Raise InputError for a record of a motion with a value out of its range."""
    whole("motion kind", int(r["kind"]), STEADY, FADE)
    instant("motion begin_ns", int(r["begin_ns"]))
    whole("motion cycles", int(r["cycles"]), -(2**53), 2**53)
    number("motion tau", float(r["tau"]), *_TURN)
    start = [float(r[name]) for name in ("a", "p", "f", "lag")]
    motion("motion", start)
    changes = [float(r[name]) for name in ("da", "dp", "df", "dlag")]
    if r["kind"] == STEADY:
        if any(changes):
            raise InputError("motion changes", changes, "0 in a steady motion")
        return
    end = [a + b for a, b in zip(start, changes, strict=True)]
    motion("motion end", [max(end[0], 0.0), max(end[1], 0.0), *end[2:]])
    duration = (instant("motion end_ns", int(r["end_ns"])) - int(r["begin_ns"])) * 1e-9
    if not 0.0 < duration == r["duration"]:
        raise InputError("motion duration", float(r["duration"]), f"{duration!r} s, more than 0")


# ------------------------------------------------------------------------------------------------
# Offset trajectories.


_JOINTS = ("axial", "angular")
_STATE = OffsetState._fields
# Largest position (m or rad), velocity and acceleration of a knot.
_OFFSET = {name: (-most, most) for name, most in zip(_STATE, (1e6, 1e9, 1e12), strict=True)}


def plain_offset(offset: Offset, in_force: tuple[Segment, Segment], index: int) -> dict[str, Any]:
    """Both lanes, the segments in force and the index as JSON-able numbers."""
    lanes = {
        joint: [[_row(segment) for segment in plan.segments] for plan in lane.plans]
        for joint, lane in zip(_JOINTS, offset, strict=True)
    }
    return {"index": index, "in_force": [_row(segment) for segment in in_force], **lanes}


def _row(segment: Segment) -> list[Any]:
    begin, end, start, finish, degree = segment
    return [begin, end, *start, *finish, degree]


def offset(values: object) -> tuple[Offset, tuple[Segment, Segment], int]:
    """Inverse of `plain_offset`; for None no offset. Raises InputError, one line."""
    if values is None:
        return Offset(), (hold(0, 0.0), hold(0, 0.0)), 0
    found = only_names("offset", values, ("index", "in_force", *_JOINTS))
    in_force = row("offset in_force", found["in_force"], _JOINTS)
    axial, angular = (_segment("offset in_force", segment) for segment in in_force)
    lanes = Offset(
        *(Lane(tuple(made(f"offset {joint}", found[joint], _plan))) for joint in _JOINTS)
    )
    for lane in lanes:
        if not lane.plans:
            raise InputError("offset", values, "trajectories")
        in_order("offset", [plan.begin_ns for plan in lane.plans])
    return lanes, (axial, angular), whole("offset index", found["index"], 0)


def knots(name: str, values: object) -> list[Knot] | None:
    """Knots of a trajectory, or None."""
    return None if values is None else made(name, values, _knot)


def _knot(name: str, values: object) -> Knot:
    given, state, degree = row(name, values, Knot._fields)
    at = whole(f"{name} instant", plain_number(given))
    if whole(f"{name} degree", degree) not in (LINE, CUBIC, QUINTIC):
        raise InputError(f"{name} degree", degree, "1, 3 or 5")
    return Knot(at, OffsetState(*_numbers(name, state, _STATE, _OFFSET)), degree)


def _plan(name: str, values: object) -> Plan:
    segments = tuple(made(name, values, _segment))
    if not segments or segments[-1].degree != CONSTANT:
        raise InputError(name, values, "segments, the last of them a hold")
    for before, after in itertools.pairwise(segments):
        if before.degree == CONSTANT or before.end_ns != after.begin_ns:
            raise InputError(name, list(after[:2]), "segments without a break")
    return Plan(segments)


def _segment(name: str, values: object) -> Segment:
    begin, end, *states, degree = row(name, values, ("begin", "end", *_STATE, *_STATE, "degree"))
    instant(f"{name} begin", begin)
    if whole(f"{name} degree", degree) not in (CONSTANT, LINE, CUBIC, QUINTIC):
        raise InputError(f"{name} degree", degree, "0, 1, 3 or 5")
    start, finish = (
        OffsetState(*_numbers(name, part, _STATE, _OFFSET)) for part in (states[:3], states[3:])
    )
    if degree == CONSTANT:
        if end != int(NEVER) or start != OffsetState(start.position) or finish != start:
            raise InputError(name, values, "a hold without end and motion")
        return hold(begin, start.position)
    whole(f"{name} end", end, begin + 1, _LATEST)
    return Segment(begin, end, start, finish, degree)

"""Checkpoints of a run: records as plain numbers and back, to the bit, with every value checked.

Floats go through Python's shortest round-trip form, so JSON keeps them exactly. A checkpoint may
come from a damaged or foreign file: a type, shape, size or range that does not fit raises
ValueError with one line, before any kernel sees the number. Three keys keep old names: `kicks` are
impulses, `held` in a simulation are unreported rows, `books` is the energy ledger. The offset
trajectories come last.
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
    Lane,
    Offset,
    OffsetState,
    Plan,
    Segment,
    hold,
)
from bouncing_disk_ros.core.schedule import Fade, Impulse

FORMAT = 1
"""Version of the checkpoint's layout; another one is refused."""
MOST_INPUTS = 100_000
"""Most cross-fades, impulses or unreported rows that a checkpoint may hold."""

# Ranges far beyond those of the parameters: within them no kernel overflows or runs for ever.
FREQUENCIES = (1e-9, 1e9)  # Hz
_LARGEST = 1e100  # of any other number
_INT64 = (-(2**63), 2**63 - 1)
_LATEST = int(NEVER) // 2  # ns, of an instant
_Item = TypeVar("_Item")


def refusal(name: str, given: object, allowed: str) -> ValueError:
    """The error that says what a checkpoint held, and what it may hold."""
    text = repr(given)
    return ValueError(f"checkpoint {name}: {text[:80]}, allowed {allowed}")


def check_format(snapshot: Mapping[str, Any]) -> None:
    """Raise ValueError for a checkpoint of another format."""
    if not isinstance(snapshot, Mapping):
        raise refusal("content", snapshot, "a mapping")
    if snapshot.get("format") != FORMAT:
        raise ValueError(f"checkpoint format {snapshot.get('format')!r}: allowed {FORMAT}")


def whole(name: str, value: Any, low: int = _INT64[0], high: int = _INT64[1]) -> int:
    """An integer within bounds, which are those of int64 at most."""
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise refusal(name, value, f"an integer in [{low}, {high}]")
    return value


def instant(name: str, value: Any) -> int:
    """An instant of simulated time, ns."""
    return whole(name, value, 0, _LATEST)


def number(name: str, value: Any, low: float = -_LARGEST, high: float = _LARGEST) -> float:
    """A finite float within bounds."""
    good = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not good or not low <= value <= high:
        raise refusal(name, value, f"a number in [{low:g}, {high:g}]")
    return float(value)


def items(
    name: str, values: Any, make: Callable[[str, Any], _Item], most: int = MOST_INPUTS
) -> list[_Item]:
    """A list of at most `most` items, each made by make(name, item)."""
    if not isinstance(values, (list, tuple)) or len(values) > most:
        raise refusal(name, values, f"a list of at most {most} items")
    return [make(f"{name}[{i}]", value) for i, value in enumerate(values)]


def _numbers(name: str, values: Any, count: int) -> list[float]:
    if not isinstance(values, (list, tuple)) or len(values) != count:
        raise refusal(name, values, f"{count} numbers")
    return [number(name, value) for value in values]


def motion(name: str, values: Any) -> Motion:
    """A platform motion from its four numbers."""
    made = Motion(*_numbers(name, values, len(Motion._fields)))
    number(f"{name} frequency", made.frequency, *FREQUENCIES)
    number(f"{name} axial_amplitude", made.axial_amplitude, low=0.0)
    number(f"{name} angular_amplitude", made.angular_amplitude, low=0.0)
    return made


def disk(name: str, values: Any) -> Disk:
    """Disk, contact and loads from their numbers."""
    count = len(Disk._fields)
    made = Disk(*_numbers(name, values, count))
    for field in ("brake_torque", "load_inertia"):
        number(f"{name} {field}", getattr(made, field), low=0.0)
    for field in ("mass", "gyration_radius"):
        number(f"{name} {field}", getattr(made, field), low=1e-100)
    for field in ("friction", "friction_radius"):
        number(f"{name} {field}", getattr(made, field), low=0.0)
    number(f"{name} restitution", made.restitution, 0.0, 1.0)
    load = made.gravity + made.preload / made.mass
    if not 0.0 < load < _LARGEST:
        raise refusal(f"{name} gravity + preload/mass", load, "more than 0")
    return made


def initial(name: str, values: Any) -> InitialState:
    """An initial state from its numbers; the axial velocity may be None."""
    count = len(InitialState._fields)
    if not isinstance(values, (list, tuple)) or len(values) != count:
        raise refusal(name, values, f"{count} numbers")
    made = InitialState(*values)
    for field, value in made._asdict().items():
        if value is not None or field != "axial_velocity":
            number(f"{name} {field}", value)
    number(f"{name} height", made.height, low=0.0)
    return made


def pending_fade(name: str, values: Any) -> Fade:
    """A cross-fade that has not begun, from [begin ns, end ns, motion]."""
    if not isinstance(values, (list, tuple)) or len(values) != 3:
        raise refusal(name, values, "[begin, end, motion]")
    begin, end = instant(f"{name} begin", values[0]), instant(f"{name} end", values[1])
    if end <= begin:
        raise refusal(f"{name} end", end, f"more than {begin}")
    return Fade(begin, end, motion(f"{name} motion", values[2]))


def queued_impulse(name: str, values: Any) -> Impulse:
    """An impulse that has not acted, from [ns, N·s, N·m·s]."""
    if not isinstance(values, (list, tuple)) or len(values) != 3:
        raise refusal(name, values, "[instant, axial impulse, angular impulse]")
    return Impulse(instant(name, values[0]), *_numbers(name, values[1:], 2))


def in_order(name: str, instants: Sequence[int]) -> None:
    """Raise ValueError for instants that fall."""
    if any(later < earlier for earlier, later in itertools.pairwise(instants)):
        raise refusal(name, list(instants[:4]), "rising instants")


def plain(record: NDArray[np.void]) -> dict[str, Any]:
    """The one element of a structured array as {field: number}."""
    return {name: record[name][0].item() for name in record.dtype.names or ()}


def record(values: Any, dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Inverse of `plain`; a missing or an unknown field, or no plain number, raises ValueError."""
    names = set(dtype.names or ())
    if not isinstance(values, Mapping):
        raise refusal("record", values, "a mapping")
    if set(values) != names:
        fields = sorted(str(name) for name in set(values) ^ names)
        raise ValueError(f"checkpoint fields {fields} do not fit this version")
    r = np.zeros(1, dtype)
    for name, value in values.items():
        kind = dtype[name]
        if kind.kind in "iu":
            bits = 8 * kind.itemsize
            low = -(2 ** (bits - 1)) if kind.kind == "i" else 0
            r[name] = whole(name, value, low, low + 2**bits - 1)
        else:
            r[name] = number(name, value)
    return r


def table(name: str, values: Any, rows: int, columns: int) -> NDArray[np.float64]:
    """A table of finite numbers of a known shape."""
    lists = items(name, values, lambda part, row: _numbers(part, row, columns), rows)
    if len(lists) != rows:
        raise refusal(name, values, f"{rows} rows of {columns} numbers")
    return np.array(lists)


def check_state(r: np.void) -> None:
    """Raise ValueError for a state record with a value out of its range."""
    instant("state ns", int(r["ns"]))
    number("state sub", float(r["sub"]), 0.0, 1.0)
    number("state tau", float(r["tau"]), 0.0, 2.0 * math.pi)
    whole("state phase", int(r["phase"]), FLIGHT, HELD)
    number("state gap", float(r["gap"]), low=0.0)
    whole("state rows", int(r["rows"]), 0, 2**53)
    whole("state cycles", int(r["cycles"]), -(2**53), 2**53)
    whole("state turns", int(r["turns"]), -(2**62), 2**62)
    slip = whole("state slip_sign", int(r["slip_sign"]), -1, 1)
    spin = whole("state spin_sign", int(r["spin_sign"]), -1, 1)
    whole("state rows_entered", int(r["rows_entered"]), 0, 2**9 - 1)
    if r["phase"] in (SLIDING, HELD) and slip == 0:
        raise refusal("state slip_sign", slip, "-1 or 1 while sliding or held")
    if r["phase"] == STICKING and slip != 0:
        raise refusal("state slip_sign", slip, "0 while sticking")
    if r["phase"] == HELD and spin != 0:
        raise refusal("state spin_sign", spin, "0 while held")


def check_motion(r: np.void) -> None:
    """Raise ValueError for a record of a motion with a value out of its range."""
    whole("motion kind", int(r["kind"]), STEADY, FADE)
    instant("motion begin_ns", int(r["begin_ns"]))
    whole("motion cycles", int(r["cycles"]), -(2**53), 2**53)
    number("motion tau", float(r["tau"]), 0.0, 2.0 * math.pi)
    start = [float(r[name]) for name in ("a", "p", "f", "lag")]
    motion("motion", start)
    changes = [float(r[name]) for name in ("da", "dp", "df", "dlag")]
    if r["kind"] == STEADY:
        if any(changes):
            raise refusal("motion changes", changes, "0 in a steady motion")
        return
    end = [a + b for a, b in zip(start, changes, strict=True)]
    motion("motion end", [max(end[0], 0.0), max(end[1], 0.0), *end[2:]])
    duration = (instant("motion end_ns", int(r["end_ns"])) - int(r["begin_ns"])) * 1e-9
    if not 0.0 < duration == r["duration"]:
        raise refusal("motion duration", float(r["duration"]), f"{duration!r} s, more than 0")


# ------------------------------------------------------------------------------------------------
# Offset trajectories.


LARGEST = 1e6
"""Largest position (m or rad), velocity and acceleration over 1e3 and 1e6, of a knot."""
_NUMBERS = 9


def plain_offset(offset: Offset, in_force: tuple[Segment, Segment], index: int) -> dict[str, Any]:
    """Both lanes, the segments in force and the index as JSON-able numbers."""
    lanes = {
        joint: [[_row(segment) for segment in plan.segments] for plan in lane.plans]
        for joint, lane in zip(("axial", "angular"), offset, strict=True)
    }
    return {"index": index, "in_force": [_row(segment) for segment in in_force], **lanes}


def _row(segment: Segment) -> list[Any]:
    begin, end, start, finish, degree = segment
    return [begin, end, *start, *finish, degree]


def offset(values: Any) -> tuple[Offset, tuple[Segment, Segment], int]:
    """Inverse of `plain_offset`; for None no offset. Raises ValueError, one line."""
    if values is None:
        return Offset(), (hold(0, 0.0), hold(0, 0.0)), 0
    names = {"index", "in_force", "axial", "angular"}
    if not isinstance(values, Mapping) or set(values) != names:
        raise refusal("offset", values, "a mapping with " + ", ".join(sorted(names)))
    in_force = items("offset in_force", values["in_force"], _segment, 2)
    if len(in_force) != 2:
        raise refusal("offset in_force", values["in_force"], "two segments")
    lanes = (
        Lane(tuple(items(f"offset {joint}", values[joint], _plan)))
        for joint in ("axial", "angular")
    )
    made = Offset(*lanes)
    for lane in made:
        if not lane.plans:
            raise refusal("offset", values, "trajectories")
        in_order("offset", [plan.begin_ns for plan in lane.plans])
    return made, (in_force[0], in_force[1]), whole("offset index", values["index"], 0)


def _plan(name: str, values: Any) -> Plan:
    segments = tuple(items(name, values, _segment))
    if not segments or segments[-1].degree != CONSTANT:
        raise refusal(name, values, "segments, the last of them a hold")
    for before, after in itertools.pairwise(segments):
        if before.degree == CONSTANT or before.end_ns != after.begin_ns:
            raise refusal(name, list(after[:2]), "segments without a break")
    return Plan(segments)


def _segment(name: str, values: Any) -> Segment:
    if not isinstance(values, (list, tuple)) or len(values) != _NUMBERS:
        raise refusal(name, values, f"{_NUMBERS} numbers")
    begin = instant(f"{name} begin", values[0])
    degree = whole(f"{name} degree", values[8], 0)
    if degree not in (CONSTANT, LINE, CUBIC, QUINTIC):
        raise refusal(f"{name} degree", degree, "0, 1, 3 or 5")
    start, end = (
        OffsetState(*(
            number(name, value, -most, most)
            for value, most in zip(part, (LARGEST, LARGEST * 1e3, LARGEST * 1e6), strict=True)
        ))
        for part in (values[2:5], values[5:8])
    )  # fmt: skip
    if degree == CONSTANT:
        if values[1] != int(NEVER) or start != OffsetState(start.position) or end != start:
            raise refusal(name, values, "a hold without end and motion")
        return hold(begin, start.position)
    if instant(f"{name} end", values[1]) <= begin:
        raise refusal(f"{name} end", values[1], f"more than {begin}")
    return Segment(begin, values[1], start, end, degree)

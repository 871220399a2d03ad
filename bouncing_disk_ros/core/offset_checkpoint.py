"""Offset trajectories in checkpoints: plain numbers and back, to the bit, every value checked."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

from bouncing_disk_ros.core import checkpoint
from bouncing_disk_ros.core.layout import NEVER
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

LARGEST = 1e6
"""Largest position (m or rad), velocity and acceleration over 1e3 and 1e6, of a knot."""
_NUMBERS = 9


def plain(offset: Offset, in_force: tuple[Segment, Segment], index: int) -> dict[str, Any]:
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
    """Inverse of `plain`; nothing given: no offset. ValueError, one line, for what does not fit."""
    if values is None:
        return Offset(), (hold(0, 0.0), hold(0, 0.0)), 0
    names = {"index", "in_force", "axial", "angular"}
    if not isinstance(values, Mapping) or set(values) != names:
        raise checkpoint.refusal("offset", values, "a mapping with " + ", ".join(sorted(names)))
    in_force = checkpoint.items("offset in_force", values["in_force"], _segment, 2)
    if len(in_force) != 2:
        raise checkpoint.refusal("offset in_force", values["in_force"], "two segments")
    lanes = (
        Lane(tuple(checkpoint.items(f"offset {joint}", values[joint], _plan)))
        for joint in ("axial", "angular")
    )
    made = Offset(*lanes)
    for lane in made:
        if not lane.plans:
            raise checkpoint.refusal("offset", values, "trajectories")
        checkpoint.in_order("offset", [plan.begin_ns for plan in lane.plans])
    return made, (in_force[0], in_force[1]), checkpoint.whole("offset index", values["index"], 0)


def _plan(name: str, values: Any) -> Plan:
    segments = tuple(checkpoint.items(name, values, _segment))
    if not segments or segments[-1].degree != CONSTANT:
        raise checkpoint.refusal(name, values, "segments, the last of them a hold")
    for before, after in itertools.pairwise(segments):
        if before.degree == CONSTANT or before.end_ns != after.begin_ns:
            raise checkpoint.refusal(name, list(after[:2]), "segments without a break")
    return Plan(segments)


def _segment(name: str, values: Any) -> Segment:
    if not isinstance(values, (list, tuple)) or len(values) != _NUMBERS:
        raise checkpoint.refusal(name, values, f"{_NUMBERS} numbers")
    begin = checkpoint.instant(f"{name} begin", values[0])
    degree = checkpoint.whole(f"{name} degree", values[8], 0)
    if degree not in (CONSTANT, LINE, CUBIC, QUINTIC):
        raise checkpoint.refusal(f"{name} degree", degree, "0, 1, 3 or 5")
    start, end = (
        OffsetState(*(
            checkpoint.number(name, value, -most, most)
            for value, most in zip(part, (LARGEST, LARGEST * 1e3, LARGEST * 1e6), strict=True)
        ))
        for part in (values[2:5], values[5:8])
    )  # fmt: skip
    if degree == CONSTANT:
        if values[1] != int(NEVER) or start != OffsetState(start.position) or end != start:
            raise checkpoint.refusal(name, values, "a hold without end and motion")
        return hold(begin, start.position)
    if checkpoint.instant(f"{name} end", values[1]) <= begin:
        raise checkpoint.refusal(f"{name} end", values[1], f"more than {begin}")
    return Segment(begin, values[1], start, end, degree)

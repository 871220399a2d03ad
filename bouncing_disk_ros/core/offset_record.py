"""The record of a motion with an offset, as the kernels read it (layout.PLATFORM_DTYPE)."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.layout import (
    FADE,
    MOVING,
    OFFSET_DEGREE,
)
from bouncing_disk_ros.core.offset import CONSTANT, LINE, Segment, coefficients, derivative, highest
from bouncing_disk_ros.core.platform import (
    DERIVATIVE_RATIO,
    PAST_END,
    ROOM,
    offset_bounds,
    without_offset,
)

_PARTS = 4
"""Parts of a segment that have bounds of their own."""


def _table(segment: Segment) -> NDArray[np.float64]:
    """Derivatives 0 to 5 as polynomials over the segment's duration, pairs of numbers."""
    table = np.zeros((OFFSET_DEGREE + 1, OFFSET_DEGREE + 1, 2))
    c, scale = coefficients(segment), Fraction(1)
    for order in range(OFFSET_DEGREE + 1):
        for i, coefficient in enumerate(c):
            exact = coefficient * scale
            high = float(exact)
            table[order, i] = high, float(exact - Fraction(high))
        c, scale = derivative(c), scale / segment.duration
    return table


def _duration_ns(segment: Segment) -> float:
    return 1e9 if segment.degree == CONSTANT else float(segment.end_ns - segment.begin_ns)


def is_nothing(segment: Segment) -> bool:
    """Whether a segment adds nothing to a motion: it holds 0."""
    return segment.degree == CONSTANT and segment.start.position == 0.0


def with_offset(base: NDArray[np.void], axial: Segment, angular: Segment) -> NDArray[np.void]:
    """What the kernels read of a sinusoid or a cross-fade with the offset's segments in force."""
    m = without_offset(base)
    if is_nothing(axial) and is_nothing(angular):
        return m
    moving = [segment for segment in (axial, angular) if segment.degree != CONSTANT]
    begins = [segment.begin_ns for segment in moving]
    begin_ns, end_ns, fades = int(m["begin_ns"][0]), int(m["end_ns"][0]), m["kind"][0] == FADE
    m["offset"] = 1
    if fades:
        origin = max([begin_ns, *begins])
        m["origin_ns"], m["fade_lead"] = origin, (origin - begin_ns) * 1e-9
        m["fade_end"] = (end_ns - origin) * 1e-9
    elif moving:
        m["kind"], m["duration"] = MOVING, math.inf
        m["origin_ns"] = max(begins)
    m["turning"] = int(angular.degree != CONSTANT)
    m["bending"] = int(axial.degree > LINE)
    _enter(m, "axial", ("s2", "s3", "s4"), axial)
    _enter(m, "angular", ("b2", "b3", "b4"), angular)
    m["fifth"] = m["angular"][0, 5, 0, 0]
    curved = [_duration_ns(segment) * 1e-9 for segment in moving if segment.degree > LINE]
    m["span"] = min(curved, default=math.inf) / _PARTS
    m["omega_max"] = max([float(m["omega_max"][0]), *(DERIVATIVE_RATIO / t for t in curved)])
    if not is_nothing(axial):
        top = float(base["top"][0])
        m["top"] = top + _top(axial) + (ROOM - 1.0) * (top + abs(_top(axial)))
    return m


@lru_cache(maxsize=64)
def _prepared(segment: Segment) -> tuple[NDArray[np.float64], tuple[float, ...]]:
    """The table of a segment, and bounds of its second to fourth derivatives."""
    table, duration = _table(segment), _duration_ns(segment)
    compute = getattr(offset_bounds, "py_func", offset_bounds)  # without compiling it
    found = compute(table, duration, 0.0, (duration + PAST_END) * 1e-9)
    return table, tuple(float(value) * ROOM for value in found)


@lru_cache(maxsize=64)
def _top(segment: Segment) -> float:
    """A bound from above of a segment's position."""
    c = coefficients(segment)
    beyond = float(PAST_END) * max(abs(float(v)) for v in derivative(c)) / _duration_ns(segment)
    return highest(c) + OFFSET_DEGREE * beyond + (ROOM - 1.0) * max(abs(float(v)) for v in c)


def _enter(m: NDArray[np.void], joint: str, bounds: tuple[str, ...], segment: Segment) -> None:
    """Enter one joint's segment, and add its bounds to those of the sinusoid."""
    table, found = _prepared(segment)
    m[joint], m[f"{joint}_duration"] = table, _duration_ns(segment)
    if segment.degree != CONSTANT:
        m[f"{joint}_lead"] = (int(m["origin_ns"][0]) - segment.begin_ns) * 1e-9
    for name, value in zip(bounds, found, strict=True):
        m[name] += value

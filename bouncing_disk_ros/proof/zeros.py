"""The first zero of a function, enclosed: nothing before it, and just one sign change in it."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from flint import arb

from bouncing_disk_ros.proof.event_functions import Watched
from bouncing_disk_ros.proof.positivity import MOST_PIECES, decides

_NARROW = tuple(arb(2) ** -bits for bits in range(96, 56, -4))
"""Relative half widths of an enclosed zero: below the rounding of a float64."""
_STEPS = 200


class Found(Enum):
    """What a search for the first zero has shown."""

    ZERO = 0
    NONE = 1
    UNKNOWN = 2  # a graze, or too many pieces


class Zero(NamedTuple):
    """The first zero as a ball; `at` is where the search stopped if it is unknown."""

    found: Found
    at: arb
    pieces: int = 0


def first_zero(watched: Watched, begin: float, end: float, cuts: tuple[float, ...] = ()) -> Zero:
    """The first zero in [begin, end] of a function that is positive at `begin`."""
    marks = [begin, *sorted(t for t in set(cuts) if begin < t < end), end]
    ends = [watched.jet(arb(t))[:2] for t in marks]
    todo = [(marks[i], ends[i], marks[i + 1], ends[i + 1]) for i in range(len(marks) - 1)]
    todo.reverse()
    count = 0
    while todo:
        a, at_a, b, at_b = todo.pop()
        count += 1
        length, over = arb(b) - arb(a), watched.over(a, b)
        if decides((at_a[0], at_a[1]), (at_b[0], at_b[1]), over, length):
            continue
        if at_a[0] > 0 > at_b[0] and over[1] < 0:
            return Zero(Found.ZERO, _enclosed(watched, a, b), count)
        middle = 0.5 * (a + b)
        if count > MOST_PIECES or not a < middle < b:
            return Zero(Found.UNKNOWN, arb(a), count)
        at_middle = watched.jet(arb(middle))[:2]
        todo.append((middle, at_middle, b, at_b))
        todo.append((a, at_a, middle, at_middle))
    return Zero(Found.NONE, arb(end), count)


def _enclosed(watched: Watched, a: float, b: float) -> arb:
    """The one zero between a and b, where the function falls: Newton's steps, then a proof.

    Where the precision is not enough for a narrow ball it is a wide one, a zero all the same.
    """
    low, high = arb(a), arb(b)
    x = ((low + high) / 2).mid()
    for _ in range(_STEPS):
        value, slope = watched.jet(x)[:2]
        if value > 0:
            low = x
        elif value < 0:
            high = x
        else:
            break  # as near as the precision allows
        step = (value / slope).mid()
        x = (x - step).mid()
        if not low <= x <= high:
            x = ((low + high) / 2).mid()
        elif abs(step) < abs(x) * _NARROW[0]:
            break
    for part in _NARROW:
        before, after = (x - abs(x) * part).mid(), (x + abs(x) * part).mid()
        if watched.jet(before)[0] > 0 > watched.jet(after)[0]:
            return before.union(after)
    return low.union(high)

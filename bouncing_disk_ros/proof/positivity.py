"""Proof that a function is positive on an interval, by adaptive subdivision; its first zero.

On a piece [a, b] the values and slopes at both ends are known as balls, and value, slope and second
derivative as balls over all of it. What follows from these is sought in turn: the value itself, a
slope of one sign, concave (the least value is at an end), convex (the tangents lie below), a
parabola below, the chord less what the curvature can take away. A piece that none decides is cut in
two.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from enum import Enum
from itertools import pairwise
from typing import NamedTuple

from flint import arb, ctx

from bouncing_disk_ros.proof.event_functions import Watched
from bouncing_disk_ros.proof.platforms import interval

End = tuple[arb, arb]  # value and slope
Piece = tuple[float, End, float, End]  # where it begins and ends, with what holds there
Range = tuple[arb, arb, arb]  # value from below, slope, second derivative

MOST_PIECES = 20_000


class Sign(Enum):
    """What is known of a function on an interval."""

    POSITIVE = 0
    WITHIN_ROUNDING = 1  # not below minus its tolerance
    NEGATIVE = 2  # surely below minus its tolerance at a point
    UNKNOWN = 3  # too many pieces


class Finding(NamedTuple):
    """The sign of a function on an interval; where and how far below zero, if it is."""

    sign: Sign
    at: float = math.nan
    value: float = math.nan
    pieces: int = 0


def opens(watched: Watched, end: float, rate: float) -> float | None:
    """A time up to which a function that begins at zero is positive; 0 where it begins above.

    The derivatives at t = 0 that are zero to rounding are taken as zero, as they are by what the
    state means (no gap at an impact, no load at a separation, no slip where one begins); those
    that follow must be positive at t = 0, up to one that is positive from there on. None: that is
    not so within `end`, or not to be shown. `rate`: how fast the platform's phase grows.
    """
    start = watched.start()
    order = 0
    while order < len(start) and abs(start[order]) <= watched.tolerance(0.0, order):
        order += 1
    if order == 0:
        return 0.0
    last = order
    while last < len(start) and start[last] > 0:
        last += 1
    length = min(end, 0.5 / rate)
    for _ in range(400):
        over = watched.jet(interval(0.0, length))
        if any(d > 0 for d in over[order:last]) and watched.jet(arb(length))[0] > 0:
            return length
        length *= 0.5
    return None


def positive_from_start(watched: Watched, end: float, rate: float) -> Finding:
    """Whether a function that begins at zero, or above, is positive from then on until `end`."""
    if end <= 0.0:
        return Finding(Sign.POSITIVE)
    first = opens(watched, end, rate)
    return positive_on(watched, first or 0.0, end, watched.floor_zeros())


class _Pieces:
    """The pieces of [begin, end] that are still to be decided, from left to right."""

    def __init__(
        self, watched: Watched, begin: float, end: float, cuts: tuple[float, ...], most: int
    ) -> None:
        self._watched, self._most = watched, most
        self.count = 0  # of those looked at
        marks = [begin, *sorted(t for t in set(cuts) if begin < t < end), end]
        ends = [self._end(t) for t in marks]
        self._todo = [(*left, *right) for left, right in pairwise(zip(marks, ends, strict=True))]
        self._todo.reverse()

    def __iter__(self) -> Iterator[Piece]:
        while self._todo:
            self.count += 1
            yield self._todo.pop()

    def cut(self, piece: Piece) -> bool:
        """Put the halves of a piece in its place; False: too many pieces, or none so short."""
        a, at_a, b, at_b = piece
        middle = 0.5 * (a + b)
        if self.count > self._most or not a < middle < b:
            return False
        at_middle = self._end(middle)
        self._todo.append((middle, at_middle, b, at_b))
        self._todo.append((a, at_a, middle, at_middle))
        return True

    def _end(self, t: float) -> End:
        value, slope = self._watched.jet(arb(t))[:2]
        return value, slope


def positive_on(
    watched: Watched, begin: float, end: float, cuts: tuple[float, ...] = ()
) -> Finding:
    """Whether a function is positive on [begin, end]; `cuts`: where to cut first."""
    if end <= begin:
        return Finding(Sign.POSITIVE)
    pieces = _Pieces(watched, begin, end, cuts, MOST_PIECES)
    largest = watched.tolerance(end)
    touch = None
    for piece in pieces:
        a, at_a, b, at_b = piece
        for t, at_t in ((a, at_a), (b, at_b)):
            if at_t[0] < 0 and at_t[0] < -watched.tolerance(t):
                return Finding(Sign.NEGATIVE, t, float(at_t[0]), pieces.count)
        known = _known_of(watched, piece, largest)
        if known is Sign.WITHIN_ROUNDING and touch is None:
            touch = Finding(known, a, float(at_a[0]))
        if known is Sign.UNKNOWN and not pieces.cut(piece):
            return Finding(Sign.UNKNOWN, a, float(at_a[0]), pieces.count)
    return (touch or Finding(Sign.POSITIVE))._replace(pieces=pieces.count)


def _known_of(watched: Watched, piece: Piece, largest: float) -> Sign:
    """What is known of a piece from its ends and the range over it.

    `largest`: the tolerance at the end of the interval, for it grows with time.
    """
    a, at_a, b, at_b = piece
    over, length = watched.over(a, b), arb(b) - arb(a)
    if decides(at_a, at_b, over, length):
        return Sign.POSITIVE
    if at_a[0] > largest and at_b[0] > largest:
        return Sign.UNKNOWN
    slack = watched.tolerance(a)
    if not at_a[0] > slack or not at_b[0] > slack:
        lifted_a, lifted_b = (at_a[0] + slack, at_a[1]), (at_b[0] + slack, at_b[1])
        if decides(lifted_a, lifted_b, (over[0] + slack, over[1], over[2]), length):
            return Sign.WITHIN_ROUNDING
    return Sign.UNKNOWN


def decides(at_a: End, at_b: End, over: Range, length: arb) -> bool:
    """Whether these data prove the function positive on the piece."""
    (fa, da), (fb, db), (value, slope, curvature) = at_a, at_b, over
    if value > 0:
        return True
    if not (fa > 0 and fb > 0):
        return False
    if slope >= 0 or slope <= 0 or curvature <= 0:
        return True
    low = curvature.lower()
    if low >= 0 and (da >= 0 or db <= 0 or _tangents_meet_above(at_a, at_b, length)):
        return True
    bend = low.min(arb(0)) * length * length / 2
    if fa + da * length + bend > 0 or fb - db * length + bend > 0:
        return True  # a concave parabola below, positive at both ends
    return bool(fa.min(fb) - curvature.upper() * length * length / 8 > 0)


def _tangents_meet_above(at_a: End, at_b: End, length: arb) -> bool:
    (fa, da), (fb, db) = at_a, at_b
    bend = da - db
    return bool(bend < 0) and bool(fa + da * ((fb - fa - db * length) / bend) > 0)


# ------------------------------------------------------------------------------------------------
# The first zero of a function, enclosed: nothing before it, and just one sign change in it.


_STEPS = 200


def _half_widths() -> list[arb]:
    """Relative half widths of an enclosed zero, from three quarters of the precision on."""
    return [arb(2) ** -bits for bits in range(ctx.prec * 3 // 4, 16, -4)]


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
    pieces = _Pieces(watched, begin, end, cuts, MOST_PIECES)
    for piece in pieces:
        a, at_a, b, at_b = piece
        length, over = arb(b) - arb(a), watched.over(a, b)
        if decides(at_a, at_b, over, length):
            continue
        if at_a[0] > 0 > at_b[0] and over[1] < 0:
            return Zero(Found.ZERO, _enclosed(watched, a, b), pieces.count)
        if not pieces.cut(piece):
            return Zero(Found.UNKNOWN, arb(a), pieces.count)
    return Zero(Found.NONE, arb(end), pieces.count)


def _enclosed(watched: Watched, a: float, b: float) -> arb:
    """The one zero between a and b, where the function falls: Newton's steps, then a proof.

    Where the precision is not enough for a narrow ball it is a wide one, a zero all the same.
    """
    low, high, narrow = arb(a), arb(b), _half_widths()
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
        elif abs(step) < abs(x) * narrow[0]:
            break
    for part in narrow:
        before, after = (x - abs(x) * part).mid(), (x + abs(x) * part).mid()
        if watched.jet(before)[0] > 0 > watched.jet(after)[0]:
            return before.union(after)
    return low.union(high)

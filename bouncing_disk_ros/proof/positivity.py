"""Proof that a function is positive on an interval, by adaptive subdivision.

On a piece [a, b] the values and slopes at both ends are known as balls, and the second derivative
as a ball over all of it. What follows from these is sought in turn: concave (the least value is at
an end), convex (the tangents lie below), a parabola below, the chord less what its curvature can
take away. A piece that none decides is cut in two.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple, Protocol

from flint import arb

End = tuple[arb, arb]  # value and slope


class Watched(Protocol):
    """A function of time with the two derivatives that the proof needs."""

    def at(self, t: arb) -> End:
        """Value and slope at a point."""
        ...

    def curvature(self, piece: arb) -> arb:
        """The second derivative over a piece."""
        ...

    def surely_positive(self, a: arb, b: arb) -> bool:
        """Whether a cheap bound over [a, b] is enough."""
        ...

    def tolerance(self, t: float) -> float:
        """What the rounding of the inputs makes of the value at t."""
        ...


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


def piece(a: float, b: float) -> arb:
    """The interval [a, b] as a ball."""
    middle = 0.5 * (a + b)
    return arb(middle, math.nextafter(max(b - middle, middle - a), math.inf))


def positive_on(
    watched: Watched,
    begin: float,
    end: float,
    *,
    starts_at_zero: bool = False,
    cuts: tuple[float, ...] = (),
    most_pieces: int = 20_000,
) -> Finding:
    """Whether a function is positive on [begin, end].

    `starts_at_zero`: its value at `begin` is exactly zero, and it is to be positive after it.
    `cuts`: where to cut first.
    """
    if end <= begin:
        return Finding(Sign.POSITIVE)
    marks = [begin, *sorted(t for t in set(cuts) if begin < t < end), end]
    return _Subdivision(watched, begin if starts_at_zero else None, most_pieces).over(marks)


class _Subdivision:
    """The pieces that are still to be proved, from left to right."""

    def __init__(self, watched: Watched, zero_at: float | None, most_pieces: int) -> None:
        self._watched, self._zero_at, self._most = watched, zero_at, most_pieces
        self._count = 0

    def over(self, marks: list[float]) -> Finding:
        """The sign between the first and the last mark."""
        ends = [self._watched.at(arb(t)) for t in marks]
        for t, at_t in zip(marks, ends, strict=True):
            if self._is_negative(t, at_t):
                return self._finding(Sign.NEGATIVE, t, at_t)
        todo = [(marks[i], ends[i], marks[i + 1], ends[i + 1]) for i in range(len(marks) - 1)]
        todo.reverse()
        touch = None
        while todo:
            a, at_a, b, at_b = todo.pop()
            self._count += 1
            known = self._piece(a, at_a, b, at_b)
            if known is Sign.WITHIN_ROUNDING and touch is None:
                touch = self._finding(known, a, at_a)
            if known is not Sign.UNKNOWN:
                continue
            middle = 0.5 * (a + b)
            if self._count > self._most or not a < middle < b:
                return self._finding(Sign.UNKNOWN, a, at_a)
            at_middle = self._watched.at(arb(middle))
            if self._is_negative(middle, at_middle):
                return self._finding(Sign.NEGATIVE, middle, at_middle)
            todo.append((middle, at_middle, b, at_b))
            todo.append((a, at_a, middle, at_middle))
        if touch is not None:
            return touch._replace(pieces=self._count)
        return Finding(Sign.POSITIVE, pieces=self._count)

    def _is_negative(self, t: float, at_t: End) -> bool:
        return bool(at_t[0] < -self._watched.tolerance(t))

    def _finding(self, sign: Sign, t: float, at_t: End) -> Finding:
        return Finding(sign, t, float(at_t[0]), self._count)

    def _piece(self, a: float, at_a: End, b: float, at_b: End) -> Sign:
        """What is known of [a, b] from its ends and the curvature over it."""
        start, stop = arb(a), arb(b)
        if self._watched.surely_positive(start, stop):
            return Sign.POSITIVE
        curvature, length = self._watched.curvature(piece(a, b)), stop - start
        if decides(at_a, at_b, curvature, length, a == self._zero_at):
            return Sign.POSITIVE
        slack = self._watched.tolerance(a)
        if at_a[0] < slack or at_b[0] < slack:
            lifted_a, lifted_b = (at_a[0] + slack, at_a[1]), (at_b[0] + slack, at_b[1])
            if decides(lifted_a, lifted_b, curvature, length, False):
                return Sign.WITHIN_ROUNDING
        return Sign.UNKNOWN


def decides(at_a: End, at_b: End, curvature: arb, length: arb, zero: bool) -> bool:
    """Whether these data prove the function positive on the piece; `zero`: after its beginning."""
    (fa, da), (fb, db) = at_a, at_b
    if not fb > 0 or not (zero or fa > 0):
        return False
    if curvature <= 0:
        return True
    low = curvature.lower()
    if low >= 0:
        if (da > 0 or (da >= 0 and low > 0)) or (db <= 0 and not zero):
            return True
        bend = da - db
        if not zero and bend < 0 and fa + da * ((fb - fa - db * length) / bend) > 0:
            return True  # the tangents meet above zero
    elif fa + da * length + low * length * length / 2 > 0:
        return True  # a concave parabola below, positive at both ends
    elif fb - db * length + low * length * length / 2 > 0 and not zero:
        return True
    least = fa.min(fb)
    return not zero and bool(least - curvature.upper() * length * length / 8 > 0)

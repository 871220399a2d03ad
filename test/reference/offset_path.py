"""The pieces of offset trajectories: an independent formula, for tests.

Written from the words of the model with the basis functions of Hermite's interpolation; it shares
nothing with the core. Times are whole nanoseconds or seconds as the caller's kind of number.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from mpmath import mpf

Number = Any  # float or mpf


class Point(NamedTuple):
    """A knot: when, and what is stated: position, velocity and acceleration, as far as given."""

    at_ns: int
    stated: tuple[float, ...]


class Trajectory(NamedTuple):
    """Points of one joint from an instant on."""

    begin_ns: int
    points: tuple[Point, ...]


class Piece(NamedTuple):
    """From one instant to another (s), with the six end values and the number of stated ones."""

    begin: Number
    end: Number
    values: tuple[Number, ...]  # p0, v0, a0, p1, v1, a1
    kind: int  # 0 hold, 1 line, 2 cubic, 3 quintic

    def at(self, t: Number, order: int = 0) -> Number:
        """A derivative at t."""
        d = self.end - self.begin if self.kind else 1
        return _power_sum(self.coefficients(), (t - self.begin) / d, order) / d**order

    def coefficients(self) -> list[Number]:
        """Coefficients over x = (t − begin)/(end − begin), by Hermite's basis functions."""
        p0, v0, a0, p1, v1, a1 = self.values
        if self.kind == 0:
            return [p0]
        if self.kind == 1:
            return [p0, p1 - p0]
        d = self.end - self.begin
        if self.kind == 2:
            weights: tuple[tuple[int, ...], ...] = (
                (1, 0, -3, 2),
                (0, 1, -2, 1),
                (0, 0, 3, -2),
                (0, 0, -1, 1),
            )
            scaled: tuple[Number, ...] = (p0, v0 * d, p1, v1 * d)
        else:
            weights = (
                *((1, 0, 0, -10, 15, -6), (0, 1, 0, -6, 8, -3), (0, 0, 1, -3, 3, -1)),
                *((0, 0, 0, 10, -15, 6), (0, 0, 0, -4, 7, -3), (0, 0, 0, 1, -2, 1)),
            )
            scaled = (p0, v0 * d, a0 * d * d / 2, p1, v1 * d, a1 * d * d / 2)
        return [
            sum(w[k] * v for w, v in zip(weights, scaled, strict=True))
            for k in range(len(weights[0]))
        ]


def _power_sum(weights: Sequence[Number], x: Number, order: int) -> Number:
    c = list(weights)
    for _ in range(order):
        c = [k * value for k, value in enumerate(c)][1:]
    total = 0 * x
    for value in reversed(c):
        total = total * x + value
    return total


def pieces(trajectories: Sequence[Trajectory], kind: type = mpf) -> list[Piece]:
    """The pieces of one joint, in order; each trajectory begins where the ones before have led."""

    def seconds(ns: int) -> Number:
        return kind(ns) / kind(10**9)

    zero = kind(0)
    found = [Piece(zero, kind("inf"), (zero,) * 6, 0)]
    for trajectory in trajectories:
        begin = seconds(trajectory.begin_ns)
        start = state_at(found, begin)
        found = [piece for piece in found if piece.begin < begin]
        if found:
            found[-1] = found[-1]._replace() if found[-1].end <= begin else found[-1]
        now = begin
        for point in trajectory.points:
            end = tuple(kind(value) for value in point.stated)
            end = (*end, zero, zero)[:3]
            at = seconds(point.at_ns)
            found.append(Piece(now, at, (*start, *end), len(point.stated)))
            start, now = end, at
        found.append(Piece(now, kind("inf"), (start[0],) + (zero,) * 5, 0))
    return found


def piece_at(found: Sequence[Piece], t: Number) -> Piece:
    """The piece in force just after t."""
    return max((p for p in found if p.begin <= t), key=lambda p: p.begin, default=found[0])


def state_at(found: Sequence[Piece], t: Number) -> tuple[Number, Number, Number]:
    """Position, velocity and acceleration at t; at a knot what it states."""
    for piece in found:
        if piece.kind and piece.end == t and any(after.begin == t for after in found):
            values = piece.values
            return values[3], values[4], values[5]
    piece = piece_at(found, t)
    if piece.begin == t:
        return piece.values[0], piece.values[1], piece.values[2]
    return tuple(piece.at(t, order) for order in range(3))

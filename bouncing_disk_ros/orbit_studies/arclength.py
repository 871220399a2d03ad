"""Pseudo-arclength continuation: a curve of solutions of n equations in n + 1 unknowns.

Each step goes along the tangent and is corrected by Newton's method in the plane normal to it (H.
B. Keller, 1977), so folds are passed like any other point. Steps are kept short where the
direction turns.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
System = Callable[[Array], tuple[Array, Array]]
"""Of the unknowns (n + 1,): values (n,) and derivatives (n, n + 1)."""

RESIDUAL = 1e-11
"""A solution has residuals below this where Newton's method gets no closer."""
_ITERATIONS = 12
_LARGEST_TURN = math.cos(0.25)  # rad, between the tangents of points in a row
_EASY = math.cos(0.08)


class Point(NamedTuple):
    """One solution and the unit tangent there."""

    unknowns: Array
    tangent: Array


def corrected(system: System, guess: Array, normal: Array, level: float) -> Array | None:
    """The solution near `guess` with normal·unknowns = level, by Newton's method; None: none."""
    unknowns, best, kept = guess.copy(), math.inf, guess
    for _ in range(_ITERATIONS):
        values, matrix = system(unknowns)
        values = np.append(values, normal @ unknowns - level)
        residual = float(np.max(np.abs(values)))
        if not math.isfinite(residual):
            return None
        if residual < best:
            best, kept = residual, unknowns
        elif best < RESIDUAL:
            break
        if residual < 1e-15:
            break
        try:
            step = np.linalg.solve(np.vstack((matrix, normal)), values)
        except np.linalg.LinAlgError:
            return None
        if not np.all(np.isfinite(step)):
            return None
        unknowns = unknowns - step * min(1.0, 0.5 / max(float(np.max(np.abs(step))), 1e-300))
    return kept if best < RESIDUAL else None


def tangent_at(system: System, unknowns: Array, towards: Array) -> Array:
    """The unit tangent of the curve of solutions, on the side of `towards`."""
    matrix = system(unknowns)[1]
    tangent = np.asarray(np.linalg.svd(matrix)[2][-1])
    return tangent if tangent @ towards >= 0.0 else -tangent


def stepped(system: System, point: Point, length: float) -> Point | None:
    """The point at `length` along the tangent of another; None where none is found near."""
    guess = point.unknowns + length * point.tangent
    found = corrected(system, guess, point.tangent, float(point.tangent @ guess))
    if found is None or np.linalg.norm(found - guess) > max(abs(length), 1e-9):
        return None
    return Point(found, tangent_at(system, found, point.tangent))


def continued(system: System, start: Point, largest: float, smallest: float) -> Iterator[Point]:
    """The points that follow `start`, not further apart than `largest`; ends where none is found.

    Steps below `smallest` are not taken.
    """
    point, length = start, 0.25 * largest
    while length >= smallest:
        found = stepped(system, point, length)
        turn = -1.0 if found is None else float(found.tangent @ point.tangent)
        if found is None or turn < _LARGEST_TURN:
            length *= 0.5
            continue
        yield found
        point = found
        if turn > _EASY:
            length = min(1.5 * length, largest)

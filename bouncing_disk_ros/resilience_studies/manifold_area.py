"""The part of a window that the stable manifold of a saddle encloses: the share of a basin.

The map backwards keeps the sense of rotation, so the basin lies on one side of a branch all along
it. With both branches, and w_A = `lowest` below, the enclosed area is the integral of the height
above `lowest` along them. Between points the line is Hermite's cubic with the slopes of parabolas
through three points, integrated exactly: the error falls with the fourth power of their distance.
Other windows are cut out of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.resilience_studies.manifold_growth import Manifold, Stability

Array = NDArray[np.float64]

BESIDE = 1e-6
"""Distance (rad and πg/ω) from a manifold at which its sides are looked at."""
_HALVINGS = 45
"""Halvings of a part that crosses an edge of the window: what is left is below rounding."""
_NODES = (np.array(np.polynomial.legendre.leggauss(8)[0]) + 1.0) / 2.0
_WEIGHTS = np.array(np.polynomial.legendre.leggauss(8)[1]) / 2.0


class Window(NamedTuple):
    """A part of the plane of states: forcing phases (rad) and velocities w_A (πg/ω)."""

    lowest: float = -5.0
    highest: float = 0.0
    phase_begin: float = 0.0
    phase_end: float = math.tau


class Enclosed(NamedTuple):
    """The part of a window between the branches of a stable manifold."""

    share: float
    inside: int  # which of the two results of `sides` lies in it: 0 or 1


def enclosed_share(branches: Sequence[Manifold], lowest: float = -5.0) -> float:
    """Share of the window τ ∈ [0, 2π), w_A ∈ (lowest, 0) between the branches of a saddle.

    `branches`: those of the stable manifold of one saddle, in the order of `saddle_manifolds`
    (pairs of opposite senses), grown to below `lowest`. Raises InputError where a branch is not
    complete, or is cut inside the window: then it alone encloses nothing. It is the share of a
    basin where these branches are the whole boundary of one; `sides` tells.

    >>> enclosed_share(saddle_manifolds(saddle, "stable", GrowthRule(distance=0.01)))
    """
    return enclosed_part(branches, Window(lowest)).share


def enclosed_part(branches: Sequence[Manifold], window: Window) -> Enclosed:
    """As `enclosed_share`, for any window, and which side of the branches it is."""
    if not window.lowest < window.highest <= 0.0:
        allowed = f"less than the highest velocity, {window.highest:g}"
        raise InputError("lowest", window.lowest, allowed)
    total = 0.0
    for k, branch in enumerate(branches):
        if branch.stability is not Stability.STABLE:
            raise InputError("branches", str(branch.stability), "branches of a stable manifold")
        if why := why_open(branch, window.lowest):
            raise InputError("branches", f"one that encloses nothing: {why}", "complete ones")
        part = sum(
            _height_integral(piece, sigma, window)
            for piece, sigma in zip(branch.pieces, branch.sigma, strict=True)
        )
        total += part if k % 2 == 0 else -part
    size = (window.phase_end - window.phase_begin) * (window.highest - window.lowest)
    # along the second branch and then the first, the integral is less than 0 around the left
    return Enclosed(abs(total) / size, 0 if total < 0.0 else 1)


def sides(branches: Sequence[Manifold], lowest: float, count: int = 64) -> tuple[Array, Array]:
    """States (m, 2) just to the left and just to the right of branches in a window, to be labelled.

    Left of a branch, and right of the opposite one. If all of one side go to one attractor and all
    of the other to another, the branches are the boundary between these.
    """
    left, right = [np.empty((0, 2))], [np.empty((0, 2))]
    for k, branch in enumerate(branches):
        for piece in branch.pieces:
            places = np.unique(np.linspace(1, len(piece) - 1, count).astype(int))
            places = places[piece[places, 1] > lowest + BESIDE]
            way = piece[places] - piece[places - 1]
            normal = np.stack((-way[:, 1], way[:, 0]), axis=1)
            normal *= BESIDE / np.hypot(*way.T)[:, None]
            pair = piece[places] + normal, piece[places] - normal
            left.append(pair[k % 2])
            right.append(pair[1 - k % 2])
    found = np.concatenate(left), np.concatenate(right)
    for states in found:
        states[:, 0] %= math.tau
    return found


def why_open(branch: Manifold, lowest: float) -> str:
    """Why a branch encloses no part of what lies above `lowest`; empty: it does."""
    ends = [piece[k] for piece in branch.pieces for k in (0, -1)][1:]
    inside = sum(float(end[1]) > lowest for end in ends)
    return branch.ended or (f"grazes cut it at {inside} places" if inside else "")


def _height_integral(piece: Array, sigma: Array, window: Window) -> float:
    """∫ of the part of the window below a piece, over τ: parts that cross its edges are halved."""
    cubic = _cubics(piece, sigma)
    start, end = np.zeros(len(piece) - 1), np.ones(len(piece) - 1)
    total = 0.0
    for halvings in range(_HALVINGS + 1):
        crossing = np.any(
            _edges(cubic, start, window) != _edges(cubic, end, window), axis=0
        ) & (halvings < _HALVINGS)  # fmt: skip
        total += _integral(cubic[~crossing], start[~crossing], end[~crossing], window)
        if not crossing.any():
            break
        cubic = np.repeat(cubic[crossing], 2, axis=0)
        middle = 0.5 * (start[crossing] + end[crossing])
        start = np.stack((start[crossing], middle), axis=1).ravel()
        end = np.stack((middle, end[crossing]), axis=1).ravel()
    return total


def _integral(cubic: Array, start: Array, end: Array, window: Window) -> float:
    """∫ over parts of cubics within which no edge of the window is crossed."""
    total = np.zeros(len(cubic))
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        at = start + node * (end - start)
        tau, w = _values(cubic, at)
        rate = cubic[:, 1, 0] + at * (2.0 * cubic[:, 2, 0] + 3.0 * at * cubic[:, 3, 0])
        height = np.clip(w, window.lowest, window.highest) - window.lowest
        total += weight * height * _times(tau, window) * rate * (end - start)
    return float(np.sum(total))


def _values(cubic: Array, at: Array) -> tuple[Array, Array]:
    """τ and w_A of the cubics (m, 4, 2) at (m,) values from 0 to 1."""
    t = at[:, None]
    found = cubic[:, 0] + t * (cubic[:, 1] + t * (cubic[:, 2] + t * cubic[:, 3]))
    return found[:, 0], found[:, 1]


def _times(tau: Array, window: Window) -> Array:
    """How often the window holds a forcing phase, any number of turns apart."""
    ends = np.array([window.phase_begin, window.phase_end])[:, None]
    first, last = np.floor((tau - ends) / math.tau)
    return np.asarray(first - last)


def _edges(cubic: Array, at: Array, window: Window) -> Array:
    """On which side of the edges of the window the cubics are: equal where none is between."""
    tau, w = _values(cubic, at)
    ends = np.array([window.phase_begin, window.phase_end])[:, None]
    turns = np.floor((tau - ends) / math.tau)
    return np.concatenate((turns, [w < window.lowest], [w > window.highest]))


def _cubics(piece: Array, sigma: Array) -> Array:
    """Coefficients (m - 1, 4, 2) of Hermite's cubics between the points of a piece."""
    step, way = np.diff(sigma), np.diff(piece, axis=0)
    slope = _slopes(piece, step) if len(piece) > 2 else np.repeat(way / step[:, None], 2, axis=0)
    m0, m1 = slope[:-1] * step[:, None], slope[1:] * step[:, None]
    return np.stack((piece[:-1], m0, 3.0 * way - 2.0 * m0 - m1, m0 + m1 - 2.0 * way), axis=1)


def _slopes(piece: Array, step: Array) -> Array:
    """Derivatives (m, 2) by σ, of the parabolas through neighbours."""
    rate = np.diff(piece, axis=0) / step[:, None]
    before, after = step[:-1, None], step[1:, None]
    inner = (after * rate[:-1] + before * rate[1:]) / (before + after)
    first = 2.0 * rate[0] - inner[0]
    last = 2.0 * rate[-1] - inner[-1]
    return np.concatenate((first[None], inner, last[None]))

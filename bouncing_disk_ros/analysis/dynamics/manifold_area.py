"""The part of a window that the stable manifold of a saddle encloses: the share of a basin.

The map backwards keeps the sense of rotation, so the basin lies on one side of a branch all along
it. With both branches, and w_A = `lowest` below, the enclosed area is the integral of the height
above `lowest` along them. Between points the line is Hermite's cubic with the slopes of parabolas
through three points, integrated exactly: the error falls with the fourth power of their distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.dynamics.manifold_growth import Manifold, Stability
from bouncing_disk_ros.errors import InputError

Array = NDArray[np.float64]

BESIDE = 1e-3
"""Distance (rad and πg/ω) from a manifold at which its sides are looked at."""
_NODES = (np.array(np.polynomial.legendre.leggauss(8)[0]) + 1.0) / 2.0
_WEIGHTS = np.array(np.polynomial.legendre.leggauss(8)[1]) / 2.0


def enclosed_share(branches: Sequence[Manifold], lowest: float = -5.0) -> float:
    """Share of the window τ ∈ [0, 2π), w_A ∈ (lowest, 0) between the branches of a saddle.

    `branches`: those of the stable manifold of one saddle, in the order of `saddle_manifolds`
    (pairs of opposite senses), grown to below `lowest`. Raises InputError where a branch is cut
    inside the window, or was ended before it left it: then it alone encloses nothing. It is the
    share of a basin where these branches are the whole boundary of one; `sides` tells.

    >>> enclosed_share(saddle_manifolds(saddle, "stable", GrowthRule(distance=0.01)))
    """
    if not lowest < 0.0:
        raise InputError("lowest", lowest, "less than 0")
    total = 0.0
    for k, branch in enumerate(branches):
        if branch.stability is not Stability.STABLE:
            raise InputError("branches", str(branch.stability), "branches of a stable manifold")
        _check_open(branch, lowest)
        part = sum(
            _height_integral(piece, sigma, lowest)
            for piece, sigma in zip(branch.pieces, branch.sigma, strict=True)
        )
        total += part if k % 2 == 0 else -part
    return abs(total) / (math.tau * -lowest)


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


def _check_open(branch: Manifold, lowest: float) -> None:
    """InputError if the branch ends within the window."""
    ends = [piece[k] for piece in branch.pieces for k in (0, -1)][1:]
    inside = sum(float(end[1]) > lowest for end in ends)
    if inside or not branch.complete:
        allowed = "branches that run on to below the window"
        given = f"a branch with {inside} ends in it" if inside else "a branch that was cut short"
        raise InputError("branches", given, allowed, "Grazes cut it, or it has too few points")


def _height_integral(piece: Array, sigma: Array, lowest: float) -> float:
    """∫ max(w − lowest, 0) dτ along a piece."""
    if len(piece) < 3:
        height = np.maximum(piece[:, 1] - lowest, 0.0)
        return float(np.sum(0.5 * (height[1:] + height[:-1]) * np.diff(piece[:, 0])))
    step = np.diff(sigma)
    slope = _slopes(piece, step)
    start, end = piece[:-1], piece[1:]
    m0, m1 = slope[:-1] * step[:, None], slope[1:] * step[:, None]
    total = np.zeros(len(step))
    for t, weight in zip(_NODES, _WEIGHTS, strict=True):
        h00, h10 = (1 + 2 * t) * (1 - t) ** 2, t * (1 - t) ** 2
        h01, h11 = t * t * (3 - 2 * t), t * t * (t - 1)
        w = h00 * start[:, 1] + h10 * m0[:, 1] + h01 * end[:, 1] + h11 * m1[:, 1]
        d00, d10 = 6 * t * t - 6 * t, 3 * t * t - 4 * t + 1
        d01, d11 = -d00, 3 * t * t - 2 * t
        dtau = d00 * start[:, 0] + d10 * m0[:, 0] + d01 * end[:, 0] + d11 * m1[:, 0]
        total += weight * np.maximum(w - lowest, 0.0) * dtau
    return float(np.sum(total))


def _slopes(piece: Array, step: Array) -> Array:
    """Derivatives (m, 2) by σ, of the parabolas through neighbours."""
    rate = np.diff(piece, axis=0) / step[:, None]
    before, after = step[:-1, None], step[1:, None]
    inner = (after * rate[:-1] + before * rate[1:]) / (before + after)
    first = 2.0 * rate[0] - inner[0]
    last = 2.0 * rate[-1] - inner[-1]
    return np.concatenate((first[None], inner, last[None]))

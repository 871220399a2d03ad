"""Platforms that explain measured impacts best, at given restitutions: kernels.

Each impact is u - ṡ = -ε(v - ṡ), with take-off u and landing v from times and s alone. For a given
ε its error is linear in the platform's coefficients c (M): rise + up·c + ε (fall + down·c).
"""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.compilation import entry, rare_kernel
from bouncing_disk_ros.measured.kernels.likelihood import solve

_ROUNDS = 6
_TURNS = 15
"""Of weights that fall with the squares of errors: values nearby come to the same minimum."""
_LEAST_PART = 1e-3
"""Of the mean error: smaller errors weigh no more."""
_NOTHING = 1e-300
_EQUATIONS = "float64[:, ::1], float64[:, ::1], float64[::1], float64[::1]"


@rare_kernel
def _stepped(
    slopes: NDArray[np.float64],
    rest: NDArray[np.float64],
    weights: NDArray[np.float64],
    values: NDArray[np.float64],
) -> None:
    """Move values (M) to the least weighted squares of errors rest (N) with slopes (N, M)."""
    n, m = slopes.shape
    h, x, sizes = np.zeros((m, m)), np.zeros(m), np.empty(m)
    for j in range(n):
        for i in range(m):
            side = weights[j] * slopes[j, i]
            x[i] -= side * rest[j]
            for k in range(i + 1):
                h[i, k] += side * slopes[j, k]
    for i in range(m):
        sizes[i] = sqrt(max(h[i, i], _NOTHING))
        x[i] /= sizes[i]
        for k in range(i + 1):
            h[i, k] /= sizes[i] * sizes[k]
    if solve(h, x):
        for i in range(m):
            values[i] += x[i] / sizes[i]


@entry(f"void({_EQUATIONS}, float64[::1], float64[::1], float64[:, ::1])")
def least_absolute(
    up: NDArray[np.float64],
    down: NDArray[np.float64],
    rise: NDArray[np.float64],
    fall: NDArray[np.float64],
    restitutions: NDArray[np.float64],
    costs: NDArray[np.float64],
    values: NDArray[np.float64],
) -> None:
    """Fill costs (K) with the least mean absolute errors, values (K, M) with the coefficients c.

    By weights that are one over the errors.
    """
    n, m = up.shape
    slopes, rest, weights = np.empty((n, m)), np.empty(n), np.empty(n)
    for k in range(restitutions.size):
        eps, found = restitutions[k], values[k]
        found[:] = 0.0
        for j in range(n):
            rest[j], weights[j] = rise[j] + eps * fall[j], 1.0
            for i in range(m):
                slopes[j, i] = up[j, i] + eps * down[j, i]
        for _ in range(_ROUNDS):
            _stepped(slopes, rest, weights, found)
            mean = 0.0
            for j in range(n):
                rest[j] = rise[j] + eps * fall[j]
                for i in range(m):
                    rest[j] += slopes[j, i] * found[i]
                mean += abs(rest[j])
            mean = max(mean / n, _NOTHING)
            for j in range(n):
                weights[j] = mean / max(abs(rest[j]), _LEAST_PART * mean)
        costs[k] = mean


@entry(f"void({_EQUATIONS}, float64, float64[:, ::1])")
def redescended(
    up: NDArray[np.float64],
    down: NDArray[np.float64],
    rise: NDArray[np.float64],
    fall: NDArray[np.float64],
    least: float,
    values: NDArray[np.float64],
) -> None:
    """Move values (K, 1 + M: ε and c) by weights that fall with the squares of errors.

    The errors count in their median, at least `least`; ε stays between 0 and 1.
    """
    n, m = up.shape
    slopes, rest, weights = np.empty((n, 1 + m)), np.empty(n), np.empty(n)
    for k in range(values.shape[0]):
        found = values[k]
        for _ in range(_TURNS):
            for j in range(n):
                rest[j], slopes[j, 0] = rise[j], fall[j]
                for i in range(m):
                    rest[j] += up[j, i] * found[1 + i]
                    slopes[j, 0] += down[j, i] * found[1 + i]
                    slopes[j, 1 + i] = up[j, i] + found[0] * down[j, i]
                rest[j] += found[0] * slopes[j, 0]
                weights[j] = abs(rest[j])
            scale = max(np.median(weights), least)
            for j in range(n):
                weights[j] = scale * scale / (scale * scale + rest[j] * rest[j])
            _stepped(slopes, rest, weights, found)
            found[0] = min(max(found[0], 0.0), 1.0)

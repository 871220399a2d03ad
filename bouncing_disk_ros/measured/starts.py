"""First values of a fit on a vibrating platform: for a given ε the equations are linear."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_RESTITUTIONS = np.linspace(0.02, 0.98, 33)
_ROUNDS = 6
_OFF = 0.02
"""Of a frequency: how far off others are tried."""
_HALVINGS = 4
"""Of the step to the best frequency: an eighth of a radian of the whole recording."""
_CHANCE = 0.01


def first_values(
    times: Array, frequency: float, gravity: float, phase: float | None = None, most: int = 4,
    told: NDArray[np.bool_] | None = None,
) -> list[Array]:  # fmt: skip
    """Likely parameters (ε, A, φ, ω, 0, 0), the best first.

    Each impact is u - ṡ = -ε(v - ṡ), with take-off u and landing v from times and s alone. The sum
    of absolute errors is minimised (weighted least squares), so some wrong times do not matter.
    `phase`: φ, if it is known. `told` (N - 2): which impacts have flights on both sides.
    """
    found = _fitted(times, frequency, gravity, phase, told)
    costs = [math.inf, *(cost for cost, _ in found), math.inf]
    lowest = [
        i - 1 for i in range(1, len(costs) - 1) if costs[i] <= min(costs[i - 1], costs[i + 1])
    ]
    chosen = sorted((found[i] for i in lowest), key=lambda pair: pair[0])
    return [p for _, p in chosen[:most]]


def other_frequency(
    times: Array, frequency: float, gravity: float, phase: float | None = None
) -> float | None:
    """A frequency, rad/s, that the times fit better than the given one; None: there is none.

    Tried are half, double, and all up to 2 % off, near enough for a turn of one rad in the whole
    recording. The errors of the equations have Laplace's distribution: twice the logarithm of the
    likelihood ratio is 2n times that of their mean sizes. Independent noise that is tried so often
    would exceed the threshold with a probability of 1 %. Errors of neighbours are not independent,
    and differ in size: the likelihood of the times has to confirm what is found.
    """
    step = 1.0 / (times[-1] - times[0])
    width = math.ceil(_OFF * frequency / step)
    tried = [frequency + step * k for k in range(-width, width + 1)]
    tried += [0.5 * frequency, 2.0 * frequency]

    def cost(w: float) -> float:
        return min(cost for cost, _ in _fitted(times, w, gravity, phase, None))

    given, best = cost(frequency), min(tried, key=cost)
    for _ in range(_HALVINGS):
        step *= 0.5
        best = min((best - step, best, best + step), key=cost)
    least = max(cost(best), 1e-300)
    evidence = 2.0 * (len(times) - 2) * math.log(max(given, least) / least)
    return float(best) if evidence > 2.0 * math.log(len(tried) / _CHANCE) else None


def _fitted(
    times: Array, frequency: float, gravity: float, phase: float | None,
    told: NDArray[np.bool_] | None,
) -> list[tuple[float, Array]]:  # fmt: skip
    """For each restitution the mean absolute error of the equations, and the parameters."""
    tm, tp = np.diff(times)[:-1], np.diff(times)[1:]
    s, d = _bases(times, frequency)
    up, down, here = np.diff(s)[:, 1:] / tp, np.diff(s)[:, :-1] / tm, d[:, 1:-1]
    used = np.ones(len(tm), bool) if told is None else told
    found = []
    for restitution in _RESTITUTIONS:
        rows = (up + restitution * down - (1.0 + restitution) * here).T[used]
        wanted = -0.5 * gravity * (tp - restitution * tm)[used]
        if phase is not None:
            towards = np.array([math.cos(phase), math.sin(phase)])
            one, cost = _robust(rows @ towards[:, None], wanted)
            size, angle = abs(float(one[0])), phase
        else:
            pair, cost = _robust(rows, wanted)
            size, angle = math.hypot(*pair), math.atan2(pair[1], pair[0])
        found.append((cost, np.array([restitution, size, angle, frequency, 0.0, 0.0])))
    return found


def _bases(times: Array, frequency: float) -> tuple[Array, Array]:
    """Position and velocity of platforms sin ωt and cos ωt, (2, N) each."""
    angle = frequency * times
    sine, cosine = np.sin(angle), np.cos(angle)
    return np.array([sine, cosine]), frequency * np.array([cosine, -sine])


def _robust(rows: Array, wanted: Array) -> tuple[Array, float]:
    """Least absolute errors by weights, and their mean."""
    weights: Array = np.ones(len(wanted))
    pair: Array = np.zeros(rows.shape[1])
    errors: Array = np.abs(wanted)
    for _ in range(_ROUNDS):
        root = np.sqrt(weights)
        found = np.linalg.lstsq(rows * root[:, None], wanted * root, rcond=1e-9)[0]
        pair = np.asarray(found, float)
        errors = np.abs(rows @ pair - wanted)
        weights = 1.0 / np.maximum(errors, 1e-3 * max(float(errors.mean()), 1e-300))
    return pair, float(errors.mean())

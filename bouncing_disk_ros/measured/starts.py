"""First values of a fit on a vibrating platform: for a given ε the equations are linear."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_RESTITUTIONS = np.linspace(0.02, 0.98, 33)
_ROUNDS = 6
_TURNS = 15
"""Of weights that fall with the squares of errors: values nearby come to the same minimum."""
_ROUNDING = 1e-14
"""Of velocities."""
_RIDGE = 1e-12
"""Beside 1: it bounds steps along values that the equations do not tell."""
_SAME = 1e-2
"""Parts by which values differ that have the same minimum."""
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

    Each impact is u - ṡ = -ε(v - ṡ), with take-off u and landing v from times and s alone. Flights
    across a contact or a false hit break some of these equations by far. So from the least absolute
    errors for each ε the weights of the equations fall with the squares of their errors. Of their
    ends and of the minima of the absolute errors, the least mean logarithm of errors is the best.
    `phase`: φ, if it is known. `told` (N - 2): which impacts have flights on both sides.
    """
    equations = _Equations(times, frequency, gravity, told)
    costs, values = _fitted(equations, phase)
    around = np.pad(costs, 1, constant_values=np.inf)
    lowest = values[costs <= np.minimum(around[:-2], around[2:])]
    errors, found = _redescended(equations, values, phase)
    errors = np.vstack([errors, np.abs(equations.errors(lowest, _towards(phase))[0])])
    found = np.vstack([found, lowest])
    scale = max(float(np.median(errors, axis=1).min()), _ROUNDING * equations.size)
    chosen: list[Array] = []
    for one in found[np.argsort(np.log(errors + scale).mean(axis=1), kind="stable")]:
        if all(np.abs(one - other).max() > _SAME * np.abs(other).max() for other in chosen):
            chosen.append(one)
    return [equations.parameters(one, phase) for one in chosen[:most]]


def other_frequency(
    times: Array, frequency: float, gravity: float, phase: float | None = None
) -> float | None:
    """A frequency, rad/s, that the times fit better than the given one; None: there is none.

    Tried are all up to 2 % off, near enough for a turn of one rad in the whole recording. The
    errors of the equations have Laplace's distribution: twice the logarithm of the likelihood ratio
    is 2n times that of their mean sizes. Independent noise that is tried so often would exceed the
    threshold with a probability of 1 %. Errors of neighbours are not independent, and differ in
    size: the likelihood of the times has to confirm what is found.
    """
    step = 1.0 / (times[-1] - times[0])
    width = math.ceil(_OFF * frequency / step)
    tried = [frequency + step * k for k in range(-width, width + 1)]

    def cost(w: float) -> float:
        return float(_fitted(_Equations(times, w, gravity, None), phase)[0].min())

    given, best = cost(frequency), min(tried, key=cost)
    for _ in range(_HALVINGS):
        step *= 0.5
        best = min((best - step, best, best + step), key=cost)
    least = max(cost(best), 1e-300)
    evidence = 2.0 * (len(times) - 2) * math.log(max(given, least) / least)
    return float(best) if evidence > 2.0 * math.log(len(tried) / _CHANCE) else None


class _Equations:
    """u - ṡ + ε(v - ṡ) of inner impacts, with the platform a sin ωt + b cos ωt.

    For a given ε they are linear in a and b.
    """

    def __init__(
        self, times: Array, frequency: float, gravity: float, told: NDArray[np.bool_] | None
    ) -> None:
        self.frequency, self.gravity = frequency, gravity
        used = np.ones(len(times) - 2, bool) if told is None or not told.any() else told
        before, after = np.diff(times)[:-1], np.diff(times)[1:]
        s, d = _bases(times, frequency)
        self._flights = before[used], after[used]
        here = d[:, 1:-1]
        self._up = (np.diff(s)[:, 1:] / after - here).T[used]
        self._down = (np.diff(s)[:, :-1] / before - here).T[used]

    @property
    def size(self) -> float:
        """Of their parts, m/s."""
        return self.gravity * float(np.mean(self._flights))

    def errors(self, values: Array, towards: Array) -> tuple[Array, Array]:
        """Errors (K, N - 2) at K values (ε, a, b), and their slopes by ε and along `towards`."""
        restitution = values[:, :1]
        up = values[:, 1:] @ self._up.T + 0.5 * self.gravity * self._flights[1]
        down = values[:, 1:] @ self._down.T - 0.5 * self.gravity * self._flights[0]
        along = self._up + restitution[:, :, None] * self._down
        return up + restitution * down, np.concatenate([down[:, :, None], along @ towards], axis=2)

    def parameters(self, one: Array, phase: float | None) -> Array:
        """ε, A, φ, ω, 0, 0 of (ε, a, b); `phase`: φ, if it is known."""
        size, angle = math.hypot(one[1], one[2]), math.atan2(one[2], one[1])
        angle = angle if phase is None else phase
        return np.array([one[0], size, angle, self.frequency, 0.0, 0.0])


def _fitted(equations: _Equations, phase: float | None) -> tuple[Array, Array]:
    """For each of K restitutions the least mean absolute error of the equations, and (ε, a, b)."""
    towards = _towards(phase)
    found = np.zeros((len(_RESTITUTIONS), 3))
    found[:, 0] = _RESTITUTIONS
    first, slopes = equations.errors(found, towards)
    along, weights = slopes[:, :, 1:], np.ones((len(found), 1))
    rest, place = first, np.zeros((len(found), along.shape[2], 1))
    for _ in range(_ROUNDS):
        place += _weighted(along, rest, weights)[:, :, None]
        rest = first + (along @ place)[:, :, 0]
        errors = np.abs(rest)
        mean = np.maximum(errors.mean(axis=1, keepdims=True), 1e-300)
        weights = mean / np.maximum(errors, 1e-3 * mean)
    found[:, 1:] = place[:, :, 0] @ towards.T
    return mean[:, 0], found


def _towards(phase: float | None) -> Array:
    """Directions of (a, b) that are left by a known phase, in columns."""
    return np.eye(2) if phase is None else np.array([[math.cos(phase)], [math.sin(phase)]])


def _redescended(equations: _Equations, values: Array, phase: float | None) -> tuple[Array, Array]:
    """Absolute errors (K, N - 2) and (ε, a, b), from K values nearby; ε stays between 0 and 1."""
    towards, found = _towards(phase), values.copy()
    least = _ROUNDING * equations.size
    for _ in range(_TURNS):
        rest, slopes = equations.errors(found, towards)
        scale = np.maximum(np.median(np.abs(rest), axis=1, keepdims=True), least)
        steps = _weighted(slopes, rest, scale**2 / (scale**2 + rest**2))
        found[:, 0] = np.clip(found[:, 0] + steps[:, 0], 0.0, 1.0)
        found[:, 1:] += steps[:, 1:] @ towards.T
    return np.abs(equations.errors(found, towards)[0]), found


def _weighted(slopes: Array, rest: Array, weights: Array) -> Array:
    """Steps (K, M) to the least weighted squares of errors (K, N) with slopes (K, N, M)."""
    sides = slopes * weights[:, :, None]
    matrices = np.swapaxes(slopes, 1, 2) @ sides
    sizes = np.sqrt(np.maximum(np.einsum("kii->ki", matrices), 1e-300))
    scaled = matrices / (sizes[:, :, None] * sizes[:, None, :]) + _RIDGE * np.eye(sizes.shape[1])
    pulls = np.einsum("knm,kn->km", sides, rest) / sizes
    return np.asarray(-np.linalg.solve(scaled, pulls[:, :, None])[:, :, 0] / sizes)


def _bases(times: Array, frequency: float) -> tuple[Array, Array]:
    """Position and velocity of platforms sin ωt and cos ωt, (2, N) each."""
    angle = frequency * times
    sine, cosine = np.sin(angle), np.cos(angle)
    return np.array([sine, cosine]), frequency * np.array([cosine, -sine])

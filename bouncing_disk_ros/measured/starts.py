"""First values of a fit on a vibrating platform: for a given ε the equations are linear."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.measured.kernels.linear_equations import least_absolute, redescended

Array = NDArray[np.float64]
_RESTITUTIONS = np.linspace(0.02, 0.98, 33)
_ROUNDING = 1e-14
"""Of velocities."""
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
    equations = _Equations(times, frequency, gravity, phase, told)
    costs, values = equations.fitted()
    around = np.pad(costs, 1, constant_values=np.inf)
    lowest = values[costs <= np.minimum(around[:-2], around[2:])]
    found = np.vstack([equations.redescended(values), lowest])
    errors = np.abs(equations.errors(found))
    scale = max(float(np.median(errors, axis=1).min()), equations.least)
    chosen: list[Array] = []
    for one in found[np.argsort(np.log(errors + scale).mean(axis=1), kind="stable")]:
        if all(np.abs(one - other).max() > _SAME * np.abs(other).max() for other in chosen):
            chosen.append(one)
    return [equations.parameters(one) for one in chosen[:most]]


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
        return float(_Equations(times, w, gravity, phase).fitted()[0].min())

    given, best = cost(frequency), min(tried, key=cost)
    for _ in range(_HALVINGS):
        step *= 0.5
        best = min((best - step, best, best + step), key=cost)
    least = max(cost(best), 1e-300)
    evidence = 2.0 * (len(times) - 2) * math.log(max(given, least) / least)
    return float(best) if evidence > 2.0 * math.log(len(tried) / _CHANCE) else None


class _Equations:
    """u - ṡ + ε(v - ṡ) of inner impacts, with the platform a sin ωt + b cos ωt.

    For a given ε they are linear in a and b. These are along one direction if `phase` is known.
    """

    def __init__(
        self, times: Array, frequency: float, gravity: float, phase: float | None,
        told: NDArray[np.bool_] | None = None,
    ) -> None:  # fmt: skip
        self.frequency, self.phase = frequency, phase
        self._towards = (
            np.eye(2) if phase is None else np.array([[math.cos(phase)], [math.sin(phase)]])
        )
        used = np.ones(len(times) - 2, bool) if told is None or not told.any() else told
        before, after = np.diff(times)[:-1], np.diff(times)[1:]
        s, d = _bases(times, frequency)
        here = d[:, 1:-1]
        up, down = np.diff(s)[:, 1:] / after - here, np.diff(s)[:, :-1] / before - here
        self._up, self._down = (
            np.ascontiguousarray(one.T[used] @ self._towards) for one in (up, down)
        )
        self._rise, self._fall = 0.5 * gravity * after[used], -0.5 * gravity * before[used]

    @property
    def least(self) -> float:
        """Rounding of the errors, m/s."""
        return _ROUNDING * float(np.mean(self._rise - self._fall))

    def fitted(self) -> tuple[Array, Array]:
        """For each of K restitutions the least mean absolute error, and (ε, a, b)."""
        count = len(_RESTITUTIONS)
        costs, found = np.empty(count), np.zeros((count, self._towards.shape[1]))
        least_absolute(self._up, self._down, self._rise, self._fall, _RESTITUTIONS, costs, found)
        return costs, np.column_stack([_RESTITUTIONS, found @ self._towards.T])

    def redescended(self, values: Array) -> Array:
        """(ε, a, b) at the minima near K values; ε stays between 0 and 1."""
        found = np.column_stack([values[:, :1], values[:, 1:] @ self._towards])
        redescended(self._up, self._down, self._rise, self._fall, self.least, found)
        return np.column_stack([found[:, :1], found[:, 1:] @ self._towards.T])

    def errors(self, values: Array) -> Array:
        """Errors (K, N) at K values (ε, a, b), m/s."""
        along = values[:, 1:] @ self._towards
        up = along @ self._up.T + self._rise
        return np.asarray(up + values[:, :1] * (along @ self._down.T + self._fall))

    def parameters(self, one: Array) -> Array:
        """ε, A, φ, ω, 0, 0 of (ε, a, b)."""
        size, angle = math.hypot(one[1], one[2]), math.atan2(one[2], one[1])
        angle = angle if self.phase is None else self.phase
        return np.array([one[0], size, angle, self.frequency, 0.0, 0.0])


def _bases(times: Array, frequency: float) -> tuple[Array, Array]:
    """Position and velocity of platforms sin ωt and cos ωt, (2, N) each."""
    angle = frequency * times
    sine, cosine = np.sin(angle), np.cos(angle)
    return np.array([sine, cosine]), frequency * np.array([cosine, -sine])

"""The systems of equations behind branches of orbits and their curves in (Γ, ε).

Unknowns are the n impact times; for a graze the time at which a flight touches; then the
parameters that are free. All derivatives are exact (complex step, see `impact_equations`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from bouncing_disk_ros.analysis.dynamics.impact_equations import (
    STEP,
    Array,
    Flights,
    Values,
    flights,
    touching,
    trace,
)

PARAMETERS = ("axial_forcing", "restitution")
_CIRCLE = 16
_RADIUS = 0.02


class CurveKind(StrEnum):
    """Where a periodic orbit changes."""

    FOLD = "fold"  # it meets another orbit of its kind, multiplier 1
    DOUBLING = "doubling"  # multiplier −1
    GRAZE = "graze"  # a flight becomes tangent to the platform
    CONTACT_ONSET = "contact onset"  # of an orbit with contact: a chatter that is just complete


@dataclass(frozen=True)
class OrbitSystem:
    """Equations of an orbit of `impacts` impacts in `cycles` periods, and of its special kinds."""

    impacts: int
    cycles: int
    kind: CurveKind | None = None  # None: any orbit
    flight: int = 0  # the one that touches, of a graze
    free: tuple[str, ...] = PARAMETERS
    fixed: tuple[float, float] = (math.nan, math.nan)  # Γ and ε where they are not free

    @property
    def touches(self) -> int:
        """How many of the unknowns are times of a touch."""
        return int(self.kind is CurveKind.GRAZE)

    def split(self, unknowns: Values) -> tuple[Values, Values, Values, Values]:
        """Times (…, n), time of the touch (…, 0 or 1), Γ and ε (…, 1) of unknowns (…, N)."""
        n, m = self.impacts, self.impacts + self.touches
        columns, place = [], m
        for name, value in zip(PARAMETERS, self.fixed, strict=True):
            if name in self.free:
                columns.append(unknowns[..., place : place + 1])
                place += 1
            else:
                columns.append(np.full_like(unknowns[..., :1], value))
        return unknowns[..., :n], unknowns[..., n:m], columns[0], columns[1]

    def parameters(self, unknowns: Array) -> tuple[float, float]:
        """Γ and ε."""
        _, _, forcing, restitution = self.split(unknowns)
        return float(forcing[0]), float(restitution[0])

    def values(self, unknowns: Values) -> Values:
        """Residuals (…, m) of unknowns (…, N), complex or not."""
        times, touch, forcing, restitution = self.split(unknowns)
        found = flights(times, self.cycles, forcing, restitution)
        extra: list[Values] = []
        if self.kind in (CurveKind.FOLD, CurveKind.DOUBLING):
            size, sign = self._trace(found, times, forcing, restitution)
            extra = [size - sign] if self.kind is CurveKind.FOLD else [size + sign]
        elif self.kind is CurveKind.GRAZE:
            extra = list(touching(found, times, forcing, self.flight, touch[..., 0]))
        return np.concatenate((found.defect, *(one[..., None] for one in extra)), axis=-1)

    def __call__(self, unknowns: Array) -> tuple[Array, Array]:
        """Residuals (m,) and their derivatives (m, N)."""
        batch = unknowns + 1j * STEP * np.eye(len(unknowns))
        found = self.values(batch)
        return found[0].real, np.ascontiguousarray((found.imag / STEP).T)

    def _trace(
        self, found: Flights, times: Values, forcing: Values, restitution: Values
    ) -> tuple[Values, Values]:
        """Trace, and 1 + ε²ⁿ: they are equal at a fold, opposite at a doubling."""
        size = trace(found, times, forcing, restitution)
        return size, 1.0 + restitution[..., 0] ** (2 * self.impacts)

    def multiplier_defects(self, unknowns: Array) -> tuple[float, float]:
        """1 + T + ε²ⁿ, which is 0 at a doubling, and 1 − T + ε²ⁿ, which is 0 at a fold."""
        times, _, forcing, restitution = self.split(unknowns)
        found = flights(times, self.cycles, forcing, restitution)
        size, sign = self._trace(found, times, forcing, restitution)
        return float(sign + size), float(sign - size)


def defect_of(times: Values, cycles: int, forcing: float, restitution: float) -> Values:
    """The equations of an orbit alone, at (…, n) times."""
    given = np.full_like(times[..., :1], forcing), np.full_like(times[..., :1], restitution)
    return flights(times, cycles, *given).defect


def fold_coefficient(
    times: Array, cycles: int, forcing: float, restitution: float, towards: Array
) -> float:
    """½ pᵀF″(q, q) at a fold, q and p the null vectors of F′: it is 0 at a cusp.

    q has the sense of `towards`.
    """

    def function(t: Values) -> Values:
        return defect_of(t, cycles, forcing, restitution)

    left, right = _null_vectors(function, times, towards)
    return float(left @ _taylor(function, times, right)[2])


def flip_coefficient(times: Array, cycles: int, forcing: float, restitution: float) -> float:
    """Cubic coefficient of the orbit of 2n impacts at a doubling of that of n; 0: generalised flip.

    p·[F‴(q, q, q)/6 + F″(q, h)] of F of the doubled orbit, with q, p the null vectors, which change
    sign from one repetition to the next, and h = −½ F′⁻¹F″(q, q), which does not. Where it changes
    sign the fold of 2n impacts begins on the curve. At most 0: the doubled orbit is stable.
    """

    def doubled(t: Values) -> Values:
        return defect_of(t, 2 * cycles, forcing, restitution)

    twice = np.concatenate((times, times + math.tau * cycles))
    left, right = _null_vectors(doubled, twice, np.arange(len(twice), dtype=float))
    along = _taylor(doubled, twice, right)
    bordered = _bordered(_jacobian(doubled, twice), left, right)
    shift = np.linalg.solve(bordered, np.append(-along[2], 0.0))[:-1]
    # F″(q, h) by polarisation: the quadratic terms along q ± h
    mixed = _taylor(doubled, twice, right + shift)[2] - _taylor(doubled, twice, right - shift)[2]
    return float(left @ (along[3] + 0.5 * mixed))


def _bordered(matrix: Array, left: Array, right: Array) -> Array:
    return np.block([[matrix, left[:, None]], [right[None, :], np.zeros((1, 1))]])


def _jacobian(function: Callable[[Values], Values], place: Array) -> Array:
    found = function(place + 1j * STEP * np.eye(len(place)))
    return np.ascontiguousarray((found.imag / STEP).T)


def _null_vectors(
    function: Callable[[Values], Values], place: Array, towards: Array
) -> tuple[Array, Array]:
    """Left and right null vector: the right one towards a direction, the left one to fit.

    The determinant of the bordered matrix is never 0, so its sign fixes that of the left one.
    """
    matrix = _jacobian(function, place)
    left, _, right = np.linalg.svd(matrix)
    p, q = left[:, -1], right[-1]
    q = q if q @ towards > 0.0 else -q
    p = p if np.linalg.det(_bordered(matrix, p, q)) < 0.0 else -p
    return np.asarray(p), np.asarray(q)


def _taylor(function: Callable[[Values], Values], place: Array, along: Array) -> Array:
    """Taylor coefficients (4, n) of a function along a direction, by Cauchy's integral."""
    angles = np.exp(2j * math.pi * np.arange(_CIRCLE) / _CIRCLE)
    found = function(place + _RADIUS * angles[:, None] * along)
    rows = np.fft.fft(found, axis=0)[:4].real / _CIRCLE
    return np.asarray(rows / _RADIUS ** np.arange(4)[:, None])

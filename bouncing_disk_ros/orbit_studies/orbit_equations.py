"""Periodic orbits as smooth equations of their impact times, and the systems of their curves.

Between two impacts the flight is fixed by their times alone, for the gap is 0 at both; so an orbit
of n impacts in k periods is n times with n equations, the impact law v⁺ = (1 + ε)ṡ − ε v⁻ at each.
Unlike the map these equations have no first root to search for: they stay smooth where a flight is
tangent to the platform and beyond, where the orbit is no motion of a disk any more. Whether it is
one is said by `OrbitSystem.is_motion`. They are analytic: values with an imaginary part of `STEP`
give exact derivatives (complex step), and whole batches are computed at once.

Time is phase, lengths are in πg/ω², velocities in πg/ω (gravity is 1/π).

Unknowns of a system are the n impact times; for a graze the time at which a flight touches; then
the parameters that are free. All derivatives are exact (complex step).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.axial_map import GRAVITY
from bouncing_disk_ros.maps.orbit_kernels import clearance_of

Array = NDArray[np.float64]
Values = NDArray[Any]  # float64 or complex128

STEP = 1e-30
"""Imaginary part that gives derivatives: no difference is taken, so none is rounded."""
TOUCHES = 1e-12
"""A gap (πg/ω²) above the negative of it counts as not negative."""


class Flights(NamedTuple):
    """What follows from impact times; all (…, n), flight i begins at impact i."""

    defect: Values  # of the impact law, velocity: 0 on an orbit
    duration: Values  # rad
    launch: Values  # absolute velocity after impact i
    before: Values  # w_A before impact i
    after: Values  # w_A before impact i + 1


def _next(values: Values) -> Values:
    """Of each impact (…, n) the value of the one after it, the first after the last."""
    return np.concatenate((values[..., 1:], values[..., :1]), axis=-1)


def flights(times: Values, cycles: int, axial_forcing: Values, restitution: Values) -> Flights:
    """The flights between impacts at `times` (…, n), rad; Γ and ε (…, 1)."""
    following = np.concatenate((times[..., 1:], times[..., :1] + math.tau * cycles), axis=-1)
    duration = following - times
    height, speed = axial_forcing * np.sin(times), axial_forcing * np.cos(times)
    launch = (_next(height) - height) / duration + 0.5 * GRAVITY * duration
    arrived = launch - GRAVITY * duration
    arrival = np.concatenate((arrived[..., -1:], arrived[..., :-1]), axis=-1)
    defect = launch - (1.0 + restitution) * speed + restitution * arrival
    before = arrival - speed
    return Flights(defect, duration, launch, before, _next(before))


def trace(
    found: Flights, times: Values, axial_forcing: Values, restitution: Values
) -> NDArray[Any]:
    """Trace (…) of the derivatives of (τ, w) over one repetition, by map_tangent's formulas."""
    sine, cosine = np.sin(times), np.cos(times)
    later, cosine1 = _next(sine), _next(cosine)
    w1, d = found.after, found.duration
    bend = axial_forcing * later - GRAVITY
    by_phase = axial_forcing * (cosine1 - cosine + d * sine) / w1
    by_speed = -d / w1
    a, b = 1.0 + by_phase, -restitution * by_speed
    c = axial_forcing * (later - sine) + bend * by_phase
    e = -restitution * (1.0 + bend * by_speed)
    p, q, r, s = a[..., 0], b[..., 0], c[..., 0], e[..., 0]
    for i in range(1, times.shape[-1]):
        p, r = a[..., i] * p + b[..., i] * r, c[..., i] * p + e[..., i] * r
        q, s = a[..., i] * q + b[..., i] * s, c[..., i] * q + e[..., i] * s
    return np.asarray(p + s)


def touching(
    found: Flights, times: Values, axial_forcing: Values, flight: int, touch: Values
) -> tuple[Values, Values]:
    """Gap and its derivative (…) at the time `touch` (…) of one flight: both are 0 at a graze."""
    since = touch - times[..., flight]
    forcing = axial_forcing[..., 0]
    launch, height = found.launch[..., flight], forcing * np.sin(times[..., flight])
    gap = height + launch * since - 0.5 * GRAVITY * since * since - forcing * np.sin(touch)
    return gap, launch - GRAVITY * since - forcing * np.cos(touch)


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

    def flights(self, unknowns: Values) -> Flights:
        """The flights between the impacts."""
        times, _, forcing, restitution = self.split(unknowns)
        return flights(times, self.cycles, forcing, restitution)

    def clearances(self, unknowns: Array) -> Array:
        """Least minimum of the gap inside each flight, when it is (rad after its begin): (n, 2).

        inf and nan: it has none. A minimum < 0: not a flight.
        """
        found, place = self.flights(unknowns), self.parameters(unknowns)
        return np.array([
            clearance_of(float(tau) % math.tau, float(w), float(d), *place)
            for tau, w, d in zip(self.split(unknowns)[0], found.before, found.duration, strict=True)
        ])  # fmt: skip

    def is_motion(self, unknowns: Array) -> bool:
        """Whether a solution is a motion of a disk: hits from above, and no flight is cut short."""
        found = self.flights(unknowns)
        if np.any(found.duration <= 0.0) or np.any(found.before >= 0.0):
            return False
        return bool(np.all(self.clearances(unknowns)[:, 0] > -TOUCHES))

    def values(self, unknowns: Values) -> Values:
        """Residuals (…, m) of unknowns (…, N), complex or not."""
        times, touch, forcing, restitution = self.split(unknowns)
        found = self.flights(unknowns)
        extra: list[Values] = []
        if self.kind in (CurveKind.FOLD, CurveKind.DOUBLING):
            size, sign = self._trace(found, times, forcing, restitution)
            extra = [size - sign] if self.kind is CurveKind.FOLD else [size + sign]
        elif self.kind is CurveKind.GRAZE:
            extra = list(touching(found, times, forcing, self.flight, touch[..., 0]))
        return np.concatenate((found.defect, *(one[..., None] for one in extra)), axis=-1)

    def __call__(self, unknowns: Array) -> tuple[Array, Array]:
        """Residuals (m,) and their derivatives (m, N)."""
        return _with_derivatives(self.values, unknowns)

    def _trace(
        self, found: Flights, times: Values, forcing: Values, restitution: Values
    ) -> tuple[Values, Values]:
        """Trace, and 1 + ε²ⁿ: they are equal at a fold, opposite at a doubling."""
        size = trace(found, times, forcing, restitution)
        return size, 1.0 + restitution[..., 0] ** (2 * self.impacts)

    def multiplier_defects(self, unknowns: Array) -> tuple[float, float]:
        """1 + T + ε²ⁿ, which is 0 at a doubling, and 1 − T + ε²ⁿ, which is 0 at a fold."""
        times, _, forcing, restitution = self.split(unknowns)
        size, sign = self._trace(self.flights(unknowns), times, forcing, restitution)
        return float(sign + size), float(sign - size)


def fold_coefficient(
    times: Array, cycles: int, forcing: float, restitution: float, towards: Array
) -> float:
    """½ pᵀF″(q, q) at a fold, q and p the null vectors of F′: it is 0 at a cusp.

    q has the sense of `towards`.
    """
    function = OrbitSystem(len(times), cycles, free=(), fixed=(forcing, restitution)).values
    left, right = _null_vectors(function, times, towards)
    return float(left @ _taylor(function, times, right)[2])


def flip_coefficient(times: Array, cycles: int, forcing: float, restitution: float) -> float:
    """Cubic coefficient of the orbit of 2n impacts at a doubling of that of n; 0: generalised flip.

    p·[F‴(q, q, q)/6 + F″(q, h)] of F of the doubled orbit, with q, p the null vectors, which change
    sign from one repetition to the next, and h = −½ F′⁻¹F″(q, q), which does not. Where it changes
    sign the fold of 2n impacts begins on the curve. At most 0: the doubled orbit is stable.
    """
    fixed = forcing, restitution
    doubled = OrbitSystem(2 * len(times), 2 * cycles, free=(), fixed=fixed).values
    twice = np.concatenate((times, times + math.tau * cycles))
    left, right = _null_vectors(doubled, twice, np.arange(len(twice), dtype=float))
    along = _taylor(doubled, twice, right)
    bordered = _bordered(_with_derivatives(doubled, twice)[1], left, right)
    shift = np.linalg.solve(bordered, np.append(-along[2], 0.0))[:-1]
    # F″(q, h) by polarisation: the quadratic terms along q ± h
    mixed = _taylor(doubled, twice, right + shift)[2] - _taylor(doubled, twice, right - shift)[2]
    return float(left @ (along[3] + 0.5 * mixed))


def _bordered(matrix: Array, left: Array, right: Array) -> Array:
    return np.block([[matrix, left[:, None]], [right[None, :], np.zeros((1, 1))]])


def _with_derivatives(function: Callable[[Values], Values], place: Array) -> tuple[Array, Array]:
    """Values (m,) of a function at a place (n,), and its derivatives (m, n), by complex steps."""
    found = function(place + 1j * STEP * np.eye(len(place)))
    return found[0].real, np.ascontiguousarray((found.imag / STEP).T)


def _null_vectors(
    function: Callable[[Values], Values], place: Array, towards: Array
) -> tuple[Array, Array]:
    """Left and right null vector: the right one towards a direction, the left one to fit.

    The determinant of the bordered matrix is never 0, so its sign fixes that of the left one.
    """
    matrix = _with_derivatives(function, place)[1]
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

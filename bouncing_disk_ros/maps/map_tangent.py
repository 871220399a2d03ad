"""Derivatives of the next-collision map along orbits, and how far they carry roundings.

`axial_map.flight_tangent` has those of one flight. The determinant of one step is ε²w/w₁, so that
of n impacts on a periodic orbit is ε²ⁿ. What follows a complete chatter does not depend on τ and w:
there all derivatives by them are 0.
"""

from __future__ import annotations

import math

import numpy as np
from numba import types
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import TWO_PI
from bouncing_disk_ros.core.compilation import entry, kernel
from bouncing_disk_ros.core.platform import Record
from bouncing_disk_ros.maps.axial_map import (
    MAP_CONTACT,
    MAP_REST,
    Tangent,
    flight_tangent,
    next_impact,
)

_FLOAT = types.float64
_MATRIX = types.Array(_FLOAT, 2, "C")


@entry(types.void(_MATRIX, _FLOAT, _FLOAT, types.Array(_FLOAT, 3, "C")))
def flight_tangents(flights: Record, forcing: float, restitution: float, out: Record) -> None:
    """Derivatives of each flight: of flights (n, 4), τ, w, delay and w₁, into out (n, 2, 2).

    Rows of a matrix: τ₁, w₁; columns: by τ, by w.
    """
    for i in range(len(flights)):
        tau, w, delay, w1 = flights[i, 0], flights[i, 1], flights[i, 2], flights[i, 3]
        t = flight_tangent(tau, w, delay, w1, forcing, restitution)
        out[i, 0, 0], out[i, 0, 1], out[i, 1, 0], out[i, 1, 1] = t[0], t[1], t[2], t[3]


@entry(types.int64(_FLOAT, _FLOAT, _FLOAT, _FLOAT, types.int64, _MATRIX, _MATRIX))
def axial_tangent(
    tau: float,
    w: float,
    forcing: float,
    restitution: float,
    impacts: int,
    states: Record,
    tangent: Record,
) -> int:
    """Follow an orbit with its derivatives; returns how often it was in contact, −1 for rest.

    states (impacts + 1, 3): τ, w and the delay since the impact before, the start first. tangent
    (2, 4): derivatives of the last (τ, w) by the first τ and w, by Γ and by ε; those by Γ and ε are
    without meaning after contact.
    """
    a, b, c, e = 1.0, 0.0, 0.0, 1.0
    fa = fb = ra = rb = 0.0
    contacts = 0
    states[0] = (tau, w, 0.0)
    for i in range(impacts):
        kind, tau1, w1, d = next_impact(tau, w, forcing, restitution)
        if kind == MAP_REST:
            return -1
        if kind == MAP_CONTACT:
            contacts += 1
            a = b = c = e = fa = fb = ra = rb = 0.0
        else:
            t = flight_tangent(tau, w, d, w1, forcing, restitution)
            a, c = t[0] * a + t[1] * c, t[2] * a + t[3] * c
            b, e = t[0] * b + t[1] * e, t[2] * b + t[3] * e
            fa, fb = t[0] * fa + t[1] * fb + t[4], t[2] * fa + t[3] * fb + t[5]
            ra, rb = t[0] * ra + t[1] * rb + t[6], t[2] * ra + t[3] * rb + t[7]
        tau, w = tau1, w1
        states[i + 1] = (tau, w, d)
    tangent[0] = (a, b, fa, ra)
    tangent[1] = (c, e, fb, rb)
    return contacts


@entry(types.float64[::1](types.Array(_FLOAT, 3, "C")))
def log_growth(matrices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Logarithms of the growth of a small error by each of the matrices in turn, shape (n,)."""
    growth = np.empty(len(matrices))
    x, y = 1.0, 0.0
    for i in range(len(matrices)):
        m = matrices[i]
        x, y = m[0, 0] * x + m[0, 1] * y, m[1, 0] * x + m[1, 1] * y
        size = math.hypot(x, y)
        if size == 0.0:
            growth[i:] = -math.inf
            return growth
        growth[i] = math.log(size)
        x, y = x / size, y / size
    return growth


# ------------------------------------------------------------------------------------------------
# How far roundings carry an orbit of the map: the one test of whether they decide a result.
#
# Each impact adds an error of the size of a rounding to τ and w, and the next flight changes it as
# it changes any small change. Error and flight are those of a linear system: the covariance P of
# (τ, w) goes over to M P Mᵀ + r², M the derivatives above and r the rounding of one
# impact.


Covariance = tuple[float, float, float]  # of τ and τ, τ and w, w and w

ROUNDING = 1e-15
"""Error of τ and w that each impact adds: some roundings of numbers up to 2π. Longer flights and
faster impacts are larger numbers, rounded as such."""
LARGEST_ERROR = 1e-3
"""An orbit is known while its error stays below this: attractors are of the order of 1, and an
error that has come so far passes 1 within a few impacts."""
_ALL = 1.0  # an error of this size says nothing any more, and grows no further


@kernel
def rounded(delay: float, w: float) -> Covariance:
    """The error that one impact adds after a flight of this delay (rad), with this w_A (πg/ω)."""
    size = ROUNDING * max(1.0, delay / TWO_PI, abs(w))
    return size * size, 0.0, size * size


@kernel
def carried(p: Covariance, t: Tangent, delay: float, w: float) -> Covariance:
    """The error after a flight with derivatives t, that lasts `delay` and ends with w_A = w."""
    xx, xy, yy = p
    a, b = t[0] * xx + t[1] * xy, t[0] * xy + t[1] * yy
    c, d = t[2] * xx + t[3] * xy, t[2] * xy + t[3] * yy
    more, _, _ = rounded(delay, w)
    xx, xy, yy = a * t[0] + b * t[1] + more, a * t[2] + b * t[3], c * t[2] + d * t[3] + more
    part = min(1.0, _ALL / (xx + yy))
    return part * xx, part * xy, part * yy


@kernel
def error_size(p: Covariance) -> float:
    """Size of an error: of τ (rad) and w (πg/ω) together."""
    return math.sqrt(p[0] + p[2])


@entry(_FLOAT(types.Array(_FLOAT, 2, "C"), _FLOAT, _FLOAT))
def largest_error(flights: Record, forcing: float, restitution: float) -> float:
    """The largest size of the error along an orbit of so many flights that begins without one.

    flights (n, 4): τ, w, delay and the next impact's w.
    """
    p = rounded(0.0, 0.0)
    largest = error_size(p)
    for i in range(len(flights)):
        tau, w, delay, w1 = flights[i, 0], flights[i, 1], flights[i, 2], flights[i, 3]
        p = carried(p, flight_tangent(tau, w, delay, w1, forcing, restitution), delay, w1)
        largest = max(largest, error_size(p))
    return largest

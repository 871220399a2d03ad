"""How far roundings carry an orbit of the map: the one test of whether they decide a result.

Each impact adds an error of the size of a rounding to τ and w, and the next flight changes it as it
changes any small change. Error and flight are those of a linear system: the covariance P of (τ, w)
goes over to M P Mᵀ + r², M the derivatives of `map_tangent` and r the rounding of one impact.
"""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, entry, kernel
from bouncing_disk_ros.core.platform import Record
from bouncing_disk_ros.maps.map_tangent import Tangent, flight_tangent

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


_FLOAT = types.float64


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

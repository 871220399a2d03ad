"""Initial conditions of the next-collision map, spread over a window of its plane."""

from __future__ import annotations

import math

from bouncing_disk_ros.analysis.dynamics.next_collision import MapState
from bouncing_disk_ros.errors import InputError

_PLASTIC = 1.324717957244746
"""The real root of x³ = x + 1."""


def spread_starts(count: int, velocity_begin: float) -> list[MapState]:
    """States spread evenly over τ ∈ [0, 2π), w_A ∈ (velocity_begin, 0), without slip (w_T = 0).

    The points {½ + k/p}, {½ + k/p²} of the unit square with the plastic number p (M. Roberts,
    2018): of few as of many no two are close, and more starts begin with the same ones. Velocities
    in units of πg/ω. Raises InputError.
    """
    if count < 1:
        raise InputError("starts", count, "a whole number >= 1")
    if not -math.inf < velocity_begin < 0.0:
        raise InputError("velocity_begin", velocity_begin, "less than 0", "The window is empty.")
    found = []
    for k in range(count):
        x, y = (0.5 + k / _PLASTIC) % 1.0, (0.5 + k / _PLASTIC**2) % 1.0
        found.append(MapState(math.tau * x, velocity_begin * (1.0 - y)))
    return found

"""Distributions of statistics: the normal one, Student's t and χ², of whole degrees of freedom.

Closed forms of Abramowitz and Stegun, "Handbook of mathematical functions" (1964), 26.4 and 26.7.
SciPy has them too, and takes half a second to load.
"""

from __future__ import annotations

import math
from functools import cache
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
normal_quantile = NormalDist().inv_cdf
_BISECTIONS = 60


def normal(x: float) -> float:
    """Probability of a normal number below x."""
    return 0.5 * math.erfc(-x * math.sqrt(0.5))


@cache
def _coefficients(degrees: int) -> Array:
    """Ratios of neighbours in the sums of 26.7.3 (odd) and 26.7.4 (even), after the first term."""
    k = np.arange(1, (degrees - degrees % 2) // 2)
    return np.asarray(2.0 * k / (2.0 * k + 1.0) if degrees % 2 else (2.0 * k - 1.0) / (2.0 * k))


def t_probability(degrees: int, x: float) -> float:
    """Probability of a number below x, of Student's t with 1 degree of freedom or more."""
    angle = math.atan2(x, math.sqrt(degrees))
    cosine, sine = math.cos(angle), math.sin(angle)
    terms = 1.0 + float(np.cumprod(cosine**2 * _coefficients(degrees)).sum())
    if degrees % 2:
        return 0.5 + (angle + (sine * cosine * terms if degrees > 1 else 0.0)) / math.pi
    return 0.5 + 0.5 * sine * terms


def t_quantile(free: float) -> float:
    """97.5 % of Student's t with `free` degrees of freedom, at least 1.

    Between whole numbers it is linear in 1/free, which is a little too wide.
    """
    low = math.floor(free)
    one, other = _t_quantile(low), _t_quantile(low + 1)
    return one + (other - one) * (low + 1) * (1.0 - low / free)


@cache
def _t_quantile(degrees: int) -> float:
    """26.7.5, an expansion in 1/degrees, and Newton's steps from there."""
    if degrees < 3:
        return math.tan(0.475 * math.pi) if degrees < 2 else 0.95 * math.sqrt(2.0 / (1.0 - 0.95**2))
    z = normal_quantile(0.975)
    x = (
        z
        + (z**3 + z) / (4.0 * degrees)
        + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * degrees**2)
    )
    size = math.lgamma(0.5 * degrees + 0.5) - math.lgamma(0.5 * degrees)
    for _ in range(4):
        density = math.exp(size - 0.5 * (degrees + 1) * math.log1p(x * x / degrees))
        density /= math.sqrt(math.pi * degrees)
        x -= (t_probability(degrees, x) - 0.975) / density
    return x


def chi_square_quantile(degrees: int, above: float) -> float:
    """Where χ² is larger with the probability `above`, by bisection."""
    powers = np.arange(0.5 * (degrees % 2), 0.5 * degrees)
    logs = np.array([math.lgamma(power + 1.0) for power in powers])
    low, high = 0.0, 2.0 * degrees - 4.0 * math.log(above)  # Laurent and Massart (2000), rounded up
    for _ in range(_BISECTIONS):
        half = 0.25 * (low + high)
        tail = float(np.exp(powers * math.log(half) - half - logs).sum())
        tail += math.erfc(math.sqrt(half)) if degrees % 2 else 0.0
        low, high = (2.0 * half, high) if tail > above else (low, 2.0 * half)
    return 0.5 * (low + high)

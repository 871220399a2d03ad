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
    """97.5 % of Student's t with `free` degrees of freedom, at least 1; to 0.13 %.

    Below 3 it is the exact one of 1 or 2, the next lower number. Source: Abramowitz, Stegun 26.7.5.
    """
    if free < 3.0:
        return math.tan(0.475 * math.pi) if free < 2.0 else 0.95 * math.sqrt(2.0 / (1.0 - 0.95**2))
    z = normal_quantile(0.975)
    return (
        z
        + (z**3 + z) / (4.0 * free)
        + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * free**2)
        + (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / (384.0 * free**3)
        + (79.0 * z**9 + 776.0 * z**7 + 1482.0 * z**5 - 1920.0 * z**3 - 945.0 * z)
        / (92160.0 * free**4)
    )


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

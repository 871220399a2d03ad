"""Quantile of Student's t, for intervals of 95 % from few values."""

from __future__ import annotations

import math
from statistics import NormalDist


def student(free: float) -> float:
    """97.5 % of Student's t with `free` degrees of freedom, at least 1; to 0.13 %.

    Below 3 it is the exact one of 1 or 2, the next lower number. Source: Abramowitz, Stegun 26.7.5.
    """
    if free < 3.0:
        return math.tan(0.475 * math.pi) if free < 2.0 else 0.95 * math.sqrt(2.0 / (1.0 - 0.95**2))
    z = NormalDist().inv_cdf(0.975)
    return (
        z
        + (z**3 + z) / (4.0 * free)
        + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * free**2)
        + (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / (384.0 * free**3)
        + (79.0 * z**9 + 776.0 * z**7 + 1482.0 * z**5 - 1920.0 * z**3 - 945.0 * z)
        / (92160.0 * free**4)
    )

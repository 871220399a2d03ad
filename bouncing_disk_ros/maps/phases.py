"""Differences of phases."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def wrap_to_pi(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same angle in [−π, π): the shortest way from one phase to another."""
    return np.mod(angle + math.pi, math.tau) - math.pi

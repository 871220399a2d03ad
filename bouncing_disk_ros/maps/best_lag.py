"""The phase lag that turns the disk fastest on a given axial attractor (paper, eq. 4 and below).

The axial part of an attractor does not depend on θ, so its impacts are found once; the mean speed
is then a function of θ alone.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind
from bouncing_disk_ros.maps.settled_speed import settled_speed
from bouncing_disk_ros.scalar_search import golden_section

if TYPE_CHECKING:
    from bouncing_disk_ros.maps.next_collision import NextCollisionMap

LAGS = 48
"""Phase lags of the first look around the circle."""
WIDTH = 1e-9
"""The bracket of the best phase lag is closed to this, rad."""


class BestLag(NamedTuple):
    """Where the mean speed is largest; nan without rotation."""

    phase_lag: float  # θ, rad, in [−π, π]
    mean_speed: float  # mean of α̇ in time there, ωΦ


def best_lag(found: Attractor, section: NextCollisionMap) -> BestLag:
    """Phase lag with the largest mean speed: a search around the circle, then a golden section.

    A change of θ by half a turn changes the sign of the speed, so the largest and the most negative
    speed have the same magnitude. For the period-1 orbit it is −τ_imp, where the speed is ωΦ.

    >>> section = NextCollisionMap(0.45, 0.5, angular_forcing=100.0)
    >>> best_lag(find_attractors(section, [(0.7, -1.3)]).found[0], section)
    """
    if found.kind is AttractorKind.REST or math.isinf(section.angular_forcing):
        return BestLag(math.nan, math.nan)

    def speed(lag: float) -> float:
        return settled_speed(found, replace(section, phase_lag=lag))

    lags = np.linspace(-math.pi, math.pi, LAGS, endpoint=False)
    best = float(lags[int(np.argmax([speed(float(lag)) for lag in lags]))])
    lag, most = golden_section(speed, best - math.tau / LAGS, best + math.tau / LAGS, WIDTH)
    return BestLag(math.remainder(lag, math.tau), most)

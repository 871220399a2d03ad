"""The mean speed that friction brings the disk to on an attractor of the next-collision map.

The speed after one repetition of the axial part does not fall as the speed before it grows, and
grows no faster: friction alone changes it. So the change in one repetition falls as the speed
grows, and the speed that repeats is found by halving, however weak friction is; iterated, it takes
as many impacts as Γ_T. All starts settle on the same speed, unless the changes by impacts that
slip cancel each other exactly: then speeds of an interval repeat, and the nearest to that of the
start is meant.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.dynamics.attractors import Attractor, AttractorKind, Attractors
from bouncing_disk_ros.analysis.dynamics.next_collision import NextCollisionMap
from bouncing_disk_ros.collision_map.lyapunov_and_speed import (
    MEAN_PER_TIME,
    MEASURED,
    measure_attractor,
)

IMPACTS = 6_000
"""Impacts that stand for one repetition of an orbit that does not repeat."""


def repeated_speed(repetition: Callable[[float], float], start: float = 0.0) -> float:
    """The speed (ωΦ) that repeats, from `start`; repetition: the speed after that before it."""
    speed = repetition(start)
    rises = speed > start
    # where it repeats it is one of the platform's own, −1 to 1
    low, high = (speed, max(speed, 1.0)) if rises else (min(speed, -1.0), speed)
    while low < (middle := 0.5 * (low + high)) < high:
        speed = repetition(middle)
        if speed > middle or (speed == middle and not rises):
            low = speed
        else:
            high = speed
    return repetition(high if rises else low)


def settled_speed(found: Attractor, section: NextCollisionMap, start: float = 0.0) -> float:
    """Mean of α̇/(ωΦ) in time on an attractor of `section`, from a disk with the speed `start`.

    nan at rest and without friction. Over IMPACTS impacts where the attractor does not repeat.
    """
    if found.kind is AttractorKind.REST or math.isinf(section.angular_forcing):
        return math.nan
    impacts = len(found.forcing_phases) if found.cycles else IMPACTS
    results, out = np.empty(MEASURED + 1), np.empty((1, 6))
    given = (
        float(section.axial_forcing), float(section.restitution), float(section.phase_lag),
        float(section.angular_forcing),
    )  # fmt: skip

    def repetition(speed: float) -> float:
        state = np.array([found.forcing_phases[0], found.velocities[0], speed, 1.0, 0.0])
        measure_attractor(state, *given, 0, impacts, out, results)
        return float(state[2])

    repetition(repeated_speed(repetition, start))
    return float(results[MEAN_PER_TIME])


def settled_speeds(
    known: Attractors, section: NextCollisionMap, starts: NDArray[np.float64]
) -> NDArray[np.float64]:
    """`settled_speed` of all starts (n,) on all attractors (m,): (n, m)."""
    rows = [[settled_speed(one, section, float(start)) for one in known.found] for start in starts]
    return np.array(rows, float).reshape(len(starts), len(known.found))

"""The mean speed that each start of the next-collision map ends with, rotation included.

The axial part of an orbit does not depend on the rotation, but the speed may depend on the one that
the disk starts with: friction on an orbit of several impacts can hold more than one speed.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.dynamics.next_collision import NextCollisionMap
from bouncing_disk_ros.collision_map.lanes.axial_lanes import COUNT_RESTS
from bouncing_disk_ros.collision_map.lanes.rotation_lanes import (
    SUM_TIME,
    SUM_TURNED,
    iterate_rotation,
)

Floats = NDArray[np.float64]

TRANSIENT, MOST = 500, 100_000
MEASURED = 960
"""Impacts that the mean is over: whole repetitions of orbits of 1 to 6, 8, 10, 12 ... impacts."""


SETTLED = 1e-3
"""The mean (ωΦ) is settled when it changes by no more, after twice as many impacts each time."""


def settling_impacts(angular_velocity: float, angular_forcing: float) -> int:
    """Impacts left out before the first mean, at most MOST.

    TRANSIENT for the axial part, and 2 Γ_T (1 + |α̇|) for the speed: an impact changes it by at most
    (1 + ε)|w_A|/Γ_T, which is 2/Γ_T on the period-1 orbit; on others it may be less.
    """
    return round(min(MOST, TRANSIENT + 2.0 * angular_forcing * (1.0 + abs(angular_velocity))))


def mean_speeds(
    section: NextCollisionMap, tau: Floats, w: Floats, angular_velocity: float
) -> Floats:
    """Mean of α̇/(ωΦ) in time over MEASURED impacts (n,); nan where contact lasts for good.

    Friction is slow where impacts are weak: the mean is taken again, after twice as many impacts
    each time, until it is SETTLED or more than MOST were left out (chaos may stay open).
    Starts: τ in [0, 2π) and w_A < 0 (n,), πg/ω, with the absolute α̇/(ωΦ) of all before that impact.
    Each number depends on its own start alone, so the arrays may be cut anywhere.
    """
    tau, w, speed = tau.copy(), w.copy(), np.full(len(tau), angular_velocity)
    impacts = settling_impacts(angular_velocity, section.angular_forcing)
    _iterate(section, tau, w, speed, impacts)
    mean = _iterate(section, tau, w, speed, MEASURED)
    open_ = np.flatnonzero(~np.isnan(mean))
    while len(open_) and impacts <= MOST:
        state = tau[open_], w[open_], speed[open_]
        _iterate(section, *state, impacts)
        later = _iterate(section, *state, MEASURED)
        settled = np.abs(later - mean[open_]) <= SETTLED
        tau[open_], w[open_], speed[open_] = state
        mean[open_] = later
        open_ = open_[~settled]
        impacts *= 2
    return mean


def _iterate(
    section: NextCollisionMap, tau: Floats, w: Floats, speed: Floats, impacts: int
) -> Floats:
    """Iterate states; the mean speed on the way, nan where contact lasts for good."""
    n = len(tau)
    platform = np.full(n, float(section.axial_forcing)), np.full(n, float(section.restitution))
    turning = np.full(n, float(section.phase_lag)), np.full(n, float(section.angular_forcing))
    counts, sums = np.zeros((n, 2), np.int64), np.zeros((n, 2))
    iterate_rotation(tau, w, speed, *platform, *turning, impacts, counts, sums)
    at_rest = counts[:, COUNT_RESTS] > 0
    tau[at_rest], w[at_rest], speed[at_rest] = 0.0, -1.0, 0.0
    return np.where(
        at_rest, math.nan, sums[:, SUM_TURNED] / np.where(at_rest, 1.0, sums[:, SUM_TIME])
    )

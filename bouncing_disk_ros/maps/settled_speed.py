"""The mean speed that friction brings the disk to on an attractor.

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
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.axial_map import MAP_CONTACT, ORBIT_DELAY, ORBIT_KIND
from bouncing_disk_ros.maps.rotation_map import (
    MEAN_PER_TIME,
    MEASURED,
    ORBIT_SPEED,
    ORBIT_TURNED,
    collision_orbit,
    measure_attractor,
)

if TYPE_CHECKING:
    from bouncing_disk_ros.maps.attractors import Attractor, Attractors
    from bouncing_disk_ros.maps.next_collision import NextCollisionMap

IMPACTS = 6_000
"""Impacts that stand for one repetition of an orbit that does not repeat."""


LEAST_CHANGE = 1e-14
"""ωΦ: an impact that changes the speed by less shows in its last digits only."""


def largest_change(section: NextCollisionMap, velocities: NDArray[np.float64]) -> float:
    """Most that an impact with these w_A (πg/ω) can change the speed by (ωΦ); 0: no friction.

    Below LEAST_CHANGE roundings decide the speed, and not friction.
    """
    hardest = float(np.max(-velocities, initial=0.0))
    return (1.0 + section.restitution) * hardest / section.angular_forcing


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

    Of chaos over IMPACTS impacts. nan at rest, without friction or with so little that roundings
    hide it, and where roundings decide how long it is from contact to contact.
    """
    unknown = found.chatters and not found.cycles
    if unknown or not largest_change(section, found.velocities) >= LEAST_CHANGE:
        return math.nan
    settled = repeated_speed(lambda speed: _repetition(found, section, speed)[0], start)
    return _repetition(found, section, settled)[1]


def _repetition(found: Attractor, section: NextCollisionMap, speed: float) -> tuple[float, float]:
    """Speed (ωΦ) after one repetition that begins with `speed`, and its mean in time."""
    given = section.axial_forcing, section.restitution, section.phase_lag, section.angular_forcing
    first = float(found.forcing_phases[0]), float(found.velocities[0])
    if not found.chatters:
        impacts = len(found.forcing_phases) if found.cycles else IMPACTS
        results, state = np.empty(MEASURED + 1), np.array([*first, speed, 1.0, 0.0])
        measure_attractor(state, *given, 0, impacts, np.empty((1, 6)), results)
        return float(state[2]), float(results[MEAN_PER_TIME])
    # up to contact: how many impacts come before it depends on the rotation
    impacts = len(found.forcing_phases)
    while True:
        impacts *= 2
        rows = np.empty((impacts, ORBIT_TURNED + 1))
        collision_orbit(*first, speed, *given, impacts, rows)
        contacts = np.flatnonzero(rows[:, ORBIT_KIND] == MAP_CONTACT)
        if len(contacts):
            rows = rows[: contacts[0] + 1]
            mean = rows[:, ORBIT_TURNED].sum() / rows[:, ORBIT_DELAY].sum()
            return float(rows[-1, ORBIT_SPEED]), float(mean)


def settled_speeds(
    known: Attractors, section: NextCollisionMap, starts: NDArray[np.float64]
) -> NDArray[np.float64]:
    """`settled_speed` of all starts (n,) on all attractors (m,): (n, m)."""
    rows = [[settled_speed(one, section, float(start)) for one in known.found] for start in starts]
    return np.array(rows, float).reshape(len(starts), len(known.found))

"""Rows of impacts made by the next-collision map: long orbits in little time."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import IMPACT_DTYPE, Disk, ImpactKind, Motion
from bouncing_disk_ros.maps.axial_map import (
    MAP_IMPACT,
    ORBIT_DELAY,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
    axial_orbit,
)
from bouncing_disk_ros.maps.period_one import period_one
from bouncing_disk_ros.maps.scales import velocity_scale

DISK = Disk(0.25, 0.5, 0.6, 0.12, 0.30 / (2 * math.sqrt(2)), 10.0)


def motion_of(axial_forcing: float) -> Motion:
    """The paper's frequency, and the amplitude of an axial forcing Γ."""
    return Motion(axial_forcing * 10.0 * math.pi / (6 * math.pi) ** 2, 1.0, 3.0, 0.0)


def map_rows(
    axial_forcing: float, impacts: int, skip: int = 0, away: float = 0.02
) -> NDArray[np.void]:
    """Impacts of DISK under `motion_of(axial_forcing)`, begun `away` from the period-1 orbit.

    Only what an orbit detector reads is filled in. A flight out of contact ends a row of its own
    kind (the detector must not take it for a flight from the impact before).
    """
    motion = motion_of(axial_forcing)
    orbit = period_one(motion, DISK)
    assert orbit is not None
    out = np.empty((skip + impacts, 4))
    w = orbit.axial_impact_velocity / velocity_scale(motion, DISK)
    axial_orbit(
        orbit.forcing_phase + away, w - away, axial_forcing, DISK.restitution, len(out), out
    )
    out = out[skip:]
    rows = np.zeros(impacts, IMPACT_DTYPE)
    rows["index"] = np.arange(impacts)
    rows["count"] = 1
    rows["forcing_phase"] = out[:, ORBIT_TAU]
    rows["axial_impact_velocity"] = out[:, ORBIT_W] * velocity_scale(motion, DISK)
    turned = np.round((out[1:, ORBIT_DELAY] - np.diff(out[:, ORBIT_TAU])) / math.tau)
    rows["cycles"][1:] = np.cumsum(turned)
    rows["kind"] = np.where(
        out[:, ORBIT_KIND] == MAP_IMPACT, ImpactKind.IMPACT, ImpactKind.CHATTER_TAIL
    )
    return rows

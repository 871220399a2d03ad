"""From SI units to those of the next-collision map: Γ, Γ_T, and the scale of w_A.

Source: Liu, Friend, Yeo, "The behavior of bouncing disks and pizza tossing" (EPL 2009), with
g + P/m in place of g under a preload P.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from bouncing_disk_ros.core.model import Disk, Motion


class MapParameter(NamedTuple):
    """How a parameter of the next-collision map is written."""

    symbol: str
    unit: str


MAP_PARAMETERS: Mapping[str, MapParameter] = {
    "axial_forcing": MapParameter("Γ", "1"),
    "restitution": MapParameter("ε", "1"),
    "phase_lag": MapParameter("θ", "rad"),
    "angular_forcing": MapParameter("Γ_T", "1"),
}
"""Parameters of the next-collision map, by the names that options, maps and figures use."""


def acceleration(disk: Disk) -> float:
    """What pulls the disk down, preload included, m/s²."""
    return disk.gravity + disk.preload / disk.mass


def axial_forcing_of(motion: Motion, disk: Disk) -> float:
    """Γ = A ω² / (π g), 1."""
    omega = math.tau * motion.frequency  # its square by the product: powers are the C library's
    return motion.axial_amplitude * (omega * omega) / (math.pi * acceleration(disk))


def angular_forcing_of(motion: Motion, disk: Disk) -> float:
    """Γ_T = I Φ ω² / (m a_e π g μ), 1; inf without friction, nan without rotation besides."""
    omega = math.tau * motion.frequency
    pull = disk.friction_radius * math.pi * acceleration(disk) * disk.friction
    turn = (
        (disk.gyration_radius**2 + disk.load_inertia / disk.mass)
        * motion.angular_amplitude
        * omega**2
    )
    if pull > 0.0:
        return turn / pull
    return math.inf if turn > 0.0 else math.nan


def velocity_scale(motion: Motion, disk: Disk) -> float:
    """π g / ω, the unit of axial velocity of the next-collision section, m/s."""
    return acceleration(disk) / (2.0 * motion.frequency)

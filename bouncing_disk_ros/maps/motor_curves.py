"""Closed forms of a standing-wave motor whose rotor bounces once in each period of the stator.

The rotor leaves each impact with V = ωΦ cos(τ_imp + θ), as far as friction can give it that, and is
slowed by its loads until the next one. SI units, angles in rad; g + P/m stands for g.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.maps.period_one import existence_limit, period_one, stability_limit
from bouncing_disk_ros.maps.scales import acceleration


def friction_limit(disk: Disk) -> float:
    """T* = μ a_e (m g + P), N·m: the mean torque of friction is never larger, in any regime."""
    return disk.friction * disk.friction_radius * disk.mass * acceleration(disk)


def runs_away(disk: Disk) -> bool:
    """Whether the load turns the rotor ever faster, whatever the stator does."""
    return abs(disk.load_torque) - disk.brake_torque > friction_limit(disk)


def no_load_speed(motion: Motion, disk: Disk) -> float:
    """V, rad/s; nan where there is no period-1 orbit."""
    orbit = period_one(motion, disk)
    return math.nan if orbit is None else orbit.angular_velocity


def _against(disk: Disk, sign: float) -> float:
    """The torque that slows a rotor which turns with this sign, N·m."""
    return disk.load_torque * sign + disk.brake_torque


def _keeps_turning(motion: Motion, disk: Disk, speed: float) -> bool:
    """Whether each impact gives the rotor V again, and a brake does not stop it in between."""
    torque = _against(disk, math.copysign(1.0, speed))
    stops = disk.brake_torque > 0.0 and torque > disk.inertia * motion.frequency * abs(speed)
    return abs(torque) <= friction_limit(disk) and not stops


def mean_speed(motion: Motion, disk: Disk) -> float:
    """Mean of α̇ on the period-1 orbit, rad/s; nan without one, or where no form is known.

    A load alone: V − πT_L/(Iω). With a brake and |T_L| ≤ T_B: the same line, and beyond the knee
    I(Δα̇)²f/(2T), Δα̇ what one impact gives a rotor at rest.
    """
    speed = no_load_speed(motion, disk)
    if math.isnan(speed) or runs_away(disk):
        return math.nan
    momentum = disk.inertia * motion.frequency
    sign = math.copysign(1.0, speed)
    torque = _against(disk, sign)
    if _keeps_turning(motion, disk, speed):
        return speed - 0.5 * sign * torque / momentum
    if abs(disk.load_torque) > disk.brake_torque:
        return math.nan  # it turns back in each period
    given = min(abs(speed), friction_limit(disk) / momentum)
    return 0.5 * sign * momentum * given**2 / torque


class PreloadRegimes(NamedTuple):
    """Preloads at which what the rotor does changes, N; negative: no preload is needed."""

    contact_lasts: float  # above it the stator never lets go of a rotor in contact: Γ = 1/π
    no_period_one: float  # above it there is no period-1 orbit: Γ = (1−ε)/(1+ε)
    doubling: float  # below it the period-1 orbit has doubled: Γ = Γ₁


def preload_regimes(motion: Motion, disk: Disk) -> PreloadRegimes:
    """P = m(Aω²/(πΓ) − g) at the three values of Γ; inf where ε = 1."""
    e = disk.restitution
    top = motion.axial_amplitude * (math.tau * motion.frequency) ** 2 / math.pi

    def preload(forcing: float) -> float:
        return disk.mass * (top / forcing - disk.gravity) if forcing > 0.0 else math.inf

    return PreloadRegimes(
        preload(1.0 / math.pi), preload(existence_limit(e)), preload(stability_limit(e))
    )

"""Closed forms of the period-1 orbit: one impact in each period of the platform.

Source: Liu, Friend, Yeo, "The behavior of bouncing disks and pizza tossing" (EPL 2009), with
g + P/m in place of g under a preload P. SI units, angles in rad.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.scales import axial_forcing_of, velocity_scale

Number = TypeVar("Number", float, NDArray[np.float64])


class PeriodOne(NamedTuple):
    """The period-1 orbit of a steady platform motion."""

    forcing_phase: float  # τ_imp at the impacts, rad, in [0, π/2]
    axial_impact_velocity: float  # w_A just before them, m/s
    angular_velocity: float  # α̇ that the disk settles at without a load torque (eq. 4), rad/s
    stable: bool


def existence_limit(restitution: Number) -> Number:
    """Γ = (1 − ε)/(1 + ε), below which there is no period-1 orbit."""
    return (1.0 - restitution) / (1.0 + restitution)


def impact_velocity(restitution: Number) -> Number:
    """w_A = −2/(1 + ε) of the period-1 orbit, in units of πg/ω."""
    return -2.0 / (1.0 + restitution)


def stability_limit(restitution: float) -> float:
    """Γ₁ = √[((1−ε)/(1+ε))² + (2(1+ε²)/(π(1+ε)²))²], where the orbit doubles its period."""
    e = restitution
    return math.hypot(existence_limit(e), 2.0 * (1.0 + e * e) / (math.pi * (1.0 + e) ** 2))


def period_one(motion: Motion, disk: Disk) -> PeriodOne | None:
    """The period-1 orbit, or None below Γ = (1−ε)/(1+ε), where there is none.

    cos τ_imp = (1−ε)/((1+ε)Γ), w_A = −2/(1+ε) in units of πg/ω, α̇ = ωΦ cos(τ_imp + θ).
    """
    e, axial_forcing = disk.restitution, axial_forcing_of(motion, disk)
    least = existence_limit(e)
    if axial_forcing < least or axial_forcing == 0.0:
        return None
    phase = math.acos(least / axial_forcing)
    omega = math.tau * motion.frequency
    return PeriodOne(
        phase,
        impact_velocity(e) * velocity_scale(motion, disk),
        omega * motion.angular_amplitude * math.cos(phase + motion.phase_lag),
        least < axial_forcing < stability_limit(e),
    )


def refuse_unsettled(programme: str, motion: Motion, disk: Disk) -> None:
    """Refuse a programme that ends with a motion on which the disk has no stable period-1 orbit.

    InputError with the reason.
    """
    orbit, e = period_one(motion, disk), disk.restitution
    if orbit is not None and orbit.stable:
        return
    least, most = existence_limit(e), stability_limit(e)
    allowed = f"a disk for which its last motion has Γ from {least:.4g} to {most:.4g}"
    hint = (
        f"There period 1 is stable at ε = {e:g}. The programme is the pizza's: its amplitudes and "
        "times are not fitted to other disks."
    )
    raise InputError(programme, f"Γ = {axial_forcing_of(motion, disk):.4g}", allowed, hint)

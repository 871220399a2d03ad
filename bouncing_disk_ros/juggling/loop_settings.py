"""What a closed loop is given: strategy, limits, what the controller knows and what it is not told.

Lengths are in parts of the platform's amplitude A, accelerations in parts of Aω², velocities in
units of πg/ω, times in periods: the axial part of the model depends on Γ and ε alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.arithmetic import sine_and_cosine
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.juggling.kernels import loop_kernel as loop
from bouncing_disk_ros.juggling.kernels import toss_planner as plan
from bouncing_disk_ros.juggling.kernels.strategies import NAMES, SMALL, orbit_phase
from bouncing_disk_ros.maps.period_one import existence_limit

Array = NDArray[np.float64]
STRATEGIES = NAMES
"""none: open loop; impact_time, deadbeat, small: see docs/juggling.md."""
HEARS_TIMES_ONLY = ("impact_time",)
"""Strategies that do not use the velocity of the disk."""


@dataclass(frozen=True)
class Limits:
    """Largest offset, in parts of A and of Aω²; the small one is that of the strategy small."""

    position: float = 0.3
    acceleration: float = 2.0
    small: float = 0.02

    def of(self, strategy: str) -> tuple[float, float]:
        """Limits of position and acceleration of one strategy."""
        return (self.small if strategy == NAMES[SMALL] else self.position), self.acceleration


@dataclass(frozen=True)
class Sensor:
    """How impacts reach the controller."""

    delay: float = 0.0  # periods from the impact until it is known
    jitter: float = 0.0  # periods by which the instant is wrong, at most
    missed: float = 0.0  # part of the impacts that is never heard
    seed: int = 1


def check_strategy(name: str) -> int:
    """The number of a strategy; InputError for another name."""
    if name not in STRATEGIES:
        raise InputError("strategy", name, ", ".join(STRATEGIES), closest(name, STRATEGIES))
    return STRATEGIES.index(name)


def period_one_points(axial_forcing: float, restitution: float) -> Array:
    """The period-1 orbit, (1, 2): forcing phase and velocity after its impact; stable or not."""
    least = existence_limit(restitution)
    if not least < axial_forcing:
        allowed = f"more than (1 − ε)/(1 + ε) = {least:.6g}"
        raise InputError("axial_forcing", axial_forcing, allowed, "There is no period-1 orbit.")
    return np.array([[orbit_phase(axial_forcing, restitution), 1.0]])


def sines_and_cosines(phases: Array) -> tuple[Array, Array]:
    """Sines and cosines of angles in one dimension, with the same bits on every machine."""
    found = np.array([sine_and_cosine(float(phase)) for phase in phases]).reshape(-1, 2)
    return found[:, 0], found[:, 1]


def controller_settings(
    strategy: str, axial_forcing: float, restitution: float, limits: Limits, *,
    learns: bool = True, own_orbit: bool = True,
) -> Array:  # fmt: skip
    """Settings of the kernels. `restitution`: as believed; `own_orbit`: aims at period 1.

    Raises InputError for a strategy that does not exist, or a restitution that cannot be.
    """
    if not 0.0 <= restitution <= 1.0:
        raise InputError("restitution", restitution, "0 to 1, as the controller believes it")
    position, acceleration = limits.of(strategy)
    settings = np.zeros(plan.SETTINGS)
    settings[plan.FORCING], settings[plan.RESTITUTION] = axial_forcing, restitution
    settings[plan.POSITION_LIMIT] = position * axial_forcing
    settings[plan.ACCELERATION_LIMIT] = acceleration * axial_forcing
    settings[plan.STRATEGY], settings[plan.LEARNS] = check_strategy(strategy), float(learns)
    settings[plan.LEVELS] = 0.0 if strategy in HEARS_TIMES_ONLY else 2.0
    settings[plan.OWN_ORBIT] = float(own_orbit)
    return settings


def plant_settings(
    restitution: float, sensor: Sensor, *, hears_velocity: bool, deadline: float,
    impulse: float = 0.0, impulse_at: float = 10.0, phase_lag: float = 0.0,
    angular_forcing: float = 1.0,
) -> Array:  # fmt: skip
    """Of plant and sensor; times in periods, the impulse a change of velocity, the lag in rad."""
    plant = np.zeros(loop.PLANT)
    plant[loop.P_RESTITUTION], plant[loop.MISSED] = restitution, sensor.missed
    plant[loop.DELAY], plant[loop.JITTER] = math.tau * sensor.delay, math.tau * sensor.jitter
    plant[loop.HEARS_VELOCITY] = float(hears_velocity)
    plant[loop.IMPULSE], plant[loop.IMPULSE_AT] = impulse, math.tau * impulse_at
    plant[loop.DEADLINE] = math.tau * deadline
    plant[loop.PHASE_LAG], plant[loop.ANGULAR_FORCING] = phase_lag, angular_forcing
    return plant

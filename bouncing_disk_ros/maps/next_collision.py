"""The next-collision map: from the state at one impact to that at the next.

Dimensionless, as in the paper: axial velocities in πg/ω, angular ones in ωΦ, time as phase ωt. The
axial part depends on Γ and ε alone. Source: Liu, Friend, Yeo, "The behavior of bouncing disks and
pizza tossing" (EPL 2009); the kernels are maps/axial_map.py, maps/rotation_map.py
and maps/map_tangent.py.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import number, plain, whole
from bouncing_disk_ros.maps.axial_map import (
    MAP_CONTACT,
    MAP_REST,
    ORBIT_DELAY,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
)
from bouncing_disk_ros.maps.map_tangent import axial_tangent
from bouncing_disk_ros.maps.rotation_map import ORBIT_SPEED, ORBIT_TURNED, collision_orbit

Array = NDArray[np.float64]


class MapState(NamedTuple):
    """The state just before an impact."""

    forcing_phase: float  # τ, rad
    axial_impact_velocity: float  # w_A/(πg/ω) < 0; 0: the disk lies on the platform
    angular_impact_velocity: float = 0.0  # w_T/(ωΦ)


class Impacts(NamedTuple):
    """Consecutive impacts: arrays (n,) with one element for each."""

    forcing_phase: Array  # τ, rad
    axial_impact_velocity: Array  # w_A/(πg/ω)
    angular_impact_velocity: Array  # w_T/(ωΦ)
    angular_velocity: Array  # α̇/(ωΦ) just before, which is that of the flight
    delay: Array  # phase since the impact before, rad
    turned: Array  # angle of the disk since the impact before, in Φ
    contact: NDArray[np.bool_]  # whether the disk was in contact since the impact before


@dataclass(frozen=True)
class NextCollisionMap:
    """The next-collision map at one set of parameters. Raises InputError for values out of range.

    >>> section = NextCollisionMap(axial_forcing=0.45, restitution=0.5)
    >>> section.orbit(MapState(forcing_phase=1.0, axial_impact_velocity=-1.3), 5).forcing_phase
    """

    axial_forcing: float  # Γ ≥ 0
    restitution: float  # ε in [0, 1]
    phase_lag: float = 0.0  # θ, rad
    angular_forcing: float = math.inf  # Γ_T > 0; inf: no friction

    def __post_init__(self) -> None:
        for name, given in vars(self).items():
            value = plain(given)  # numbers of NumPy as Python's
            is_number = type(value) is float or (type(value) is int and abs(value) <= 2**1000)
            _check(name, value, is_number, "a number")
            object.__setattr__(self, name, value)
        _check(
            "axial_forcing",
            self.axial_forcing,
            0.0 <= self.axial_forcing < math.inf,
            "a number >= 0 (Γ)",
        )
        fine = 0.0 <= self.restitution <= 1.0
        _check("restitution", self.restitution, fine, "a number from 0 to 1 (ε)")
        fine = math.isfinite(self.phase_lag)
        _check("phase_lag", self.phase_lag, fine, "a finite number, rad (θ)")
        fine = self.angular_forcing > 0.0
        _check("angular_forcing", self.angular_forcing, fine, "a number > 0, or inf (Γ_T)")
        for name, value in vars(self).items():
            object.__setattr__(self, name, float(value))

    @property
    def axial_parameters(self) -> tuple[float, float]:
        """Γ and ε, which the axial part depends on."""
        return self.axial_forcing, self.restitution

    def orbit(self, start: MapState, impacts: int) -> Impacts:
        """The next impacts after `start`; fewer where contact then lasts for good (Γ ≤ 1/π)."""
        tau, w, omega = self.checked(start)
        impacts = whole("impacts", plain(impacts), 0)
        out = np.zeros((impacts, ORBIT_TURNED + 1))
        n = collision_orbit(tau, w, omega, *astuple(self), impacts, out)
        if n and out[n - 1, ORBIT_KIND] == MAP_REST:
            n -= 1
        rows = out[:n]
        slip = rows[:, ORBIT_SPEED] - np.cos(rows[:, ORBIT_TAU] + self.phase_lag)
        return Impacts(
            rows[:, ORBIT_TAU], rows[:, ORBIT_W], slip, rows[:, ORBIT_SPEED], rows[:, ORBIT_DELAY],
            rows[:, ORBIT_TURNED], rows[:, ORBIT_KIND] == MAP_CONTACT,
        )  # fmt: skip

    def iterate(self, start: MapState, impacts: int = 1) -> MapState:
        """The state after some impacts. Raises InputError where contact lasts for good."""
        if impacts == 0:
            return start
        steps = self.orbit(start, impacts)
        if len(steps.delay) < impacts:
            raise InputError("axial_forcing", self.axial_forcing, *_RESTS)
        return MapState(*(float(a[-1]) for a in steps[:3]))

    def jacobian(self, start: MapState, impacts: int = 1) -> Array:
        """Derivatives (3, 3) of the state after some impacts by `start`: rows τ, w_A, w_T.

        Where an impact is just able to take the whole slip away, those of the side that sticks. At
        a graze there are none: they grow without bound before it. Raises InputError as `iterate`.
        """
        total = np.eye(3)
        for _ in range(impacts):
            end = self.iterate(start)
            total = self._step_jacobian(start, end) @ total
            start = end
        return total

    def checked(self, state: Sequence[float]) -> tuple[float, float, float]:
        """τ in [0, 2π), w_A and α̇/(ωΦ) of a state; without w_T it is 0. Raises InputError."""
        try:
            tau, w, slip = MapState(*map(float, state))
        except (TypeError, ValueError):
            raise InputError("state", state, f"numbers: {', '.join(MapState._fields)}") from None
        _check("forcing_phase", tau, math.isfinite(tau), "a finite number, rad")
        fine = -math.inf < w <= 0.0
        _check("axial_impact_velocity", w, fine, "a number < 0, or 0 for a disk on the platform")
        _check("angular_impact_velocity", slip, math.isfinite(slip), "a finite number")
        tau %= math.tau
        tau = tau if tau < math.tau else 0.0
        return tau, w, slip + math.cos(tau + self.phase_lag)

    def _step_jacobian(self, start: MapState, end: MapState) -> Array:
        """Derivatives over one impact; α̇ of the flight first, then w_T = α̇ − cos(τ + θ)."""
        tau, w, omega = self.checked(start)
        states, axial = np.zeros((2, 3)), np.zeros((2, 4))
        contact = axial_tangent(tau, w, *self.axial_parameters, 1, states, axial) > 0
        total = np.zeros((3, 3))
        total[:2, :2] = axial[:, :2]
        slip, turn = start.angular_impact_velocity, -math.sin(tau + self.phase_lag)
        grip = 1.0 / self.angular_forcing
        sign = math.copysign(1.0, slip)
        after = end.angular_impact_velocity + math.cos(end.forcing_phase + self.phase_lag)
        if not contact:
            if abs(slip) <= grip * (1.0 + self.restitution) * -w:
                total[2] = turn, 0.0, 0.0
            else:
                total[2] = turn, sign * grip * (1.0 + self.restitution), 1.0
        elif math.isclose(after, omega - sign * grip * self._push(tau, w), abs_tol=1e-9):
            load = 1.0 / math.pi - self.axial_forcing * math.sin(tau)
            total[2] = turn + sign * grip * load, sign * grip, 1.0  # it slid all the way
        total[2] += math.sin(end.forcing_phase + self.phase_lag) * total[0]
        return total

    def _push(self, tau: float, w: float) -> float:
        """Impulse over m from an impact through chatter and contact to separation, by momentum."""
        leave = math.asin(1.0 / (math.pi * self.axial_forcing))
        climb = self.axial_forcing * (math.cos(leave) - math.cos(tau)) - w
        return climb + (leave - tau) % math.tau / math.pi


_RESTS = (
    "an axial forcing above 1/π = 0.3183, where a disk in contact is thrown again",
    "Here the disk comes to rest on the platform",
)


def _check(field: str, value: object, fine: bool, allowed: str) -> None:
    if not fine:
        raise InputError(field, value, allowed)


_PLASTIC = 1.324717957244746
"""The real root of x³ = x + 1."""


def spread_starts(count: int, velocity_begin: float) -> list[MapState]:
    """States spread evenly over τ ∈ [0, 2π), w_A ∈ (velocity_begin, 0), without slip (w_T = 0).

    The points {½ + k/p}, {½ + k/p²} of the unit square with the plastic number p (M. Roberts,
    2018): of few as of many no two are close, and more starts begin with the same ones. Velocities
    in units of πg/ω. Raises InputError.

    >>> spread_starts(24, velocity_begin=-5.0)
    """
    count = whole("starts", plain(count), 1, 1_000_000)
    velocity_begin = number("velocity_begin", plain(velocity_begin))
    if not velocity_begin < 0.0:
        raise InputError("velocity_begin", velocity_begin, "less than 0", "The window is empty.")
    found = []
    for k in range(count):
        x, y = (0.5 + k / _PLASTIC) % 1.0, (0.5 + k / _PLASTIC**2) % 1.0
        found.append(MapState(math.tau * x, velocity_begin * (1.0 - y)))
    return found

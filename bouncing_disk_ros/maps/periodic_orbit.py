"""Periodic orbits of the next-collision map: Newton's method, Floquet multipliers, speed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import plain, whole
from bouncing_disk_ros.maps.map_tangent import axial_tangent
from bouncing_disk_ros.maps.next_collision import Array, MapState, NextCollisionMap
from bouncing_disk_ros.maps.period_one import existence_limit, impact_velocity
from bouncing_disk_ros.maps.settled_speed import (
    LEAST_CHANGE,
    largest_change,
    repeated_speed,
)

RESIDUAL = 1e-11
"""An orbit is found when it closes to this (rad, πg/ω) and Newton's method gets no closer."""
_STEPS = 40
_NEARBY = 1e-7
"""ωΦ, a change of a speed that shows its multiplier."""


class PeriodicOrbit(NamedTuple):
    """A periodic orbit of n impacts."""

    map: NextCollisionMap
    cycles: int  # periods of the platform in one repetition
    forcing_phase: Array  # (n,) τ, rad, in [0, 2π)
    axial_impact_velocity: Array  # (n,) w_A/(πg/ω)
    angular_impact_velocity: Array  # (n,) w_T/(ωΦ); nan without friction, which leaves it open
    mean_speed: float  # mean of α̇/(ωΦ) in time
    contacts: int  # phases of contact in one repetition
    trace: float  # of the derivatives of τ and w_A over one repetition
    determinant: float  # of the same: ε²ⁿ, or 0 with contact
    angular_multiplier: float  # of w_T: 0 where some impact sticks, 1 where all slip; nan where
    # one is just able to stick, and without friction or with so little that roundings hide it

    def __repr__(self) -> str:
        """How often it hits, whether it is stable, where it begins."""
        kind = "stable" if self.stable else "unstable"
        cycles = f"{self.cycles} cycle{'s' if self.cycles != 1 else ''}"
        state = f"τ = {self.state.forcing_phase:.6g}, w_A = {self.state.axial_impact_velocity:.6g}"
        size = f"|multiplier| {abs(self.multipliers[0]):.6g}"
        return f"<{kind} orbit of {self.impacts} impact(s) in {cycles}: {state}, {size}>"

    @property
    def impacts(self) -> int:
        """Impacts in one repetition, n."""
        return len(self.forcing_phase)

    @property
    def state(self) -> MapState:
        """The first of its states; a speed left open is taken as w_T = 0."""
        slip = float(self.angular_impact_velocity[0])
        slip = 0.0 if math.isnan(slip) else slip
        return MapState(float(self.forcing_phase[0]), float(self.axial_impact_velocity[0]), slip)

    @property
    def multipliers(self) -> tuple[complex, complex]:
        """Floquet multipliers of the axial part, the larger in magnitude first."""
        half, rest = 0.5 * self.trace, 0.25 * self.trace**2 - self.determinant
        if rest < 0.0:
            return complex(half, math.sqrt(-rest)), complex(half, -math.sqrt(-rest))
        first = half + math.copysign(math.sqrt(rest), half)
        return complex(first), complex(self.determinant / first if first != 0.0 else 0.0)

    @property
    def stable(self) -> bool:
        """Whether small changes of τ and w_A die out."""
        return abs(self.multipliers[0]) < 1.0

    @property
    def lyapunov_exponent(self) -> float:
        """Logarithm of the larger multiplier's magnitude, per impact; −inf with contact."""
        size = abs(self.multipliers[0])
        return math.log(size) / self.impacts if size > 0.0 else -math.inf


def fixed_point(
    axial_forcing: float,
    restitution: float,
    phase_lag: float = 0.0,
    angular_forcing: float = math.inf,
    cycles: int = 1,
) -> PeriodicOrbit:
    """Orbit with one impact in `cycles` periods: cos τ = k(1−ε)/((1+ε)Γ), w_A = −2k/(1+ε).

    Raises InputError where there is none: below Γ = k(1−ε)/(1+ε), or where the disk of this orbit
    would pass through the platform between impacts.

    >>> fixed_point(0.45, 0.5).multipliers
    """
    section = NextCollisionMap(axial_forcing, restitution, phase_lag, angular_forcing)
    cycles = whole("cycles", plain(cycles), 1)
    least = cycles * existence_limit(restitution)
    if axial_forcing <= 0.0 or axial_forcing < least:
        raise InputError(
            "axial_forcing", axial_forcing, f"at least (1 − ε)/(1 + ε) k = {max(least, 0.0):.6g}"
        )
    start = MapState(math.acos(least / axial_forcing), cycles * impact_velocity(restitution))
    orbit = periodic_orbit(section, start, 1)
    if orbit.cycles != cycles or abs(orbit.axial_impact_velocity[0] - start[1]) > 1e-6:
        allowed = "a forcing at which the platform does not meet the disk earlier"
        raise InputError(
            "axial_forcing", axial_forcing, allowed, f"No such orbit in {cycles} periods here"
        )
    return orbit


def periodic_orbit(section: NextCollisionMap, guess: MapState, impacts: int) -> PeriodicOrbit:
    """Periodic orbit of `impacts` impacts near `guess`, by Newton's method with exact derivatives.

    It may repeat sooner: a fixed point also closes after two impacts. Raises InputError where the
    method does not converge, or the disk comes to rest.

    >>> periodic_orbit(NextCollisionMap(0.55, 0.5), MapState(0.9, -1.3), 2).multipliers
    """
    impacts = whole("impacts", plain(impacts), 1)
    tau, w, _ = section.checked(guess)
    best = math.inf
    found = None
    for _ in range(_STEPS):
        states, tangent, contacts = followed(section, tau, w, impacts)
        change = states[-1, :2] - states[0, :2]
        change[0] = math.remainder(change[0], math.tau)
        residual = float(np.max(np.abs(change)))
        if residual < best:
            best, found = residual, (states, tangent, contacts)
        elif best < RESIDUAL:
            break
        matrix = np.eye(2) - tangent[:, :2]
        with np.errstate(over="ignore", invalid="ignore"):
            size = abs(np.linalg.det(matrix))
        if not 1e-14 <= size < math.inf:  # along a chaotic path derivatives leave the range
            break
        step = np.linalg.solve(matrix, change)
        step *= min(1.0, 0.5 / float(np.max(np.abs(step)))) if step.any() else 1.0
        tau, w = (tau + step[0]) % math.tau, min(w + step[1], 0.5 * w)
    if found is None or best >= RESIDUAL:
        allowed = f"a state near an orbit that repeats after {impacts} impacts"
        hint = f"Newton's method came no nearer than {best:.1e}: start closer to the orbit"
        raise InputError("guess", f"τ = {guess[0]:.6g}, w_A = {guess[1]:.6g}", allowed, hint)
    return _described(section, *found)


def followed(
    section: NextCollisionMap, tau: float, w: float, impacts: int
) -> tuple[Array, Array, int]:
    """States (n + 1, 3), derivatives (2, 4) and contacts, by maps/map_tangent.py."""
    states, tangent = np.zeros((impacts + 1, 3)), np.zeros((2, 4))
    contacts = axial_tangent(tau, w, *section.axial_parameters, impacts, states, tangent)
    if contacts < 0:
        hint = "Here the disk comes to rest on the platform"
        raise InputError("axial_forcing", section.axial_forcing, "above 1/π = 0.3183", hint)
    return states, tangent, contacts


def _described(
    section: NextCollisionMap, states: Array, tangent: Array, contacts: int
) -> PeriodicOrbit:
    n = len(states) - 1
    phases, speeds = states[:-1, 0].copy(), states[:-1, 1].copy()
    slips, mean, multiplier = _rotation(section, phases, speeds)
    determinant = 0.0 if contacts else section.restitution ** (2 * n)
    cycles = round(float(np.sum(states[1:, 2])) / math.tau)
    trace = float(tangent[0, 0] + tangent[1, 1])
    return PeriodicOrbit(
        section, cycles, phases, speeds, slips, mean, contacts, trace, determinant, multiplier
    )


def _rotation(
    section: NextCollisionMap, phases: Array, speeds: Array
) -> tuple[Array, float, float]:
    """w_T at each impact of an orbit that friction has settled, mean speed and multiplier."""
    change = largest_change(section, speeds)
    if not change >= LEAST_CHANGE:
        return np.full(len(phases), math.nan), math.nan, math.nan
    speed = repeated_speed(lambda speed: _repetition(section, phases, speeds, speed)[0])
    _, slips, turned, lasted = _repetition(section, phases, speeds, speed)
    multiplier = _multiplier(lambda speed: _repetition(section, phases, speeds, speed)[0], speed,
                             min(_NEARBY, change))  # fmt: skip
    return slips, turned / lasted, multiplier


def _multiplier(repetition: Callable[[float], float], speed: float, step: float) -> float:
    """Derivative of the speed after a repetition: 0 or 1, from both sides by the largest step.

    nan where they differ down to LEAST_CHANGE.
    """
    while (step := step / 4.0) >= LEAST_CHANGE:
        low, middle, high = (repetition(speed + side * step) for side in (-1.0, 0.0, 1.0))
        parts = {round((high - middle) / step, 1), round((middle - low) / step, 1)}
        if parts in ({0.0}, {1.0}):
            return parts.pop()
    return math.nan


def _repetition(
    section: NextCollisionMap, phases: Array, speeds: Array, speed: float
) -> tuple[float, Array, float, float]:
    """Speed after a repetition, w_T at its impacts, angle and phase that it takes."""
    slips = np.zeros(len(phases))
    turned = lasted = 0.0
    for i, (tau, w) in enumerate(zip(phases, speeds, strict=True)):
        slips[i] = speed - math.cos(tau + section.phase_lag)
        step = section.orbit(MapState(float(tau), float(w), float(slips[i])), 1)
        speed = float(step.angular_velocity[0])
        turned += float(step.turned[0])
        lasted += float(step.delay[0])
    return speed, slips, turned, lasted

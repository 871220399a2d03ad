"""Bifurcations along a parameter: period doublings, and where an attractor first holds contact.

An orbit of n impacts is followed along Γ or ε by Newton's method (predictor: its derivative by the
parameter). With trace T and determinant ε²ⁿ of its derivatives, a multiplier is −1 where
1 + T + ε²ⁿ = 0; that root gives the point to about the last digits of a float64. The doubled orbit
is found by iteration a little further on. The first complete chatter is found by halving.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.maps.axial_map import (
    MAP_IMPACT,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
    axial_orbit,
)
from bouncing_disk_ros.maps.next_collision import Array, MapState, NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import (
    PeriodicOrbit,
    followed,
    periodic_orbit,
)
from bouncing_disk_ros.scalar_search import halved, root_between

AXES = ("axial_forcing", "restitution")
"""The parameters that the axial part of an orbit depends on."""
FEIGENBAUM = 4.669201609102990
"""What the ratios of the distances between doublings tend to (M. J. Feigenbaum, 1978)."""
_MARCH = 48
_FURTHEST = 1.0
"""How far (rad, πg/ω) Newton's method may be sent: from further away it has led to other orbits."""
_SETTLE = 4000
_HALVINGS = 40
_ONSET_STEPS = 64


class Doubling(NamedTuple):
    """A value of the parameter at which an orbit of n impacts becomes one of 2n."""

    value: float
    orbit: PeriodicOrbit  # of n impacts, at this value: a multiplier is −1

    @property
    def impacts(self) -> int:
        """Impacts in one repetition before the doubling, n."""
        return self.orbit.impacts


def feigenbaum_ratios(values: Sequence[float]) -> Array:
    """(vₖ₊₁ − vₖ)/(vₖ₊₂ − vₖ₊₁) of the points of doubling in a row, (n − 2,)."""
    steps = np.diff(np.asarray(values, dtype=float))
    return np.asarray(steps[:-1] / steps[1:])


def moved(orbit: PeriodicOrbit, axis: str, value: float) -> PeriodicOrbit:
    """The same orbit at another value of Γ or ε. Raises InputError where it is not found."""
    check_axis(axis)
    start = orbit.state
    _, tangent, contacts = followed(
        orbit.map, start.forcing_phase, start.axial_impact_velocity, orbit.impacts
    )
    shift = np.zeros(2)
    matrix = np.eye(2) - tangent[:, :2]
    if not contacts and abs(np.linalg.det(matrix)) > 1e-12:
        rate = np.linalg.solve(matrix, tangent[:, 2 + AXES.index(axis)])
        shift = rate * (value - getattr(orbit.map, axis))
        if np.abs(shift).max() > _FURTHEST:
            raise InputError(axis, value, "a value nearer to the orbit's", "It leads too far away")
    speed = min(start.axial_impact_velocity + shift[1], 0.5 * start.axial_impact_velocity)
    guess = MapState(start.forcing_phase + shift[0], speed)
    found = periodic_orbit(replace(orbit.map, **{axis: value}), guess, orbit.impacts)
    if found.cycles != orbit.cycles or found.contacts != orbit.contacts:
        raise InputError(axis, value, "a value nearer to the orbit's", "It led to another orbit")
    return found


def period_doublings(
    orbit: PeriodicOrbit, axis: str, limit: float, count: int = 5
) -> list[Doubling]:
    """Period doublings of a stable orbit along Γ or ε, from its own value to `limit`.

    At most `count` of them; fewer where the cascade ends, or an orbit does, before `limit`. From
    the period-1 orbit with axis forcing and ε = 0.5: 0.486003, 0.530664, … Raises InputError for
    an orbit that is not stable, or arguments out of range.

    >>> period_doublings(fixed_point(0.45, 0.5), "axial_forcing", limit=0.55)[0].value
    """
    check_axis(axis)
    value = getattr(orbit.map, axis)
    if not orbit.stable:
        given = f"a multiplier of magnitude {abs(orbit.multipliers[0]):.4g}"
        raise InputError("orbit", given, "a stable orbit, below 1")
    if not math.isfinite(limit) or limit == value:
        raise InputError("limit", limit, f"a finite number other than the orbit's {value:g}")
    if count < 1:
        raise InputError("count", count, "a whole number >= 1")
    orbit = without_rotation(orbit)
    found: list[Doubling] = []
    step = (limit - value) / _MARCH
    while len(found) < count:
        bracket = _march(orbit, axis, limit, step)
        if bracket is None:
            break
        critical = _critical(*bracket, axis)
        point = Doubling(getattr(critical.map, axis), critical)
        width = point.value - (found[-1].value if found else value)
        found.append(point)
        if len(found) < count:
            doubled = _doubled(point, axis, limit, 0.4 * width / FEIGENBAUM)
            if doubled is None:
                break
            orbit, step = doubled, (getattr(doubled.map, axis) - point.value) / 4.0
    return found


def without_rotation(orbit: PeriodicOrbit) -> PeriodicOrbit:
    """The same orbit without friction: the points do not depend on it, and it takes time."""
    section = replace(orbit.map, angular_forcing=math.inf)
    return periodic_orbit(section, orbit.state, orbit.impacts)


def check_axis(axis: str) -> None:
    """Raise InputError unless the axial part of an orbit depends on this parameter."""
    if axis not in AXES:
        raise InputError("axis", axis, " or ".join(AXES), closest(axis, AXES))


def beyond_doubling(orbit: PeriodicOrbit) -> float:
    """1 + T + ε²ⁿ: > 0 before the doubling, 0 where a multiplier is −1, < 0 beyond."""
    return 1.0 + orbit.trace + orbit.determinant


def _march(
    orbit: PeriodicOrbit, axis: str, limit: float, step: float
) -> tuple[PeriodicOrbit, PeriodicOrbit] | None:
    """Two orbits with the doubling between them; None if it does not come before `limit`."""
    value = getattr(orbit.map, axis)
    least = abs(step) * 1e-6
    while value != limit and abs(step) > least:
        target = value + step
        if (limit - target) * step <= 0.0:
            target = limit
        try:
            there = moved(orbit, axis, target)
        except InputError:
            step *= 0.5
            continue
        if beyond_doubling(there) <= 0.0:
            return orbit, there
        orbit, value = there, target
    return None


def _critical(before: PeriodicOrbit, after: PeriodicOrbit, axis: str) -> PeriodicOrbit:
    """The orbit with multiplier −1 between two of its kind."""
    near = before

    def defect(value: float) -> float:
        nonlocal near
        near = moved(near, axis, value)
        return beyond_doubling(near)

    low, high = getattr(before.map, axis), getattr(after.map, axis)
    root = root_between(defect, low, beyond_doubling(before), high, beyond_doubling(after))
    return moved(near, axis, root)


def _doubled(point: Doubling, axis: str, limit: float, step: float) -> PeriodicOrbit | None:
    """The stable orbit of 2n impacts a little beyond a doubling; None if there is none."""
    n = point.impacts
    step = math.copysign(min(abs(step), abs(limit - point.value)), limit - point.value)
    start = point.orbit.state
    for _ in range(_HALVINGS):
        section = replace(point.orbit.map, **{axis: point.value + step})
        try:
            settled = section.iterate(start, _SETTLE * n)
            orbit = periodic_orbit(section, settled, 2 * n)
        except InputError:
            step *= 0.5
            continue
        apart = abs(orbit.axial_impact_velocity[n] - orbit.axial_impact_velocity[0])
        if orbit.stable and apart > 1e-9 and orbit.cycles == 2 * point.orbit.cycles:
            return orbit
        step *= 0.5
    return None


class ContactOnset(NamedTuple):
    """Where an attractor first holds a complete chatter, with contact, seen in finite time."""

    without: float  # no contact in `impacts` impacts here ...
    value: float  # ... and some here
    impacts: int


def contact_onset(
    section: NextCollisionMap,
    axis: str,
    limit: float,
    start: MapState,
    *,
    impacts: int = 100_000,
    digits: float = 1e-6,
) -> ContactOnset | None:
    """The first value on the way to `limit` at which the attractor is seen to hold contact.

    `start` is a state on the attractor at the value of `section`. The way is halved until
    `digits` are left, each value starting from the last state without contact. Rare chatters
    escape `impacts` impacts, so the true onset lies a little earlier. None: no contact at `limit`.
    Raises InputError for a start whose orbit holds contact.
    """
    check_axis(axis)
    low, high = float(getattr(section, axis)), float(limit)
    settled = _without_contact(section, start, impacts)
    if settled is None:
        raise InputError("start", start, "a state whose orbit holds no contact at its own value")
    state = settled

    def bounces(value: float) -> bool:
        nonlocal state
        after = _without_contact(replace(section, **{axis: value}), state, impacts)
        state = after or state
        return after is not None

    for value in np.linspace(low, high, _ONSET_STEPS + 1)[1:]:
        if not bounces(float(value)):
            high = float(value)
            break
        low = float(value)
    else:
        return None
    return ContactOnset(*halved(bounces, low, high, width=digits), impacts)


def _without_contact(section: NextCollisionMap, start: MapState, impacts: int) -> MapState | None:
    """The state after some impacts; None where a complete chatter comes before."""
    tau, w, _ = section.checked(start)
    rows = np.empty((impacts + 1, 4))
    rows[0] = tau, w, 0.0, MAP_IMPACT
    axial_orbit(tau, w, *section.axial_parameters, impacts, rows[1:])
    if (rows[:, ORBIT_KIND] != MAP_IMPACT).any():
        return None
    return MapState(float(rows[-1, ORBIT_TAU]), float(rows[-1, ORBIT_W]))

"""Where an orbit ends: a graze, a fold; and where an attractor first holds a complete chatter.

A flight that becomes tangent to the platform (a graze) lands earlier from there on, and the map
jumps. Lengths are in πg/ω², other units as in `next_collision`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.axial_flights import clearance_of, impacts_before_contact
from bouncing_disk_ros.maps.continuation import check_axis, moved, without_rotation
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit

_MARCH = 64
_CLOSE = 1e-6
"""An orbit this near to the platform (πg/ω²) where it is lost has grazed it."""
_FLAT = 1e-3
"""A multiplier this near to 1 where an orbit is lost belongs to a fold."""


class EndKind(StrEnum):
    """Why an orbit is no longer there."""

    GRAZE = "graze"  # a flight becomes tangent to the platform, or an impact too slow to be one
    FOLD = "fold"  # it meets an unstable orbit, multiplier 1
    LIMIT = "limit"  # it is still there at the limit
    UNKNOWN = "unknown"  # it was lost for none of these reasons


class OrbitEnd(NamedTuple):
    """Where an orbit ends along a parameter."""

    kind: EndKind
    value: float  # of the parameter, between the last orbit found and the first miss
    error: float  # half the distance between these two
    orbit: PeriodicOrbit  # the last one found


class ContactOnset(NamedTuple):
    """Where an attractor first holds a complete chatter, with contact, seen in finite time."""

    without: float  # no contact in `impacts` impacts here ...
    value: float  # ... and some here
    impacts: int


def clearance(orbit: PeriodicOrbit) -> float:
    """How far the orbit is from a graze: 0 at one, inf where no flight has a minimum of its gap.

    The least minimum of the gap inside a flight; or, of an impact where the gap is bent upward, how
    far it would reach below 0 if the disk could go on, w²/(2h'').
    """
    section = orbit.map
    n = orbit.impacts
    least = math.inf
    for i in range(n):
        tau, w = float(orbit.forcing_phase[i]), float(orbit.axial_impact_velocity[i])
        delay = float(section.orbit(MapState(tau, w), 1).delay[0])
        least = min(least, clearance_of(tau, w, delay, section.axial_forcing, section.restitution))
        bend = section.axial_forcing * math.sin(tau) - 1.0 / math.pi
        least = min(least, 0.5 * w * w / bend if bend > 0.0 else math.inf)
    return least


def orbit_end(orbit: PeriodicOrbit, axis: str, limit: float) -> OrbitEnd:
    """Follow an orbit along Γ or ε until it ends, at the latest at `limit`.

    A graze is found to about 1e-13, a fold to about 1e-9. Raises InputError for an orbit with
    contact, or arguments out of range.
    """
    check_axis(axis)
    if orbit.contacts:
        raise InputError("orbit", f"{orbit.contacts} phases of contact", "an orbit of flights")
    value = getattr(orbit.map, axis)
    if not math.isfinite(limit) or limit == value:
        raise InputError("limit", limit, f"a finite number other than the orbit's {value:g}")
    orbit = without_rotation(orbit)
    step = (limit - value) / _MARCH
    missed = math.nan
    while value != limit:
        target = value + step
        if not math.isnan(missed):
            target = min(target, 0.5 * (value + missed), key=lambda v: abs(v - value))
        if (limit - target) * step < 0.0:
            target = limit
        if abs(target - value) <= 4.0 * math.ulp(value):
            break
        try:
            orbit = moved(orbit, axis, target)
            value = target
        except InputError:
            missed = target
    if math.isnan(missed):
        return OrbitEnd(EndKind.LIMIT, value, 0.0, orbit)
    middle, error = 0.5 * (value + missed), 0.5 * abs(missed - value)
    return OrbitEnd(_cause(orbit), middle, error, orbit)


def _cause(orbit: PeriodicOrbit) -> EndKind:
    if clearance(orbit) < _CLOSE:
        return EndKind.GRAZE
    if min(abs(m - 1.0) for m in orbit.multipliers) < _FLAT:
        return EndKind.FOLD
    return EndKind.UNKNOWN


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
    state = _without_contact(section, start, impacts)
    if state is None:
        raise InputError("start", start, "a state whose orbit holds no contact at its own value")
    for value in np.linspace(low, high, _MARCH + 1)[1:]:
        after = _without_contact(replace(section, **{axis: float(value)}), state, impacts)
        if after is None:
            high = float(value)
            break
        low, state = float(value), after
    else:
        return None
    while abs(high - low) > digits:
        middle = 0.5 * (low + high)
        after = _without_contact(replace(section, **{axis: middle}), state, impacts)
        if after is None:
            high = middle
        else:
            low, state = middle, after
    return ContactOnset(low, high, impacts)


def _without_contact(section: NextCollisionMap, start: MapState, impacts: int) -> MapState | None:
    """The state after some impacts; None where a complete chatter comes before."""
    state = np.array(section.checked(start)[:2])
    axial_forcing, restitution = float(section.axial_forcing), float(section.restitution)
    if impacts_before_contact(state, axial_forcing, restitution, impacts) >= 0:
        return None
    return MapState(float(state[0]), float(state[1]))

"""Instants of an attractor of the next-collision map: its states between impacts and beside them.

Units of the next-collision map: time is phase (rad), lengths are in πg/ω², velocities in πg/ω.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.restitution import rebounded
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind
from bouncing_disk_ros.maps.axial_iteration import land_from_height
from bouncing_disk_ros.maps.next_collision import NextCollisionMap

Array = NDArray[np.float64]

MOST_IMPACTS = 64
"""Flights of a chaotic attractor that instants are taken from."""
LIMITS = 16
"""Impacts whose two limits are looked at, the first ones of a repetition."""


class Instants(NamedTuple):
    """States of an orbit; arrays (m,)."""

    part: Array  # of the repetition that has passed, 0 to 1
    forcing_phase: Array  # rad, in [0, 2π)
    gap: Array  # ≥ 0; 0 at impacts and in contact
    speed: Array  # of the disk relative to the platform; in contact 0

    def joined(self, other: Instants) -> Instants:
        """These and others behind them."""
        return Instants(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


def instants_of(attractor: Attractor, section: NextCollisionMap, count: int) -> Instants:
    """Instants of an attractor, `count` of them, at the middles of equal parts of a repetition.

    A chaotic attractor has MOST_IMPACTS of its flights for a repetition, rest has one period of the
    platform. With contact, the repetition begins at separation, and the last impacts of a chatter,
    which the map does not resolve, count as contact.

    >>> section = NextCollisionMap(axial_forcing=0.45, restitution=0.5)
    >>> known = find_attractors(section, [(0.7, -1.3)])
    >>> instants_of(known.found[1], section, 32).gap
    """
    part = (np.arange(count) + 0.5) / count
    if attractor.kind is AttractorKind.REST:
        zero = np.zeros(count)
        return Instants(part, math.tau * part, zero, zero)
    begin, phase, speed, total = _segments(attractor, section)
    time = total * part
    own = np.searchsorted(begin, time, side="right") - 1
    since = time - begin[own]
    forcing, tau = section.axial_forcing, phase[own]
    height = forcing * (np.sin(tau) - np.sin(tau + since) + since * np.cos(tau))
    gap = height + speed[own] * since - since**2 / math.tau
    rate = speed[own] - since / math.pi - forcing * (np.cos(tau + since) - np.cos(tau))
    contact = np.isnan(speed[own])
    gap, rate = np.where(contact, 0.0, np.maximum(gap, 0.0)), np.where(contact, 0.0, rate)
    return Instants(part, (tau + since) % math.tau, gap, rate)


def impact_limits(attractor: Attractor, section: NextCollisionMap) -> Instants:
    """The states just before and just after each of the first LIMITS impacts of an attractor."""
    phase = attractor.forcing_phases[:LIMITS]
    w = attractor.velocities[:LIMITS]
    none = np.full(2 * len(phase), math.nan)
    speeds = np.concatenate((w, rebounded(w, section.restitution)))
    return Instants(none, np.tile(phase, 2), np.zeros(2 * len(phase)), speeds)


def _segments(attractor: Attractor, section: NextCollisionMap) -> tuple[Array, Array, Array, float]:
    """Begin, phase and relative speed of each flight (nan: contact), and the whole time."""
    phases = attractor.forcing_phases[:MOST_IMPACTS]
    speeds = rebounded(attractor.velocities[:MOST_IMPACTS], section.restitution)
    if not attractor.chatters:
        delays = _delays(phases, speeds, section)
        begin = np.concatenate(([0.0], np.cumsum(delays)))
        return begin[:-1], phases, speeds, float(begin[-1])
    leave = math.asin(1.0 / (math.pi * section.axial_forcing))
    first = _delays(np.array([leave]), np.array([0.0]), section)
    delays = np.concatenate((first, _delays(phases[:-1], speeds[:-1], section)))
    begin = np.concatenate(([0.0], np.cumsum(delays)))
    # after the last impact that is resolved: the rest of the chatter and contact, to separation
    rest = (leave - float(phases[-1])) % math.tau
    launched = np.concatenate(([0.0], speeds[:-1], [math.nan]))
    starts = np.concatenate(([leave], phases))
    return begin, starts, launched, float(begin[-1]) + rest


def _delays(phases: Array, speeds: Array, section: NextCollisionMap) -> Array:
    """Times of the flights launched at these phases with these relative speeds."""
    flights = np.stack((phases, np.zeros(len(phases)), speeds), axis=1)
    out = np.empty((len(phases), 3))
    at_rest = speeds == 0.0
    if at_rest.any():  # from separation: the gap grows with the third power of time
        flights[at_rest, 0] += _AWAY
        flights[at_rest, 1], flights[at_rest, 2] = _after_separation(section, phases[at_rest])
    land_from_height(np.ascontiguousarray(flights), section.axial_forcing, out)
    return np.asarray(out[:, 2] + np.where(at_rest, _AWAY, 0.0))


_AWAY = 1e-3


def _after_separation(section: NextCollisionMap, phases: Array) -> tuple[Array, Array]:
    """Gap and relative speed _AWAY after separation."""
    forcing = section.axial_forcing
    gap = forcing * (np.sin(phases) + _AWAY * np.cos(phases) - np.sin(phases + _AWAY))
    speed = forcing * (np.cos(phases) - np.cos(phases + _AWAY)) - _AWAY / math.pi
    return gap - _AWAY**2 / math.tau, speed

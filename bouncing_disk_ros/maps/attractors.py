"""Attractors of the axial next-collision map, found from many starts; none is given beforehand.

All contact ends at separation, sin τ_sep = 1/(πΓ), with no gap and no relative speed (paper, eq.
3): every orbit that comes to contact goes on as one and the same orbit. So there is at most one
attractor that holds a complete chatter, and that orbit decides where all chattering starts end.
"""

from __future__ import annotations

import math
from enum import StrEnum
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.angles import wrap_to_pi
from bouncing_disk_ros.errors import InputError, counted
from bouncing_disk_ros.maps.axial_map import (
    MAP_CONTACT,
    ORBIT_DELAY,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
    axial_orbit,
)
from bouncing_disk_ros.maps.map_tangent import LARGEST_ERROR, largest_error

Floats = NDArray[np.float64]

LOWEST = 1.5 * math.pi
"""Forcing phase (rad) at which a disk that is in contact is begun with: the lowest point."""
SAME = 1e-6
"""Orbits nearer than this to each other are one."""
CELLS = 128
"""A chaotic attractor is known by the cells it visits of CELLS × CELLS over all τ and its w ..."""
SHARED = 0.5
"""Two chaotic orbits are one attractor when the second has more than this part of its visits on the
cells of the first."""


class AttractorKind(StrEnum):
    """Kind of an attractor."""

    REST = "rest"  # contact for good, Γ ≤ 1/π
    CHATTERING = "chattering"  # comes to contact, and separates, in every repetition
    PERIODIC = "periodic"  # single impacts that repeat
    CHAOTIC = "chaotic"


def attractor_name(kind: AttractorKind, impacts: int, cycles: int) -> str:
    """What an attractor is called: rest, chattering, chaotic, period-2, period-2 in 1 cycle."""
    if kind is not AttractorKind.PERIODIC:
        return str(kind)
    name = f"period-{impacts}"
    return name if impacts == cycles else f"{name} in {cycles} cycle{'s' if cycles > 1 else ''}"


class Attractor(NamedTuple):
    """An attractor; arrays hold one repetition (chaotic: a long piece of an orbit)."""

    kind: AttractorKind
    forcing_phases: Floats  # (n,) τ of the impacts, rad; chattering: from the first after contact
    velocities: Floats  # (n,) w_A of them, πg/ω
    cycles: int  # periods of the platform in one repetition; 0: chaotic, rest, or not known
    multiplier: float  # largest modulus of the Floquet multipliers; chaotic: exp of the exponent

    def __repr__(self) -> str:
        """The name, and the modulus of the largest multiplier where there is one."""
        size = "" if math.isnan(self.multiplier) else f", |multiplier| {self.multiplier:.6g}"
        return f"<attractor {self.name}{size}>"

    @property
    def chatters(self) -> bool:
        """Whether it holds a complete chatter."""
        return self.kind is AttractorKind.CHATTERING

    @property
    def name(self) -> str:
        """As people say it: period-1, chattering (3 cycles), chaotic, rest.

        Chattering with cycles not known: rounding decides how long it is from contact to contact.
        """
        name = attractor_name(self.kind, len(self.forcing_phases), self.cycles)
        if not self.chatters:
            return name
        return f"{name} ({counted(self.cycles, 'cycle') if self.cycles else 'cycles not known'})"


class Attractors(NamedTuple):
    """The attractors of one (Γ, ε); labels of basins are indices into `found`."""

    found: tuple[Attractor, ...]
    after_contact: int  # where an orbit that came to contact ends; −1: not known
    unresolved: int  # starts whose end was not understood


def rounding_decides(rows: Floats, axial_forcing: float, restitution: float) -> bool:
    """Whether roundings decide how an orbit goes on from its first impact to its last one.

    rows (n, ≥ 3): τ, w and the delay since the impact before, of impacts without contact between
    them (columns of `axial_orbit`).
    """
    state, arrival = [ORBIT_TAU, ORBIT_W], [ORBIT_DELAY, ORBIT_W]
    flights = np.ascontiguousarray(np.hstack([rows[:-1, state], rows[1:, arrival]]))
    return bool(largest_error(flights, axial_forcing, restitution) > LARGEST_ERROR)


@lru_cache(4096)
def contact_is_forgotten(axial_forcing: float, restitution: float, impacts: int) -> bool:
    """Whether roundings decide how the orbit from contact goes on, in so many impacts at most.

    Up to the next contact. Where contact comes again, its speed is then that of one of many orbits.
    """
    rows = np.empty((impacts, 4))
    rows = rows[: axial_orbit(LOWEST, 0.0, axial_forcing, restitution, impacts, rows)]
    ends = np.flatnonzero(rows[1:, ORBIT_KIND] == MAP_CONTACT)
    return rounding_decides(rows[: int(ends[0]) + 1 if len(ends) else None], axial_forcing,
                            restitution)  # fmt: skip


def separation(first: Floats, second: Floats) -> Floats:
    """Largest difference of τ (angular distance) and w of each state (n, 2) and its partner."""
    phase = np.abs(wrap_to_pi(first[:, 0] - second[:, 0]))
    return np.maximum(phase, np.abs(first[:, 1] - second[:, 1]))


def distance(first: Floats, second: Floats) -> float:
    """Largest `separation` along two pieces of orbits of one length."""
    return float(np.max(separation(first, second)))


def same(first: Attractor, second: Attractor) -> bool:
    """Whether two attractors of one kind are the same."""
    if first.kind is AttractorKind.CHAOTIC:
        return bool(Cells(first).hold(second.forcing_phases, second.velocities).mean() > SHARED)
    if len(first.forcing_phases) != len(second.forcing_phases):
        return False
    if not len(first.forcing_phases):
        return True
    pair = [np.stack((a.forcing_phases, a.velocities), axis=1) for a in (first, second)]
    return distance(*pair) < SAME


class Cells:
    """The cells of a grid that a chaotic attractor visits."""

    def __init__(self, attractor: Attractor) -> None:
        self._low = float(attractor.velocities.min())
        self._visited = np.zeros((CELLS, CELLS), bool)
        self._visited[self._place(attractor.forcing_phases, attractor.velocities)] = True

    def _place(self, tau: Floats, w: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        row = np.clip(w / self._low * CELLS, 0, CELLS - 1).astype(np.intp)
        return row, (tau / math.tau * CELLS).astype(np.intp) % CELLS

    def hold(self, tau: Floats, w: Floats) -> NDArray[np.bool_]:
        """Which states (τ, w) lie on visited cells."""
        visited: NDArray[np.bool_] = self._visited[self._place(tau, w)]
        return visited


def refuse_conservative(restitution: float) -> None:
    """InputError at ε = 1: the map keeps areas there and has no attractors."""
    if restitution == 1.0:
        hint = "At 1 the map keeps areas: it has no attractors, and so no basins."
        raise InputError("restitution", restitution, "less than 1", hint)


def numbered(names: list[str]) -> list[str]:
    """The names, those that occur more than once with a number."""
    seen: dict[str, int] = {}
    found = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        found.append(f"{name} #{seen[name]}" if names.count(name) > 1 else name)
    return found

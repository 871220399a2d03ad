"""Orbits by name, as controllers aim at them: the period-1 orbit and the periodic attractors."""

from __future__ import annotations

import math

import numpy as np

from bouncing_disk_ros.analysis.dynamics.attractor_search import find_attractors
from bouncing_disk_ros.analysis.dynamics.attractors import AttractorKind
from bouncing_disk_ros.analysis.dynamics.next_collision import NextCollisionMap
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.loop_settings import Array, period_one_points, sines_and_cosines

OWN = "period-1"
"""The orbit that needs no search, for it has a closed form; stable or not."""
SLOWEST = -5.0
"""w_A, πg/ω, of the fastest impacts that attractors are looked for from."""
_HIGHEST, _SEARCHED = -0.05, 12


def orbit_named(
    name: str, axial_forcing: float, restitution: float, *, field: str = "target",
    others: tuple[str, ...] = (), lowest: float = SLOWEST,
) -> Array:  # fmt: skip
    """Points (n, 2) of an orbit: forcing phase and velocity after each impact, πg/ω.

    `name`: period-1, or a periodic attractor at (Γ, ε) as `basins` names it. Raises InputError with
    the names there are; `others`: names besides that the caller takes.
    """
    if name == OWN:
        return period_one_points(axial_forcing, restitution)
    steps = range(_SEARCHED)
    phases = [math.tau * k / _SEARCHED for k in steps]
    speeds = [lowest + (_HIGHEST - lowest) * k / (_SEARCHED - 1) for k in steps]
    starts = [(tau, w) for w in speeds for tau in phases]
    found = find_attractors(NextCollisionMap(axial_forcing, restitution), starts).found
    periodic = {one.name: one for one in found if one.kind is AttractorKind.PERIODIC}
    if name not in periodic:
        allowed = ", ".join(dict.fromkeys((*others, OWN, *periodic)))
        at = f"Attractors at axial_forcing {axial_forcing:g} without contact are meant."
        raise InputError(field, name, allowed, at)
    tau, w = np.array(periodic[name].forcing_phases), np.array(periodic[name].velocities)
    _, cosine = sines_and_cosines(tau)
    return np.array([tau, axial_forcing * cosine - restitution * w]).T.copy()

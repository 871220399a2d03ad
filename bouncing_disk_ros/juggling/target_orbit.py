"""Orbits by name, as controllers aim at them, and the rotation of the disk on them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.kernels.strategies import arc_cosine
from bouncing_disk_ros.juggling.loop_settings import Array, period_one_points, sines_and_cosines
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import AttractorKind
from bouncing_disk_ros.maps.next_collision import NextCollisionMap

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


# ------------------------------------------------------------------------------------------------
# Rotation of the disk on a periodic orbit: the phase lag that turns it fastest, and its speed.
#
# After an impact that removes all slip the disk turns as the platform does then, α̇ = ωΦ cos(τ +
# θ) (eq. 4 of Liu, Friend, Yeo, EPL 2009); on the period-1 orbit θ = −τ_imp gives ωΦ.


def flight_times(orbit: Array, axial_forcing: float) -> Array:
    """Times of flight, rad, after each point (forcing phase, velocity after in πg/ω) of an orbit.

    Each flight ends at the height of the platform at the next point, on its way down, or up where
    the platform overtakes the disk: which of both its forcing phase tells.
    """
    sine, _ = sines_and_cosines(orbit[:, 0])
    heights, phases = (axial_forcing * sine).tolist(), orbit[:, 0].tolist()
    times = []
    for i, v in enumerate(orbit[:, 1].tolist()):
        j = (i + 1) % len(orbit)
        root = math.sqrt(max(v * v + 2.0 * (heights[i] - heights[j]) / math.pi, 0.0))
        late, early = math.pi * (v + root), math.pi * (v - root)
        off = [abs(math.remainder(t - phases[j] + phases[i], math.tau)) for t in (late, early)]
        times.append(early if early > 0.0 and off[1] < off[0] else late)
    return np.array(times)


def best_phase_lag(orbit: Array, axial_forcing: float) -> float:
    """θ in (−π, π] with the largest mean of α̇ on an orbit whose impacts remove all slip."""
    if len(orbit) == 1:
        return -math.remainder(float(orbit[0, 0]), math.tau)
    times = flight_times(orbit, axial_forcing)
    sine, cosine = sines_and_cosines(orbit[:, 0])
    y, x = (sum((times * part).tolist()) for part in (sine, cosine))
    size = math.sqrt(x * x + y * y)
    if size == 0.0:
        return 0.0
    angle = arc_cosine(abs(x) / size)
    angle = angle if x >= 0.0 else math.pi - angle
    return -angle if y > 0.0 else angle


def mean_rotor_speed(times: Sequence[float], speeds: Sequence[float]) -> float:
    """Mean angular velocity between the first and the last of some impacts, in the units given.

    `speeds`: just after each impact; in flight none changes without a load. nan: fewer than two.
    """
    span = times[-1] - times[0] if len(times) > 1 else 0.0
    if not span > 0.0:
        return math.nan
    turned = sum(
        speed * (end - begin)
        for speed, begin, end in zip(speeds[:-1], times[:-1], times[1:], strict=True)
    )
    return turned / span

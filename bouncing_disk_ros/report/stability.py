"""What the next-collision map, linearised, says of recorded impacts: stable cycles and chaos."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.distributions import t_quantile
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.axial_map import (
    MAP_IMPACT,
    ORBIT_DELAY,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
    axial_orbit,
)
from bouncing_disk_ros.maps.map_tangent import flight_tangents, log_growth
from bouncing_disk_ros.maps.scales import axial_forcing_of, velocity_scale
from bouncing_disk_ros.report.estimate import Estimate
from bouncing_disk_ros.report.section import single_impacts

if TYPE_CHECKING:
    from bouncing_disk_ros.maps.periodic_orbit import PeriodicOrbit

Values = NDArray[np.float64]

FOLLOWS = 1e-6
"""Rows follow the map if the flight between them closes within this (map units)."""
ROUNDING_GROWTH = -math.log(np.finfo(float).eps)
"""An orbit that stays near an unstable cycle leaves it before errors have grown e to this, 36: more
growth than that, kept up, is no slow departure."""
CONTINUED = 20_000
"""Impacts by which an orbit is continued before it is called chaotic."""
BATCHES = 20


class Path(NamedTuple):
    """Impacts that follow one another by the map, in its units."""

    tau: Values  # shape (n,)
    w: Values  # shape (n,)
    delay: Values  # from each impact to the next, shape (n − 1,)
    axial_forcing: float
    restitution: float


def path_of(rows: NDArray[np.void], motion: Motion, disk: Disk) -> Path:
    """The impacts at the end of rows (IMPACT_DTYPE) that follow the map of `motion` and `disk`.

    It begins after the last gap in the index, row of summed impacts, or flight that does not fit
    (an impulse, another motion, another restitution, errors of measurement); shape (0,) or more.
    """
    axial_forcing, e = axial_forcing_of(motion, disk), disk.restitution
    tau = rows["forcing_phase"]
    w = rows["axial_impact_velocity"] / velocity_scale(motion, disk)
    t = math.tau * np.diff(rows["cycles"]) + np.diff(tau)
    launch = axial_forcing * np.cos(tau[:-1]) - e * w[:-1]
    gap = axial_forcing * (np.sin(tau[:-1]) - np.sin(tau[1:])) + (launch - t / math.tau) * t
    slope = launch - t / math.pi - axial_forcing * np.cos(tau[1:]) - w[1:]
    single = single_impacts(rows)
    fits = (np.abs(gap) <= FOLLOWS) & (np.abs(slope) <= FOLLOWS) & (t > 0.0)
    fits &= single[:-1] & single[1:] & (np.diff(rows["index"]) == 1.0)
    breaks = np.flatnonzero(~fits)
    first = int(breaks[-1]) + 1 if len(breaks) else 0
    if len(rows) and not single[-1]:
        first = len(rows)
    return Path(tau[first:], w[first:], t[first:], axial_forcing, e)


def jacobians(path: Path) -> Values:
    """∂(τ', w')/∂(τ, w) for each flight of a path, shape (n − 1, 2, 2)."""
    flights = np.stack((path.tau[:-1], path.w[:-1], path.delay, path.w[1:]), axis=1)
    out = np.empty((len(flights), 2, 2))
    flight_tangents(flights, path.axial_forcing, path.restitution, out)
    return out


def cycle_near(path: Path, period: int) -> PeriodicOrbit | None:
    """The cycle of `period` impacts next to the last impacts of a path; None: none was reached."""
    from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
    from bouncing_disk_ros.maps.periodic_orbit import (
        periodic_orbit,  # loads more kernels
    )

    guess = MapState(float(path.tau[-period]), float(path.w[-period]))
    try:
        orbit = periodic_orbit(
            NextCollisionMap(path.axial_forcing, path.restitution), guess, period
        )
    except InputError:
        return None
    return orbit if orbit.contacts == 0 else None


def continued(path: Path, impacts: int) -> Path | None:
    """The last impact of a path and those after it; None if the disk comes to rest on the way."""
    out = np.empty((impacts, 4))
    last = float(path.tau[-1]), float(path.w[-1])
    axial_orbit(*last, path.axial_forcing, path.restitution, impacts, out)
    if np.any(out[:, ORBIT_KIND] != MAP_IMPACT):
        return None
    tau, w = (np.concatenate(([last[i]], out[:, k])) for i, k in enumerate((ORBIT_TAU, ORBIT_W)))
    return path._replace(tau=tau, w=w, delay=out[:, ORBIT_DELAY])


def chaos_of(path: Path) -> Estimate | None:
    """The largest Lyapunov exponent (per impact) of a path that is chaotic; None: not shown to be.

    Evidence is asked for three times: along the recorded impacts the exponent is positive beyond
    its uncertainty (95 %, by batches); in each half of them errors grow by more than a departure
    from an unstable cycle could show (`ROUNDING_GROWTH`); and the map continues the orbit for
    `CONTINUED` impacts, in each quarter of which the same holds and no contact occurs. A chaotic
    transient that is longer still cannot be distinguished from an attractor.
    """
    growth = log_growth(jacobians(path)) if len(path.tau) > 2 * BATCHES else np.zeros(0)
    if not _grows(growth, 2):
        return None
    exponent = exponent_of(growth)
    if exponent.low <= 0.0:
        return None
    later = continued(path, CONTINUED)
    return exponent if later is not None and _grows(log_growth(jacobians(later)), 4) else None


def exponent_of(growth: Values) -> Estimate:
    """Mean growth with its 95 % interval from the means of `BATCHES` batches."""
    means = np.array([np.mean(batch) for batch in np.array_split(growth, BATCHES)])
    wide = t_quantile(BATCHES - 1) * float(np.std(means, ddof=1)) / math.sqrt(BATCHES)
    value = float(np.mean(growth))
    return Estimate(value, value - wide, value + wide, len(growth), "")


def _grows(growth: Values, parts: int) -> bool:
    return all(np.sum(part) > ROUNDING_GROWTH for part in np.array_split(growth, parts))

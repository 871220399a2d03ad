"""A first toss that ends in the period-1 orbit: does it, and how late may it be.

From rest on the platform the pure period-1 motion leads to the chattering orbit. So a programme of
commands tosses the disk once with a helical motion (θ = 0) and changes to the final motion while
the disk is in the air; the disk must land in the basin of the period-1 orbit.
Times are seconds after the programme's start, angles rad.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.report.orbit import Orbit, orbit_of
from bouncing_disk_ros.units import NS

Programme = Sequence[tuple[float, Motion]]
"""Motions with the times (s) at which they are reached, strictly increasing."""

PERIODS_TO_SETTLE = 30
"""Periods after the last command in which an orbit must have settled."""
HELICAL = math.tan(0.2457 * math.pi)
"""L = a_e Φ/A of the toss with the largest airborne speed (paper: φ_L = 0.248π)."""


def final_orbit(programme: Programme, disk: Disk, forcing_phase: float) -> Orbit:
    """The orbit after a programme, for a disk at rest on the platform, which does not move.

    `forcing_phase` is that of the (still) platform at time 0; its frequency is the first motion's.
    """
    rest = programme[0][1]._replace(axial_amplitude=0.0, angular_amplitude=0.0)
    simulation = Simulation(rest, disk, InitialState(forcing_phase=forcing_phase))
    simulation.command([(round(time * NS), motion) for time, motion in programme])
    time, motion = programme[-1]
    rows, _ = simulation.advance(round((time + PERIODS_TO_SETTLE / motion.frequency) * NS))
    return orbit_of(rows)


def lands(programme: Programme, disk: Disk, forcing_phase: float) -> bool:
    """Whether the programme ends in the period-1 orbit."""
    return final_orbit(programme, disk, forcing_phase).is_period_one


def shifted(programme: Programme, errors: Sequence[float]) -> list[tuple[float, Motion]]:
    """The programme with an error (s) in the time of each point."""
    return [(time + error, motion) for (time, motion), error in zip(programme, errors, strict=True)]


def joint_margin(
    succeeds: Callable[[Sequence[float]], bool],
    points: int,
    step: float = 5e-3,
    limit: float = 0.25,
) -> float:
    """Largest δ (s) such that all combinations of errors in {−δ, …, −step, 0, step, …, δ} succeed.

    Each point has an error of its own: the cube of errors is looked at on its grid, shell by shell.
    """
    for k in range(round(limit / step) + 1):
        shell = (
            errors
            for errors in itertools.product(range(-k, k + 1), repeat=points)
            if max(map(abs, errors)) == k
        )
        if not all(succeeds([step * e for e in errors]) for errors in shell):
            return (k - 1) * step
    return limit

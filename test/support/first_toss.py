"""A first toss that ends in the period-1 orbit: does it, how late may it be, which is the best.

From rest on the platform the pure period-1 motion leads to the chattering orbit. So a programme of
commands tosses the disk once with a helical motion (θ = 0) and changes to the final motion while
the disk is in the air; the disk must land in the basin of the period-1 orbit.
Times are seconds after the programme's start, angles rad.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

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


class Window(NamedTuple):
    """How much earlier and later (s, both positive) something may happen and still succeed."""

    early: float
    late: float


def shifted(programme: Programme, errors: Sequence[float]) -> list[tuple[float, Motion]]:
    """The programme with an error (s) in the time of each point."""
    return [(time + error, motion) for (time, motion), error in zip(programme, errors, strict=True)]


def window(
    succeeds: Callable[[Sequence[float]], bool],
    pattern: Sequence[int],
    step: float = 1e-3,
    limit: float = 0.25,
) -> Window:
    """The interval of errors e around 0 in which `succeeds` with e · pattern, looked at every step.

    pattern (1, 1) makes all points late together, (0, 1) the second alone. Ends at the first
    failure on each side, or at `limit`.
    """

    def reach(sign: int) -> float:
        for k in range(1, round(limit / step) + 1):
            if not succeeds([sign * k * step * p for p in pattern]):
                return (k - 1) * step
        return limit

    return Window(reach(-1), reach(1))


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


class Toss(NamedTuple):
    """A first toss and what it forgives."""

    axial_amplitude: float  # m
    forcing_phase: float  # when the tossing motion is reached, rad
    margin: float  # joint_margin of the two commands, s


def toss_programme(amplitude: float, final: Motion, disk: Disk) -> list[tuple[float, Motion]]:
    """The tossing motion, reached after one period, and the final one, reached one period later."""
    period = 1.0 / final.frequency
    helical = amplitude * HELICAL / disk.friction_radius
    toss = Motion(amplitude, helical, final.frequency, 0.0)
    return [(2.0 * period, toss), (3.0 * period, final)]


def search(final: Motion, disk: Disk, amplitudes: Iterable[float], steps: int = 64) -> list[Toss]:
    """For each amplitude of the toss the phase with the widest margin; the widest of all first.

    `steps` phases of a period are tried, and errors in these steps: fewer than 128 may step over a
    thin tongue of another basin. Takes a few thousand short simulations for each amplitude.
    """
    tosses = [_best_phase(amplitude, final, disk, steps) for amplitude in amplitudes]
    return sorted(tosses, key=lambda toss: -toss.margin)


def _best_phase(amplitude: float, final: Motion, disk: Disk, steps: int) -> Toss:
    programme = toss_programme(amplitude, final, disk)
    step = 1.0 / (final.frequency * steps)

    def patience(phase: int) -> int:
        """How many steps late the second command may be, at most a period; −1: not at all."""
        for gap in range(steps + 1):
            late = shifted(programme, (0.0, gap * step))
            if not lands(late, disk, math.tau * phase / steps):
                return gap - 1
        return steps

    patient = [patience(phase) for phase in range(steps)]

    def margin(phase: int) -> int:
        """Errors up to k steps in both commands; an early second one waits for the first."""
        for k in range(steps // 2):
            if any(patient[(phase + e) % steps] < k - e for e in range(-k, k + 1)):
                return k - 1
        return steps // 2

    best = max(range(steps), key=margin)
    return Toss(amplitude, math.tau * best / steps, margin(best) * step)

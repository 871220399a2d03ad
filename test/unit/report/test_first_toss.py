"""The first toss of config/programmes lands in the period-1 orbit, and forgives what it says."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from functools import cache

import numpy as np

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.report.orbit import Orbit, orbit_of
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.run.programmes import Programme, load_programme
from bouncing_disk_ros.run.session import motion_of

REST = Motion(0.0, 0.0, 3.0, 0.0)
NS = 1e9
PERIODS_TO_SETTLE = 30


def final_orbit(
    programme: Sequence[tuple[float, Motion]], disk: Disk, forcing_phase: float
) -> Orbit:
    """The orbit after motions at times (s), for a disk at rest on a platform that does not move."""
    rest = programme[0][1]._replace(axial_amplitude=0.0, angular_amplitude=0.0)
    simulation = Simulation(rest, disk, InitialState(forcing_phase=forcing_phase))
    simulation.command([(round(time * NS), motion) for time, motion in programme])
    time, motion = programme[-1]
    rows, _ = simulation.advance(round((time + PERIODS_TO_SETTLE / motion.frequency) * NS))
    return orbit_of(rows)


@cache
def disk_and_motion() -> tuple[Disk, Motion]:
    values = parameters.complete(load_preset("pizza_multiple_toss"))
    return (
        Disk.of(values),
        motion_of(values),
    )


@cache
def file() -> Programme:
    return load_programme("first_toss_to_period_1")


def commands() -> list[tuple[float, Motion]]:
    """The toss and the change to the final motion; the rest before them does not matter."""
    return [(at_ns / NS, motion) for at_ns, motion in file().targets(REST)][1:]


def phase_at_start() -> float:
    align = file().align
    assert align is not None
    return (align.forcing_phase - math.tau * 3.0 * align.after_ns / NS) % math.tau


def succeeds(errors: Sequence[float]) -> bool:
    """Whether the toss lands in period 1 with an error (s) of the time of each point."""
    late = [(at + error, motion) for (at, motion), error in zip(commands(), errors, strict=True)]
    return final_orbit(late, disk_and_motion()[0], phase_at_start()).is_period_one


def test_any_two_errors_up_to_a_tenth_of_a_second_are_forgiven() -> None:
    """The file promises 0.105 s; at 0.12 s some fail (0.108 s on a grid of 0.65 ms)."""
    rng = np.random.default_rng(20090219)
    assert all(map(succeeds, rng.uniform(-0.105, 0.105, (100, 2))))
    corners = itertools.product((-0.12, 0.12), repeat=2)
    assert not all(map(succeeds, corners))


def test_amplitude_errors_forgiven() -> None:
    """From 10 % too small to 29 % too large (measured at 0.5 %: −10.5 % and +29.5 %)."""
    disk, _ = disk_and_motion()
    (at, toss), change = commands()
    for percent in range(-10, 30):
        wrong = toss._replace(axial_amplitude=toss.axial_amplitude * (1.0 + percent / 100.0))
        orbit = final_orbit([(at, wrong), change], disk, phase_at_start())
        assert orbit.is_period_one, percent

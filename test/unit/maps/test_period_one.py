"""Closed forms of the period-1 orbit against the paper and against the core."""

from __future__ import annotations

import math

import pytest

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.maps.scales import (
    axial_forcing_of,
    period_one,
    separation_phase,
    stability_limit,
    velocity_scale,
)
from bouncing_disk_ros.report.orbit import orbit_of

DISK = Disk(0.25, 0.5, 0.6, 0.12, 0.30 / (2 * math.sqrt(2)), 10.0)


def motion(axial_forcing: float, lag: float = 0.0, disk: Disk = DISK) -> Motion:
    g = disk.gravity + disk.preload / disk.mass
    return Motion(axial_forcing * math.pi * g / (6 * math.pi) ** 2, 1.0, 3.0, lag)


def test_the_paper_bounds_the_stable_orbit() -> None:
    assert stability_limit(0.5) == pytest.approx(0.486003, abs=5e-7)  # paper: 0.486
    assert period_one(motion(0.333), DISK) is None
    assert period_one(motion(0.334), DISK) is not None
    assert period_one(motion(0.485), DISK).stable  # type: ignore[union-attr]
    assert not period_one(motion(0.487), DISK).stable  # type: ignore[union-attr]


def test_no_orbit_on_a_platform_at_rest() -> None:
    assert period_one(Motion(0.0, 0.0, 3.0, 0.0), DISK) is None
    assert period_one(Motion(0.0, 0.0, 3.0, 0.0), DISK._replace(restitution=1.0)) is None


def test_best_phase_lag_at_the_limit_is_the_papers() -> None:
    orbit = period_one(motion(stability_limit(0.5)), DISK)
    assert orbit is not None
    assert -orbit.forcing_phase / math.pi == pytest.approx(-0.26, abs=0.005)


def test_separation_is_where_the_platform_falls_faster_than_the_disk() -> None:
    moving = motion(0.45)
    phase = separation_phase(moving, DISK)
    assert phase is not None
    omega = 6 * math.pi
    assert moving.axial_amplitude * omega**2 * math.sin(phase) == pytest.approx(10.0, rel=1e-12)
    assert separation_phase(motion(0.3), DISK) is None


@pytest.mark.parametrize("preload", [0.0, 1.5, -1.0])
def test_the_core_stays_on_the_orbit(preload: float) -> None:
    disk = DISK._replace(preload=preload)
    moving = motion(0.45, 0.3, disk)
    orbit = period_one(moving, disk)
    assert orbit is not None
    assert axial_forcing_of(moving, disk) == pytest.approx(0.45, rel=1e-12)
    start = InitialState(0.0, -velocity_scale(moving, disk), 0.0, 0.0, orbit.forcing_phase)
    simulation = Simulation(moving, disk, start)
    rows, _ = simulation.advance(20_000_000_000)
    found = orbit_of(rows, tolerance=1e-9)
    assert found.is_period_one
    assert found.forcing_phases[0] == pytest.approx(orbit.forcing_phase, abs=1e-9)
    assert found.axial_impact_velocities[0] == pytest.approx(orbit.axial_impact_velocity, rel=1e-9)
    assert rows["angular_velocity"][-1] == pytest.approx(orbit.angular_velocity, rel=1e-9)

"""Closed forms of the period-1 orbit against the paper and against the core."""

from __future__ import annotations

import math

import pytest

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.maps.scales import period_one, separation_phase, stability_limit

DISK = Disk(0.25, 0.5, 0.6, 0.12, 0.30 / (2 * math.sqrt(2)), 10.0)


def motion(axial_forcing: float, lag: float = 0.0, disk: Disk = DISK) -> Motion:
    g = disk.gravity + disk.preload / disk.mass
    return Motion(axial_forcing * math.pi * g / (6 * math.pi) ** 2, 1.0, 3.0, lag)


def test_orbit_and_separation_are_where_the_paper_has_them() -> None:
    still = Motion(0.0, 0.0, 3.0, 0.0)
    assert period_one(still, DISK) is None
    assert period_one(still, DISK._replace(restitution=1.0)) is None
    assert stability_limit(0.5) == pytest.approx(0.486003, abs=5e-7)  # paper: 0.486
    assert period_one(motion(0.333), DISK) is None
    assert period_one(motion(0.334), DISK) is not None
    assert period_one(motion(0.485), DISK).stable  # type: ignore[union-attr]
    assert not period_one(motion(0.487), DISK).stable  # type: ignore[union-attr]
    orbit = period_one(motion(stability_limit(0.5)), DISK)
    assert orbit is not None
    assert -orbit.forcing_phase / math.pi == pytest.approx(-0.26, abs=0.005)
    assert separation_phase(motion(0.3), DISK) is None
    moving = motion(0.45)
    phase = separation_phase(moving, DISK)
    assert phase is not None
    falls = moving.axial_amplitude * (6 * math.pi) ** 2 * math.sin(phase)
    assert falls == pytest.approx(10.0, rel=1e-12)

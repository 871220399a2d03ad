"""Ends of orbits: folds, grazes, and the first complete chatter of an attractor."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.grazing import EndKind, clearance, contact_onset, orbit_end
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import (
    PeriodicOrbit,
    fixed_point,
    periodic_orbit,
)


def two_impacts(axial_forcing: float) -> PeriodicOrbit:
    section = NextCollisionMap(axial_forcing, 0.5)
    return periodic_orbit(section, section.iterate(MapState(1.0, -1.3), 2000), 2)


@pytest.mark.parametrize(("cycles", "start", "limit"), [(1, 0.45, 0.3), (2, 0.8, 0.5)])
def test_the_period_1_orbit_ends_in_a_fold(cycles: int, start: float, limit: float) -> None:
    """Existence limit Γ = k(1 − ε)/(1 + ε)."""
    end = orbit_end(fixed_point(start, 0.5, cycles=cycles), "axial_forcing", limit)
    assert end.kind is EndKind.FOLD
    assert end.value == pytest.approx(cycles / 3, abs=1e-9)
    end = orbit_end(fixed_point(start, 0.5, cycles=cycles), "restitution", 0.1)
    exact = (cycles - start) / (cycles + start)
    assert end.kind is EndKind.FOLD
    assert end.value == pytest.approx(exact, abs=1e-9)


def test_an_orbit_ends_where_it_grazes_the_platform() -> None:
    """The gap of one flight has a double zero there, and the orbit is not found beyond."""
    end = orbit_end(two_impacts(0.5), "axial_forcing", 3.0)
    assert end.kind is EndKind.GRAZE
    assert end.error < 1e-12
    assert clearance(end.orbit) < 1e-11
    section, impacts = end.orbit.map, end.orbit.map.orbit(end.orbit.state, 2)
    dips = []
    starts = zip(
        end.orbit.forcing_phase, end.orbit.axial_impact_velocity, impacts.delay, strict=True
    )
    for tau, w, delay in starts:
        x = np.linspace(0.0, delay, 200_001)[2000:-2000]
        rise = np.sin(tau + x) - np.sin(tau) - x * math.cos(tau)
        dips.append(np.min(-0.5 * w * x - x * x / math.tau - section.axial_forcing * rise))
    assert min(dips) == pytest.approx(0.0, abs=1e-8)


def test_clearance_falls_to_zero_evenly() -> None:
    """On the way to the graze the clearance is smooth: no orbit near it is missed."""
    end = orbit_end(two_impacts(0.5), "axial_forcing", 3.0).value
    assert orbit_end(two_impacts(0.5), "axial_forcing", end - 1e-3).kind is EndKind.LIMIT
    near = [
        clearance(orbit_end(two_impacts(0.5), "axial_forcing", end - d).orbit) for d in (1e-3, 5e-4)
    ]
    assert near[0] / near[1] == pytest.approx(2.0, rel=0.05)


def test_without_dips_there_is_no_graze() -> None:
    assert clearance(fixed_point(0.34, 0.5)) == math.inf
    assert orbit_end(fixed_point(0.45, 0.5), "axial_forcing", 0.55).kind is EndKind.LIMIT


def test_the_chaotic_attractor_begins_to_chatter() -> None:
    section = NextCollisionMap(0.55, 0.5)
    start = section.iterate(MapState(0.8, -1.3), 1000)
    onset = contact_onset(section, "axial_forcing", 0.58, start, impacts=50_000, digits=1e-5)
    assert onset is not None
    assert 0.0 < onset.value - onset.without <= 1e-5
    after = NextCollisionMap(onset.value + 1e-3, 0.5).orbit(start, 50_000)
    assert after.contact.any()
    before = NextCollisionMap(onset.without - 1e-3, 0.5).orbit(start, 50_000)
    assert not before.contact.any()
    assert contact_onset(section, "axial_forcing", 0.552, start, impacts=5000) is None


def test_faults_are_said() -> None:
    section = NextCollisionMap(0.34, 0.5)
    with pytest.raises(InputError, match="holds no contact"):
        contact_onset(section, "axial_forcing", 0.4, MapState(1.0, -0.01))
    with pytest.raises(InputError, match=r"limit: got 0\.45"):
        orbit_end(fixed_point(0.45, 0.5), "axial_forcing", 0.45)
    with pytest.raises(InputError, match="axis: got 'phase_lag'"):
        orbit_end(fixed_point(0.45, 0.5), "phase_lag", 0.5)
    after = section.orbit(MapState(1.0, -0.01), 500)
    rides = np.flatnonzero(after.contact)
    start = MapState(*(float(a[rides[-1]]) for a in after[:3]))
    orbit = periodic_orbit(section, start, int(rides[-1] - rides[-2]))
    with pytest.raises(InputError, match="orbit: got '1 phases of contact"):
        orbit_end(orbit, "axial_forcing", 0.5)

"""Points of doubling: against closed form, direct iteration, Feigenbaum's constant."""

from __future__ import annotations

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.bifurcations import (
    FEIGENBAUM,
    Doubling,
    contact_onset,
    feigenbaum_ratios,
    moved,
    period_doublings,
)
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.maps.period_one import stability_limit
from bouncing_disk_ros.maps.periodic_orbit import fixed_point


@pytest.fixture(scope="module")
def cascade() -> list[Doubling]:
    return period_doublings(fixed_point(0.335, 0.5), "axial_forcing", 0.6)


def test_the_first_doubling_is_the_papers_formula(cascade: list[Doubling]) -> None:
    assert cascade[0].value == pytest.approx(stability_limit(0.5), abs=1e-15)
    assert [point.impacts for point in cascade] == [1, 2, 4, 8, 16]
    assert [point.orbit.cycles for point in cascade] == [1, 2, 4, 8, 16]


def test_the_ratios_tend_to_feigenbaums_constant(cascade: list[Doubling]) -> None:
    ratios = feigenbaum_ratios([point.value for point in cascade])
    np.testing.assert_allclose(ratios, [4.73, 4.63, 4.65], atol=0.005)
    assert abs(ratios[-1] - FEIGENBAUM) < 0.02


def test_doublings_along_the_restitution() -> None:
    """At fixed Γ the period-1 orbit doubles where Γ₁(ε) = Γ."""
    points = period_doublings(fixed_point(0.45, 0.45), "restitution", 0.9, 4)
    assert stability_limit(points[0].value) == pytest.approx(0.45, abs=1e-14)
    values = [point.value for point in points]
    assert values == sorted(values)
    assert feigenbaum_ratios(values)[-1] == pytest.approx(FEIGENBAUM, rel=0.03)


def test_downward_there_is_no_doubling() -> None:
    assert period_doublings(fixed_point(0.45, 0.5), "axial_forcing", 0.34) == []
    assert period_doublings(fixed_point(0.45, 0.5), "axial_forcing", 0.1) == []  # past the fold
    assert len(period_doublings(fixed_point(0.45, 0.5), "axial_forcing", 0.5)) == 1


def test_an_orbit_moves_along_a_parameter() -> None:
    orbit = moved(fixed_point(0.4, 0.5, 0.0, 10.0), "axial_forcing", 0.43)
    expected = fixed_point(0.43, 0.5, 0.0, 10.0)
    assert orbit.forcing_phase[0] == pytest.approx(expected.forcing_phase[0], abs=1e-13)
    assert orbit.mean_speed == pytest.approx(expected.mean_speed, abs=1e-12)
    orbit = moved(fixed_point(0.4, 0.5), "restitution", 0.47)
    expected = fixed_point(0.4, 0.47)
    assert orbit.axial_impact_velocity[0] == pytest.approx(
        expected.axial_impact_velocity[0], abs=1e-13
    )


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
    with pytest.raises(InputError, match="holds no contact"):
        contact_onset(NextCollisionMap(0.34, 0.5), "axial_forcing", 0.4, MapState(1.0, -0.01))


def test_faults_are_said() -> None:
    orbit = fixed_point(0.45, 0.5)
    with pytest.raises(
        InputError, match="axis: got 'phase_lag', allowed: axial_forcing or restitution"
    ):
        period_doublings(orbit, "phase_lag", 1.0)
    with pytest.raises(InputError, match=r"limit: got 0\.45"):
        period_doublings(orbit, "axial_forcing", 0.45)
    with pytest.raises(InputError, match="count: got 0"):
        period_doublings(orbit, "axial_forcing", 0.6, 0)
    with pytest.raises(InputError, match=r"orbit: got .*magnitude 1\.17.*allowed: a stable orbit"):
        period_doublings(fixed_point(0.5, 0.5), "axial_forcing", 0.6)

"""Mean speeds that friction settles: eq. 4 on the period-1 orbit, a simulation after a chatter."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import AttractorKind
from bouncing_disk_ros.maps.best_lag import best_lag
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.settled_speed import repeated_speed, settled_speeds

STARTS = [(x, -y) for x in np.linspace(0.0, 6.0, 6) for y in (0.3, 1.3, 2.9)]
FORCINGS = (1e-3, 1.0, 100.0, 1e5, 1e12)


@pytest.mark.parametrize("angular_forcing", FORCINGS)
def test_the_period_one_orbit_has_the_speed_of_equation_4(angular_forcing: float) -> None:
    """However weak friction is, and whatever the disk starts with; the best lag is −τ_imp."""
    section = NextCollisionMap(0.45, 0.5, 0.3, angular_forcing)
    known = find_attractors(section, STARTS)
    one = [a.kind for a in known.found].index(AttractorKind.PERIODIC)
    phase = math.acos(1.0 / 3.0 / 0.45)
    found = settled_speeds(known, section, np.array([0.0, 1.0, -2.5, 1e3]))
    np.testing.assert_allclose(found[:, one], math.cos(phase + 0.3), rtol=1e-12)
    best = best_lag(known.found[one], section)
    assert best.mean_speed == pytest.approx(1.0, abs=1e-12)
    assert best.phase_lag == pytest.approx(-phase, abs=1e-7)  # a maximum is flat


def test_frictions_that_cancel_keep_the_speed_of_the_start() -> None:
    def repetition(speed: float) -> float:
        for own in (-0.5, 0.5):
            speed = min(max(own, speed - 0.125), speed + 0.125)
        return speed

    found = [repeated_speed(repetition, start) for start in (-2.0, -0.25, 0.0, 0.125, 0.75)]
    assert found == pytest.approx([-0.375, -0.25, 0.0, 0.125, 0.5], abs=1e-15)


@pytest.mark.parametrize("angular_forcing", [0.5, 3.63, 200.0])
def test_contact_after_a_chatter_has_the_speed_of_the_simulation(angular_forcing: float) -> None:
    """Friction decides later than the axial map how a chatter ends: it has more impacts then."""
    given = (0.379, 0.67, -3.26, angular_forcing)
    known = find_attractors(NextCollisionMap(*given), STARTS)
    assert known.found[0].name == "chattering (1 cycle)"
    run = Simulation(
        Motion(given[0], 1.0, 1.0 / math.tau, given[2]),
        Disk(1.0, given[1], 1.0 / angular_forcing, 1.0, 1.0, 1.0 / math.pi),
        InitialState(),
    )
    angles = []
    for k in (3000, 3001):
        run.advance(round(k * math.tau * 1e9))
        angles.append(run.sample().unwrapped_angle)
    expected = (angles[1] - angles[0]) / math.tau
    found = settled_speeds(known, NextCollisionMap(*given), np.zeros(1))[0, 0]
    assert found == pytest.approx(expected, abs=1e-8)  # instants are whole nanoseconds


@pytest.mark.parametrize("axial_forcing", [0.2, 0.6])
def test_rest_and_what_roundings_decide_have_no_speed(axial_forcing: float) -> None:
    """At 0.6 they decide how long it is from contact to contact."""
    section = NextCollisionMap(axial_forcing, 0.5, 0.0, 10.0)
    known = find_attractors(section, STARTS)
    assert [one.cycles for one in known.found] == [0]
    assert np.isnan(settled_speeds(known, section, np.zeros(2))).all()

"""What is settled on: orbits that closed forms and a search know."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import AttractorKind
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.parameter_plane import (
    KEPT,
    PERIODIC,
    Settled,
    settle_states,
    start_states,
)
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.maps.settled_speed import settled_speed

Floats = NDArray[np.float64]


def plane(axial_forcing: list[float], restitution: float = 0.5) -> Floats:
    return np.array([[one, restitution, -0.3, 50.0] for one in axial_forcing])


def settled(parameters: Floats, start: str = "period-1") -> Settled:
    return settle_states(parameters, start_states(parameters, start), 5000, 1024)


@pytest.mark.parametrize(("axial_forcing", "start"), [(0.5, "period-1"), (0.4, "contact")])
def test_mean_speeds_are_over_whole_repetitions(axial_forcing: float, start: str) -> None:
    """Half of 1098 impacts are no whole number of them: period 2, and 18 impacts with contact."""
    parameters = plane([axial_forcing])
    parameters[:, 3] = 2.0  # so that the speed has settled
    found = settle_states(parameters, start_states(parameters, start), 5000, 1098)
    assert 549 % int(found.period[0])
    section = NextCollisionMap(*parameters[0].tolist())
    kind = AttractorKind.CHATTERING if start == "contact" else AttractorKind.PERIODIC
    known = find_attractors(section, [(1.0, -1.3)]).found
    one = next(each for each in known if each.kind is kind)
    assert found.mean_speed[0] == pytest.approx(settled_speed(one, section), abs=1e-12)
    assert abs(found.mean_speed_change[0]) < 1e-12


def test_an_orbit_of_one_impact_in_two_cycles() -> None:
    parameters = plane([0.7])
    orbit = fixed_point(0.7, 0.5, -0.3, 50.0, cycles=2)
    states = start_states(parameters, "given", orbit.state[0] + 1e-4, orbit.state[1])
    found = settle_states(parameters, states, 2000, 2 * KEPT)
    assert (found.kind[0], found.period[0], found.cycles[0]) == (PERIODIC, 1, 2)
    assert found.mean_speed[0] == pytest.approx(orbit.mean_speed, abs=1e-9)


def test_faults_are_said() -> None:
    parameters = plane([0.4])
    states = start_states(parameters)
    with pytest.raises(InputError, match="measured: got 255, allowed: a whole number >= 256"):
        settle_states(parameters, states, 0, 255)
    with pytest.raises(InputError, match="settling: got -1, allowed: a whole number >= 0"):
        settle_states(parameters, states, -1, 300)

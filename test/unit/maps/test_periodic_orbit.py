"""Periodic orbits: closed forms, multipliers, the speed that friction settles at."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import AttractorKind
from bouncing_disk_ros.maps.best_lag import best_lag
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap, spread_starts
from bouncing_disk_ros.maps.periodic_orbit import fixed_point, periodic_orbit
from bouncing_disk_ros.maps.settled_speed import repeated_speed, settled_speed, settled_speeds
from support.checks import refused


def test_friction_settles_the_speed() -> None:
    """Against plain iteration; weak friction: the multiplier of the speed is 0, for one sticks."""
    section = NextCollisionMap(0.5, 0.5, 0.3, 100.0)
    settled = section.iterate(MapState(1.0, -1.3), 4000)
    orbit = periodic_orbit(section, settled, 2)
    impacts = section.orbit(orbit.state, 2)
    assert orbit.angular_multiplier == 0.0
    assert orbit.angular_impact_velocity[0] == pytest.approx(settled[2], abs=1e-12)
    mean = impacts.turned.sum() / impacts.delay.sum()
    assert orbit.mean_speed == pytest.approx(mean, abs=1e-12)
    free = periodic_orbit(NextCollisionMap(0.5, 0.5), settled, 2)
    assert math.isnan(free.mean_speed)
    assert math.isnan(free.angular_multiplier)
    assert free.state.angular_impact_velocity == 0.0


def test_an_orbit_with_contact_forgets_at_once() -> None:
    section = NextCollisionMap(0.34, 0.5, 0.0, 10.0)
    after = section.orbit(MapState(1.0, -0.01), 20_000)
    rides = np.flatnonzero(after.contact)
    n = int(rides[-1] - rides[-2])
    start = MapState(*(float(a[rides[-1]]) for a in after[:3]))
    orbit = periodic_orbit(section, start, n)
    assert orbit.contacts == 1
    assert orbit.multipliers == (0.0, 0.0)
    assert orbit.stable
    assert orbit.lyapunov_exponent == -math.inf
    assert orbit.mean_speed == pytest.approx(
        after.turned[rides[-2] + 1 : rides[-1] + 1].sum()
        / after.delay[rides[-2] + 1 : rides[-1] + 1].sum(),
        abs=1e-12,
    )


def test_no_orbit_is_said_so_and_huge_derivatives_end_the_search_without_a_warning() -> None:
    """Along 59 impacts of the chaotic path at the end the determinant is beyond 1e308."""
    refused(r"axial_forcing: got 0\.333, allowed: at least .* 0\.333333", fixed_point, 0.333, 0.5)
    with pytest.raises(InputError, match=r"guess: .*repeats after 3 impacts.*start closer"):
        periodic_orbit(NextCollisionMap(0.4, 0.5), MapState(3.0, -0.1), 3)
    refused("impacts: got 0", periodic_orbit, NextCollisionMap(0.4, 0.5), MapState(1.0, -1.0), 0)
    refused(r"1/π", periodic_orbit, NextCollisionMap(0.3, 0.5), MapState(1.0, -1.0), 100)
    section = NextCollisionMap(112.23431736769946, 0.9948156682894955)
    with pytest.raises(InputError, match="repeats after 59 impacts"):
        periodic_orbit(section, MapState(6.131095269819748, -5.404601558117878e-07), 59)


@pytest.mark.parametrize("angular_forcing", [1.0, 1e4, 3e7, 1e10, 1e12])
def test_however_weak_friction_is_one_impact_sticks(angular_forcing: float) -> None:
    """The speed of period 1 is that of the platform at its impact; period 2 has a harder impact."""
    one = fixed_point(0.45, 0.5, 0.3, angular_forcing)
    assert one.angular_multiplier == 0.0
    assert one.mean_speed == pytest.approx(math.cos(one.state.forcing_phase + 0.3), abs=1e-13)
    section = NextCollisionMap(0.5, 0.5, 0.3, angular_forcing)
    two = periodic_orbit(section, section.iterate(MapState(1.0, -1.3), 4000), 2)
    assert two.angular_multiplier == 0.0


def test_a_speed_that_roundings_hide_is_not_known() -> None:
    orbit = fixed_point(0.45, 0.5, 0.3, 1e18)
    assert math.isnan(orbit.mean_speed)
    assert math.isnan(orbit.angular_multiplier)
    known = find_attractors(orbit.map, [(0.7, -1.3)]).found
    assert all(math.isnan(settled_speed(one, orbit.map)) for one in known)


# --- settled speeds -------------------------------------------------------------------------------
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


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: NextCollisionMap(10**400, 0.5),
        lambda: fixed_point(0.45, 0.5, cycles=0),
        lambda: fixed_point(0.45, 0.5, cycles="1"),  # type: ignore[arg-type]
        lambda: periodic_orbit(NextCollisionMap(0.45, 0.5), MapState(0.9, -1.3), 1.0),  # type: ignore[arg-type]
        lambda: spread_starts(2.5, -5.0),  # type: ignore[arg-type]
        lambda: spread_starts(5, "-5"),  # type: ignore[arg-type]
        lambda: find_attractors(NextCollisionMap(0.45, 0.5), None),  # type: ignore[arg-type]
    ],
)
def test_what_is_no_number_of_a_map_is_refused(wrong: Callable[[], object]) -> None:
    """These were tracebacks."""
    with pytest.raises(InputError):
        wrong()

"""Fatal impulses, timing errors and times: against the stepper of the node, from both sides."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros import simulate
from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind, Attractors
from bouncing_disk_ros.maps.next_collision import NextCollisionMap, spread_starts
from bouncing_disk_ros.maps.window_basins import IN_CONTACT, label_window, window_axes
from bouncing_disk_ros.orbit_studies.fatal_changes import (
    LOST,
    SURVIVED,
    UNDECIDED,
    FatalRule,
    fatal_impulses,
    fatal_timing_errors,
    fates,
)
from bouncing_disk_ros.orbit_studies.orbit_instants import Instants, instants_of
from bouncing_disk_ros.orbit_studies.resilience.measures import _share_in_time
from reference.cases import examples
from support.checks import refused
from support.studied import Start, on_orbit_since, seen

FREQUENCY, GRAVITY, MASS = 3.0, 10.0, 0.25
OMEGA = math.tau * FREQUENCY
SPEED = math.pi * GRAVITY / OMEGA
"""The unit of velocity in m/s."""
PERIODS = 150
"""The stepper is given so many periods: period 1 is then reached to rounding, if at all."""


def attractors(section: NextCollisionMap) -> Attractors:
    starts = [(s.forcing_phase, s.axial_impact_velocity) for s in spread_starts(150, -5.0)]
    return find_attractors(section, starts)


def period_one(axial_forcing: float, e: float = 0.5) -> tuple[NextCollisionMap, Attractors, int]:
    section = NextCollisionMap(axial_forcing, e)
    known = attractors(section)
    kinds = [len(a.forcing_phases) == a.cycles == 1 and a.kind is AttractorKind.PERIODIC
             for a in known.found]  # fmt: skip
    return section, known, kinds.index(True)


def ends_on_period_one(
    section: NextCollisionMap, orbit: Attractor, part: float, size: float
) -> bool:
    """By the stepper: start just before an impact, an impulse at a part of the first period."""
    tau, w = float(orbit.forcing_phases[0]), float(orbit.velocities[0])
    before = (w + section.axial_forcing * math.cos(tau)) * SPEED
    run = simulate(
        PERIODS / FREQUENCY,
        axial_forcing=section.axial_forcing, frequency=FREQUENCY, gravity=GRAVITY, mass=MASS,
        restitution=section.restitution, friction=0.0, initial_height=0.0,
        initial_with_platform=False, initial_axial_velocity=before, initial_forcing_phase=tau,
        impulses=[(part / FREQUENCY, size * MASS * SPEED, 0.0)],
    )  # fmt: skip
    last = run.impacts[-1]
    near = abs(math.remainder(float(last["forcing_phase"]) - tau, math.tau)) < 1e-3
    return bool(near and abs(float(last["axial_impact_velocity"]) / SPEED - w) < 1e-3)


@pytest.mark.parametrize("case", range(examples(3)))
def test_the_stepper_agrees(case: int) -> None:
    """Up to 0.999 of a fatal impulse all are survived, within 1.001 of it some is not."""
    rng = np.random.default_rng(case)
    section, known, label = period_one(float(rng.uniform(0.345, 0.47)))
    orbit = known.found[label]
    part, sense = float(rng.uniform(0.02, 0.98)), float(rng.choice([1.0, -1.0]))
    since = math.tau * part
    tau, u = float(orbit.forcing_phases[0]), -section.restitution * float(orbit.velocities[0])
    forcing = section.axial_forcing
    gap = (
        u * since
        - since**2 / math.tau
        - forcing * (math.sin(tau + since) - math.sin(tau) - since * math.cos(tau))
    )
    rate = u - since / math.pi - forcing * (math.cos(tau + since) - math.cos(tau))
    one = (np.array([v]) for v in (part, (tau + since) % math.tau, gap, rate))
    both = fatal_impulses(section, known, label, Instants(*one), FatalRule(resolution=0.002))
    least = float(both[0 if sense > 0.0 else 1, 0])
    if math.isinf(least):
        return
    for factor in (*np.linspace(0.05, 0.999, 12), 1.0 - 1e-5):
        assert ends_on_period_one(section, orbit, part, sense * least * factor)
    beyond = 1.0 + np.geomspace(1e-6, 1e-3, 6)
    assert not all(ends_on_period_one(section, orbit, part, sense * least * f) for f in beyond)


def test_a_late_impact_is_lost_where_the_window_ends() -> None:
    section, known, label = period_one(0.45)
    late, early = fatal_timing_errors(section, known, label)[:, 0]
    tau, w = (float(v[0]) for v in known.found[label][1:3])
    for size, sense in ((late, 1.0), (early, -1.0)):
        for factor, fine in ((0.999, True), (1.0 + 1e-6, False)):
            phase = tau + sense * size * factor
            speed = w + 0.45 * (math.cos(tau) - math.cos(phase))
            flights = np.array([[phase % math.tau, 0.0, speed]])
            found = fates(section, known, label, flights, 1000.0)
            assert found.tolist() == [SURVIVED if fine else LOST]


def test_rest_and_contact_have_fatal_impulses_too() -> None:
    section = NextCollisionMap(0.45, 0.5)
    known = attractors(section)
    label = known.after_contact
    assert known.found[label].kind is AttractorKind.CHATTERING
    places = instants_of(known.found[label], section, 64)
    contact = places.speed == 0.0
    assert 0.1 < contact.mean() < 0.5
    sizes = fatal_impulses(section, known, label, places)
    # in contact an impulse downwards is an impact with J, and bounces with ε J: as upwards, halved
    assert sizes[1, contact] == pytest.approx(2.0 * sizes[0, contact], rel=1e-9)
    calm = NextCollisionMap(0.2, 0.5)
    alone = attractors(calm)
    assert alone.found[0].kind is AttractorKind.REST
    assert np.isinf(fatal_impulses(calm, alone, 0, instants_of(alone.found[0], calm, 8))).all()


def test_an_orbit_is_lost_when_it_takes_too_long_not_where_that_is_not_decided() -> None:
    """The number of periods is part of the definition; where contact leads may not be known."""
    section, known, label = period_one(0.45)
    places = instants_of(known.found[label], section, 8)
    patient = fatal_impulses(section, known, label, places, FatalRule(1000.0))
    hasty = fatal_impulses(section, known, label, places, FatalRule(25.0))
    assert np.all(hasty <= patient * (1.0 + 1e-9))
    assert np.all(hasty[0] < patient[0])
    assert np.isnan(fatal_impulses(section, known, label, places, FatalRule(5.0))).all()
    assert np.isnan(fatal_timing_errors(section, known, label, FatalRule(5.0))).all()
    blind = known._replace(after_contact=-1)
    places = instants_of(known.found[label], section, 3)
    assert np.isfinite(fatal_impulses(section, known, label, places)).any()
    assert np.isnan(fatal_impulses(section, blind, label, places)).any()
    flights = np.array([[1.0, 0.0, 0.01]])  # it chatters to its end
    assert fates(section, blind, label, flights, 1000.0).tolist() == [UNDECIDED]
    assert fates(section, known, label, flights, 1000.0).tolist() == [LOST]


@pytest.mark.parametrize(
    ("rule", "text"),
    [
        (FatalRule(periods=0.0), "periods: got 0"),
        (FatalRule(largest=0.001), "largest: got 0.001"),
        (FatalRule(resolution=2.0), "resolution: got 2"),
    ],
)
def test_rules_out_of_range_are_refused(rule: FatalRule, text: str) -> None:
    section, known, label = period_one(0.45)
    refused(text, fatal_timing_errors, section, known, label, rule)


def test_chaos_that_has_every_start_is_never_lost() -> None:
    """None of its starts is missed, however seldom the cells are that it visits."""
    section = NextCollisionMap(0.95, 0.2)
    known = attractors(section)
    assert [one.kind for one in known.found] == [AttractorKind.CHAOTIC]
    rng = np.random.default_rng(10)
    n = examples(1_500)
    flights = np.stack(
        (rng.uniform(0.0, math.tau, n), np.zeros(n), rng.uniform(0.0, 2.0, n)), axis=1
    )
    assert (fates(section, known, 0, flights, 1000.0) == SURVIVED).all()
    # and no time is known at which one of them is on it
    assert np.isnan(_share_in_time(known.found[0], np.ones(n), np.array([10.0]), n)).all()


@pytest.mark.parametrize(("axial_forcing", "restitution"), [(1.2213212501882051, 0.0), (0.7, 0.3)])
def test_contact_on_the_way_to_an_orbit_takes_its_time(
    axial_forcing: float, restitution: float
) -> None:
    window = label_window(NextCollisionMap(axial_forcing, restitution), 4, -4.0)
    after = window.known.found[window.known.after_contact]
    assert after.kind is AttractorKind.PERIODIC
    points = np.stack((after.forcing_phases, after.velocities), axis=1)
    held = np.argwhere(window.labels.label == IN_CONTACT)
    assert len(held)
    tau, w = window_axes(4, -4.0)
    given = {"axial_forcing": axial_forcing, "restitution": restitution}
    for row, column in held[:4]:
        time = float(window.labels.time[row, column])
        start = Start(float(tau[column]), float(w[row]))
        run = seen(given, start, math.ceil(time / math.tau) + 40)
        reached = run.times[on_orbit_since(run, points, 1e-4) + 7]
        assert time == pytest.approx(reached, abs=1e-3)

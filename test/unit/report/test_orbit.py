"""The orbit detector: what it finds, and that it does not guess."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import IMPACT_DTYPE, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind
from bouncing_disk_ros.maps.map_tangent import log_growth
from bouncing_disk_ros.maps.period_one import stability_limit
from bouncing_disk_ros.report.orbit import UNRESOLVED, OrbitKind, orbit_of
from bouncing_disk_ros.report.stability import (
    exponent_of,
    jacobians,
    path_of,
)
from support.map_rows import DISK, map_rows, motion_of


def rows_of(phases: list[float], speeds: list[float], repeats: int) -> NDArray[np.void]:
    """Impacts that repeat, one in each cycle."""
    rows = np.zeros(len(phases) * repeats, IMPACT_DTYPE)
    rows["index"] = np.arange(len(rows))
    rows["cycles"] = np.arange(len(rows))
    rows["forcing_phase"] = np.tile(phases, repeats)
    rows["axial_impact_velocity"] = np.tile(speeds, repeats)
    rows["count"] = 1
    return rows


def test_one_chatter_is_no_orbit() -> None:
    motion = Motion(0.0, 0.0, 3.0, 0.0)
    disk = DISK._replace(restitution=0.9999)
    simulation = Simulation(motion, disk, InitialState(height=0.01, axial_velocity=0.0))
    assert orbit_of(simulation.advance(10_000_000_000)[0]) == UNRESOLVED


def test_too_few_rows() -> None:
    assert orbit_of(np.zeros(0, IMPACT_DTYPE)) == UNRESOLVED
    assert orbit_of(rows_of([0.7], [-2.2], 7)) == UNRESOLVED
    assert orbit_of(rows_of([0.7], [-2.2], 8)).is_period_one
    assert orbit_of(rows_of([0.7, 0.9, 1.2], [-2.2, -2.0, -1.0], 3)) == UNRESOLVED
    orbit = orbit_of(rows_of([0.7, 0.9, 1.2], [-2.2, -2.0, -1.0], 4))
    assert (orbit.name, orbit.impacts, orbit.cycles) == ("period-3", 3, 3)
    assert sorted(orbit.forcing_phases) == [0.7, 0.9, 1.2]
    assert sorted(orbit.axial_impact_velocities) == [-2.2, -2.0, -1.0]
    rows = rows_of([0.7], [-2.2], 20)  # a lost row counts as the beginning
    assert orbit_of(np.delete(rows, 15)) == UNRESOLVED
    assert orbit_of(np.delete(rows, 5)).is_period_one


def test_a_phase_about_zero_is_one_phase() -> None:
    rows = rows_of([0.0], [-2.2], 20)
    rows["forcing_phase"][::2] = math.tau - 1e-5  # a little early: still in the cycle before
    rows["cycles"][::2] -= 1
    assert orbit_of(rows).is_period_one


def test_names_count_impacts_and_cycles_in_plain_english() -> None:
    rows = rows_of([0.7], [-2.2], 20)
    rows["cycles"] *= 2
    orbit = orbit_of(rows)
    assert (orbit.impacts, orbit.cycles, orbit.is_period_one) == (1, 2, False)
    assert orbit.name == "period-1 in 2 cycles"
    two = Attractor(AttractorKind.PERIODIC, np.zeros(2), np.zeros(2), 1, 0.5)
    assert two.name == orbit._replace(impacts=2, cycles=1).name == "period-2 in 1 cycle"


@given(st.floats(0.0, 6.28), st.floats(0.0, 2e-3), st.integers(0, 2**32 - 1))
def test_noise_beyond_the_tolerance_is_not_called_periodic(
    phase: float, noise: float, seed: int
) -> None:
    rows = rows_of([phase], [-2.2], 40)
    shift = np.zeros(len(rows))
    shift[-5] = noise * (1.0 if seed % 2 else -1.0)
    rows["forcing_phase"] = np.clip(rows["forcing_phase"] + shift, 0.0, math.tau)
    moved = abs(float(rows["forcing_phase"][-5] - phase))
    assume(abs(moved - 1e-3) > 1e-14)  # at the tolerance itself rounding of 6 rad decides
    assert orbit_of(rows, tolerance=1e-3).is_period_one == (moved <= 1e-3)


# --- with the map --------------------------------------------------------------------------------
GAMMA_1 = stability_limit(0.5)  # 0.486003: period 1 to 2 (paper; closed form)


def told(axial_forcing: float, impacts: int, skip: int = 0, away: float = 0.02) -> tuple[str, str]:
    """The names of the orbit without and with motion and disk."""
    rows = map_rows(axial_forcing, impacts, skip, away)
    return (
        orbit_of(rows).name,
        orbit_of(rows, motion=motion_of(axial_forcing), disk=DISK).name,
    )


@pytest.mark.parametrize(
    ("axial_forcing", "name"),
    [
        (GAMMA_1 - 1e-4, "period-1"),
        (GAMMA_1 + 1e-4, "period-2"),
        (0.5398, "period-4"),  # to 8 at 0.54015
        (0.5405, "period-8"),
    ],
)
def test_cascade(axial_forcing: float, name: str) -> None:
    assert told(axial_forcing, 2000, skip=20_000) == (name, name)


@pytest.mark.parametrize(
    ("difference", "impacts", "skip"),
    [*product((-1e-3, 0.0, 1e-4), (30, 300), (0,)), (0.0, 2000, 200_000)],
)
def test_slow_transients_about_a_doubling_are_no_orbit(
    difference: float, impacts: int, skip: int
) -> None:
    """Begun 0.02 away the alternation has not died out: period-2 would be as wrong as period-1.

    At the doubling itself it never does.
    """
    assert told(GAMMA_1 + difference, impacts, skip) == ("unresolved", "unresolved")


@pytest.mark.parametrize("axial_forcing", [GAMMA_1 + 1e-8, 0.5, 0.535, 0.549])
def test_an_unstable_cycle_is_no_orbit(axial_forcing: float) -> None:
    """The first 20 impacts stay within 1e-9 of the period-1 orbit, and would leave it."""
    away = 1e-9 * (axial_forcing - GAMMA_1)
    rows = map_rows(axial_forcing, 20, away=away)
    assert orbit_of(rows, motion=motion_of(axial_forcing), disk=DISK) == UNRESOLVED


@pytest.mark.parametrize("axial_forcing", [0.5435, 0.549, 0.56])
def test_chaos_is_told_by_its_exponent(axial_forcing: float) -> None:
    rows = map_rows(axial_forcing, 2000, skip=1000)
    orbit = orbit_of(rows, motion=motion_of(axial_forcing), disk=DISK)
    assert (orbit.kind, orbit.name, orbit.impacts) == (OrbitKind.CHAOTIC, "chaotic", 0)
    assert orbit.exponent is not None
    assert orbit.exponent.low > 0.0
    assert orbit_of(rows).kind is OrbitKind.UNRESOLVED  # no evidence without the map
    few = orbit_of(rows[-60:], motion=motion_of(axial_forcing), disk=DISK)
    assert few.kind is OrbitKind.UNRESOLVED
    broken = rows.copy()
    broken["index"][-60:] += 1.0  # a row lost
    assert orbit_of(broken, motion=motion_of(axial_forcing), disk=DISK) == UNRESOLVED


def test_a_long_chaotic_transient_is_not_called_chaotic() -> None:
    """Γ = 0.5608: errors grow all along these impacts, yet the disk ends on the platform.

    Just above the crisis at which the chaotic attractor ends; lives are about 1700 impacts long.
    """
    tries = (map_rows(0.5608, 10_000, away=away) for away in np.linspace(0.01, 0.05, 12))
    lives = [rows[: int(np.argmax(rows["kind"]))] for rows in tries]
    rows = max(lives, key=len)
    assert len(rows) > 1000
    path = path_of(rows, motion_of(0.5608), DISK)
    assert len(path.tau) == len(rows)
    assert exponent_of(log_growth(jacobians(path))).low > 0.2
    assert orbit_of(rows, motion=motion_of(0.5608), disk=DISK) == UNRESOLVED


def test_motion_and_disk_that_do_not_fit_leave_the_rows_alone() -> None:
    rows = rows_of([0.7], [-2.2], 40)
    assert orbit_of(rows, motion=motion_of(0.45), disk=DISK).is_period_one
    wrong = DISK._replace(restitution=0.51)  # the rows do not follow that disk's map: no evidence
    assert orbit_of(map_rows(0.549, 2000, skip=1000), motion=motion_of(0.549), disk=wrong) == (
        UNRESOLVED
    )

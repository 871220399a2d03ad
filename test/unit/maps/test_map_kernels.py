"""What a flight of the map passes by, and the map with rotation: the stepper in other units."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, ImpactKind, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.maps.axial_map import (
    MAP_CONTACT,
    MAP_IMPACT,
    ORBIT_DELAY,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
    axial_orbit,
)
from bouncing_disk_ros.maps.orbit_kernels import clearance_of
from bouncing_disk_ros.maps.rotation_map import (
    ORBIT_SPEED,
    collision_orbit,
)


@given(tau=st.floats(0, 6.28), w=st.floats(-6, -0.05), forcing=st.floats(0.33, 2.0))
def test_the_least_gap_is_that_of_a_fine_sampling(tau: float, w: float, forcing: float) -> None:
    restitution = 0.6
    out = np.zeros((1, 4))
    axial_orbit(tau, w, forcing, restitution, 1, out)
    assume(out[0, ORBIT_KIND] == MAP_IMPACT)
    d = out[0, ORBIT_DELAY]
    x = np.linspace(0.0, d, 4001)
    u = -restitution * w
    gap = u * x - x * x / math.tau - forcing * (np.sin(tau + x) - np.sin(tau) - x * math.cos(tau))
    inner = gap[1:-1]
    dips = inner[(inner < gap[:-2]) & (inner < gap[2:])]
    least = clearance_of(tau, w, d, forcing, restitution)[0]
    # a sample misses a minimum by at most half a step, and the gap is bent by at most Γ
    near = forcing * (0.5 * d / 4000) ** 2
    if len(dips):
        assert dips.min() - near - 1e-12 <= least <= dips.min() + 1e-12
    else:  # at most a dip flatter than the samples can see
        assert least > -1e-12


# --- rotation -------------------------------------------------------------------------------------
UNIT = 1.0 / math.tau  # Hz: ω = 1, to the bit


def orbit(
    start: tuple[float, float, float], parameters: tuple[float, float, float, float], n: int
) -> NDArray[np.float64]:
    out = np.full((n, 6), np.nan)
    return out[: collision_orbit(*start, *parameters, n, out)]


def simulation(
    start: tuple[float, float, float], parameters: tuple[float, float, float, float]
) -> Simulation:
    """A run in the map's units that begins with an impact; a_e = a_g = 1, so that μ = 1/Γ_T."""
    forcing, restitution, phase_lag, angular_forcing = parameters
    tau, w, omega = start
    return Simulation(
        Motion(forcing, 1.0, UNIT, phase_lag),
        Disk(1.0, restitution, 1.0 / angular_forcing, 1.0, 1.0, 1.0 / math.pi),
        InitialState(0.0, forcing * math.cos(tau) + w, omega, 0.0, tau),
    )


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_each_step_has_the_bits_of_the_stepper(restitution: float) -> None:
    """Γ_T from 0.1 (always sticks) to 100 (slips for long), slides and sticks in contact."""
    rng = np.random.default_rng([21, int(100 * restitution)])
    contacts = compared = 0
    for k in range(12):
        forcing = rng.uniform(0.25, 1.2) if k % 2 else rng.uniform(0.319, 0.33)
        parameters = (forcing, restitution, rng.uniform(-4, 4), 10 ** rng.uniform(-1, 2))
        start = (rng.uniform(0, math.tau), -rng.uniform(0, 5 if k % 2 else 0.3), rng.uniform(-2, 2))
        rows = simulation(start, parameters).advance(150 * 10**9, 5000)[0]
        single = np.flatnonzero(rows["kind"] == ImpactKind.IMPACT)
        omega = start[2]
        for i, j in itertools.pairwise(single):
            phase, speed = rows["forcing_phase"][i], rows["axial_impact_velocity"][i]
            step = orbit((phase, speed, omega), parameters, 1)[0]
            assert step[ORBIT_TAU] == rows["forcing_phase"][j]
            assert step[ORBIT_W] == rows["axial_impact_velocity"][j]
            omega = step[ORBIT_SPEED]
            if step[ORBIT_KIND] != MAP_CONTACT:
                assert omega == rows["angular_velocity"][i]
            # the row's w_T has the roundings of α̇, of β̇ and of their difference
            slip = omega - math.cos(step[ORBIT_TAU] + parameters[2])
            assert rows["angular_impact_velocity"][j] == pytest.approx(slip, abs=4e-15)
            contacts += int(step[ORBIT_KIND] == MAP_CONTACT)
            compared += 1
    assert compared > 60
    assert (contacts > 1) == (restitution < 1.0)

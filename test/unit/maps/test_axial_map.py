"""The next-collision map is the stepper in other units: the same bits; and what flights pass by."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.maps.axial_flights import clearance_of, impacts_before_contact
from bouncing_disk_ros.maps.axial_map import (
    MAP_CONTACT,
    MAP_IMPACT,
    ORBIT_DELAY,
    ORBIT_KIND,
    ORBIT_TAU,
    ORBIT_W,
    axial_orbit,
)


def orbit(tau: float, w: float, forcing: float, restitution: float, n: int) -> NDArray[np.float64]:
    out = np.full((n, 4), np.nan)
    return out[: axial_orbit(tau, w, forcing, restitution, n, out)]


def test_after_contact_every_start_is_the_same() -> None:
    """The ride forgets where it began: the launch is at sin τ_sep = 1/(πΓ) (eq. 3)."""
    forcing = 0.37
    steps = orbit(0.3, -2.0, forcing, 0.2, 200)
    after = steps[steps[:, ORBIT_KIND] == MAP_CONTACT]
    assert len(after) > 3
    assert len(np.unique(after[:, ORBIT_TAU])) == len(np.unique(after[:, ORBIT_W])) == 1
    sep, tau, w = math.asin(1 / math.pi / forcing), after[0, ORBIT_TAU], after[0, ORBIT_W]
    d = tau - sep
    fallen = forcing * (math.cos(sep) * d - math.sin(tau) + math.sin(sep)) - d * d / math.tau
    assert fallen == pytest.approx(0.0, abs=1e-15)
    slope = forcing * (math.cos(sep) - math.cos(tau)) - d / math.pi
    assert w == pytest.approx(slope, abs=1e-15)


def test_an_impact_without_bounce_where_the_platform_falls_away_is_a_launch() -> None:
    """ε = 0 and τ in (τ_sep, π − τ_sep): no contact, and the flight begins at the impact."""
    forcing, tau = 1.0, 1.6
    step = orbit(tau, -1.0, forcing, 0.0, 1)[0]
    assert step[ORBIT_KIND] == MAP_IMPACT
    d = step[ORBIT_DELAY]
    rise = math.sin(tau + d) - math.sin(tau) - math.cos(tau) * d
    assert forcing * rise + d * d / math.tau == pytest.approx(0.0, abs=1e-14)


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
    least = clearance_of(tau, w, d, forcing, restitution)
    # a sample misses a minimum by at most half a step, and the gap is bent by at most Γ
    near = forcing * (0.5 * d / 4000) ** 2
    if len(dips):
        assert dips.min() - near - 1e-12 <= least <= dips.min() + 1e-12
    else:  # at most a dip flatter than the samples can see
        assert least > -1e-12


def test_impacts_before_a_chatter_are_counted() -> None:
    out = np.zeros((200, 4))
    axial_orbit(1.0, -0.01, 0.34, 0.5, 200, out)
    first = int(np.flatnonzero(out[:, ORBIT_KIND] != MAP_IMPACT)[0])
    state = np.array([1.0, -0.01])
    assert impacts_before_contact(state, 0.34, 0.5, 200) == first
    assert (state == out[first - 1, :2]).all()
    state = np.array([1.0, -1.0])
    assert impacts_before_contact(state, 0.45, 0.5, 500) == -1

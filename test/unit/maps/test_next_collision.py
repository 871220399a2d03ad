"""The map as an object: orbits, derivatives through contact, starts, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap, spread_starts
from support.checks import refused


def test_an_orbit_has_both_angular_velocities_and_phases_of_one_turn() -> None:
    section = NextCollisionMap(0.53, 0.5, 0.4, 7.0)
    impacts = section.orbit(MapState(1.0, -1.2, -0.3), 50)
    platform = np.cos(impacts.forcing_phase + 0.4)
    np.testing.assert_allclose(
        impacts.angular_velocity - platform, impacts.angular_impact_velocity, atol=1e-15
    )
    change = 1.5 * 1.2 / 7.0  # at the first impact, (1 + ε)|w_A|/Γ_T against the slip
    assert impacts.angular_velocity[0] == pytest.approx(
        -0.3 + math.cos(1.4) + min(change, 0.3), abs=1e-15
    )
    assert not impacts.contact.any()
    assert len(impacts.delay) == 50
    assert section.iterate(MapState(1.0, -1.2, -0.3), 50) == tuple(a[-1] for a in impacts[:3])
    assert section.iterate(MapState(1.0, -1.2), 0) == MapState(1.0, -1.2)
    section = NextCollisionMap(0.5, 0.5)
    assert section.iterate(MapState(1.0 - math.tau, -1.0)) == pytest.approx(
        section.iterate(MapState(1.0, -1.0)), abs=1e-14
    )


def test_where_a_disk_comes_to_rest_the_orbit_ends() -> None:
    section = NextCollisionMap(0.3, 0.5)
    assert len(section.orbit(MapState(1.0, -0.5), 100).delay) < 100
    with pytest.raises(
        InputError, match=r"axial_forcing: got 0\.3, allowed: an axial forcing above 1/π"
    ):
        section.iterate(MapState(1.0, -0.5), 100)


def differences(section: NextCollisionMap, state: MapState, n: int, h: float) -> np.ndarray:
    columns = []
    for k in range(3):
        step = h * np.eye(3)[k]
        ends = [section.iterate(MapState(*(np.array(state) + s * step)), n) for s in (1, -1)]
        change = np.array(ends[0]) - np.array(ends[1])
        change[0] = math.remainder(change[0], math.tau)
        columns.append(change / (2 * h))
    return np.array(columns).T


@pytest.mark.parametrize(
    ("angular_forcing", "slip", "last"),
    [(1e-3, 1.5, 0.0), (0.8, 0.2, 0.0), (0.8, 1.5, 1.0), (50.0, -1.5, 1.0)],
)
def test_derivatives_through_contact(angular_forcing: float, slip: float, last: float) -> None:
    """A chatter's last impacts, then contact: the disk sticks, or slides all the way."""
    section = NextCollisionMap(0.4, 0.5, 0.9, angular_forcing)
    state = MapState(4.5, -1e-8, slip)
    assert section.orbit(state, 1).contact.all()
    exact = section.jacobian(state)
    assert exact[2, 2] == last
    assert (exact[:2] == 0.0).all()
    # forward in w only: it stays below 0
    np.testing.assert_allclose(
        exact[2, ::2], differences(section, state, 1, 5e-9)[2, ::2], atol=1e-6
    )


@pytest.mark.parametrize(
    ("parameters", "state", "line"),
    [
        ((-0.1, 0.5), (1.0, -1.0), "axial_forcing: got -0.1, allowed: a number >= 0 (Γ)"),
        ((math.nan, 0.5), (1.0, -1.0), "axial_forcing: got nan"),
        ((math.inf, 0.5), (1.0, -1.0), "axial_forcing: got inf"),
        ((0.4, 1.01), (1.0, -1.0), "restitution: got 1.01, allowed: a number from 0 to 1 (ε)"),
        ((0.4, 0.5, math.inf), (1.0, -1.0), "phase_lag: got inf"),
        ((0.4, 0.5, 0.0, 0.0), (1.0, -1.0), "angular_forcing: got 0.0, allowed: a number > 0, or"),
        ((0.4, 0.5, 0.0, math.nan), (1.0, -1.0), "angular_forcing: got nan"),
        (("0.4", 0.5), (1.0, -1.0), "axial_forcing: got '0.4', allowed: a number"),
        ((0.4, [0.5]), (1.0, -1.0), "restitution: got [0.5], allowed: a number"),
        ((0.4, True), (1.0, -1.0), "restitution: got True, allowed: a number"),
        ((0.4, 0.5), ("here", -1.0), "state: got"),
        ((0.4, 0.5), (math.nan, -1.0), "forcing_phase: got nan"),
        ((0.4, 0.5), (1.0, 0.1), "axial_impact_velocity: got 0.1"),
        ((0.4, 0.5), (1.0, -math.inf), "axial_impact_velocity: got -inf"),
        ((0.4, 0.5), (1.0, -1.0, math.nan), "angular_impact_velocity: got nan"),
    ],
)
def test_what_is_out_of_range_is_refused(
    parameters: tuple[Any, ...], state: tuple[Any, ...], line: str
) -> None:
    with pytest.raises(InputError) as refused:
        NextCollisionMap(*parameters).orbit(MapState(*state), 1)
    assert refused.value.line.startswith(line)


@pytest.mark.parametrize("count", [1, 2, 10, 100, 1000])
def test_starts_lie_apart_within_their_window(count: int) -> None:
    starts = spread_starts(count, -5.0)
    square = np.array(
        [(s.forcing_phase / math.tau, -s.axial_impact_velocity / 5.0) for s in starts]
    )
    assert ((square >= 0.0) & (square < 1.0)).all()
    assert all(start.axial_impact_velocity < 0.0 for start in starts)
    # 1/√n is what a square grid has; the sequence keeps above half of it for every n
    apart = np.abs(square[:, None] - square[None])
    apart = np.hypot(*np.minimum(apart, 1.0 - apart).transpose(2, 0, 1))
    np.fill_diagonal(apart, math.inf)
    assert apart.min() > 0.5 / math.sqrt(count)


def test_more_starts_begin_with_the_same_and_empty_windows_are_refused() -> None:
    assert spread_starts(50, -3.0)[:20] == spread_starts(20, -3.0)
    refused("starts: got 0", spread_starts, 0, -1.0)
    refused(
        "starts: got 1000001, allowed: a whole number from 1 to 1000000",
        spread_starts,
        1_000_001,
        -1.0,
    )
    refused(r"velocity_begin: got 0\.0.*The window is empty", spread_starts, 3, 0.0)

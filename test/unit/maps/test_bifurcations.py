"""Branches and points of doubling: hysteresis, many starts, closed forms, refusals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps import bifurcation_diagram
from bouncing_disk_ros.maps.bifurcation_diagram import begin, follow, from_starts
from bouncing_disk_ros.maps.bifurcations import (
    FEIGENBAUM,
    Doubling,
    contact_onset,
    feigenbaum_ratios,
    period_doublings,
)
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap
from bouncing_disk_ros.maps.period_one import existence_limit, stability_limit
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from support.checks import refused, there

PAPER = NextCollisionMap(0.335, 0.5, 0.0, 100.0)
VALUES = np.array([0.335, 0.34, 0.345])


def test_the_way_down_may_differ_from_the_way_up() -> None:
    """Near Γ = 0.34 a chattering orbit lives beside the period-1 orbit (Fig. 4 of the paper)."""
    values = np.array([0.34, 0.345])
    chattering = begin(NextCollisionMap(0.34, 0.5, 0.0, 100.0), MapState(1.0, -0.01))
    other = follow(PAPER, "axial_forcing", values, chattering)
    one = follow(PAPER, "axial_forcing", values)
    assert (other.contacts > 0.01).all()
    assert (other.lyapunov_exponent == -math.inf).all()
    assert other.contact.any()
    assert (one.contacts == 0.0).all()
    down = follow(PAPER, "axial_forcing", values[::-1], one.end)
    np.testing.assert_allclose(down.mean_speed[::-1], one.mean_speed, atol=1e-10)


def test_starts_together_are_starts_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside `follow` from each of them; in pieces to the bit."""
    starts = [MapState(0.3 * k, -0.2 * k, 0.1 * k) for k in range(1, 12)]
    values, section = np.array([0.3, 0.4, 0.45, 0.5]), NextCollisionMap(0.335, 0.5, -0.4, 30.0)
    counts = {"settling": 3000, "measured": 64, "kept": 20}
    whole = from_starts(section, "axial_forcing", values, starts, **counts)
    monkeypatch.setattr(bifurcation_diagram, "LEAST_TOGETHER", 5)
    monkeypatch.setattr(bifurcation_diagram, "ROWS_TOGETHER", 1)
    pieces = from_starts(section, "axial_forcing", values, starts, **counts)
    for one, other in zip(whole, pieces, strict=True):
        assert one.tobytes() == other.tobytes()
    for i, value in enumerate(values):
        here = np.array([value])
        for j, start in enumerate(starts):
            state = begin(replace(section, axial_forcing=float(value)), start)
            alone = follow(section, "axial_forcing", here, state, **counts)
            # none of these attractors is chaotic: a rounding has died out, of speeds at the rate
            # 1/Γ_T an impact
            for name in ("forcing_phase", "axial_impact_velocity", "angular_velocity",
                         "mean_speed", "mean_speed_per_impact", "contacts"):  # fmt: skip
                np.testing.assert_allclose(
                    getattr(whole, name)[i, j], getattr(alone, name)[0, 0], rtol=0, atol=1e-9
                )
            assert (whole.contact[i, j] == alone.contact[0, 0]).all()
            exponent = alone.lyapunov_exponent[0, 0]
            np.testing.assert_allclose(whole.lyapunov_exponent[i, j], exponent, atol=1e-9)
    assert not whole.contact[0].any()  # at rest
    assert np.isnan(whole.contacts[0]).all()
    assert whole.contact[1].any()


def test_faults_are_said() -> None:
    with pytest.raises(InputError, match=r"axis: got 'axial_forcin'.*Did you mean axial_forcing\?"):
        follow(PAPER, "axial_forcin", VALUES)
    refused("values: got 'none'", follow, PAPER, "axial_forcing", np.zeros(0))
    refused(r"restitution: got 1\.5", follow, PAPER, "restitution", np.array([0.5, 1.5]))
    with pytest.raises(InputError, match=r"kept: got 11, allowed: from 1 to .* 10"):
        follow(PAPER, "axial_forcing", VALUES, measured=10, kept=11)
    refused("settling: got -1", follow, PAPER, "axial_forcing", VALUES, settling=-1)
    with pytest.raises(InputError, match=r"axial_forcing: got 0\.3, allowed: at least"):
        follow(PAPER, "axial_forcing", np.array([0.3]))
    refused("starts: got 'none'", from_starts, PAPER, "axial_forcing", VALUES, [])


# --- doublings and onset of contact ---------------------------------------------------------------
@pytest.fixture(scope="module")
def cascade() -> list[Doubling]:
    return period_doublings(fixed_point(0.335, 0.5), "axial_forcing", 0.6)


def test_the_ratios_tend_to_feigenbaums_constant_and_downward_there_is_no_doubling(
    cascade: list[Doubling],
) -> None:
    ratios = feigenbaum_ratios([point.value for point in cascade])
    np.testing.assert_allclose(ratios, [4.73, 4.63, 4.65], atol=0.005)
    assert abs(ratios[-1] - FEIGENBAUM) < 0.02
    assert period_doublings(fixed_point(0.45, 0.5), "axial_forcing", 0.34) == []
    assert period_doublings(fixed_point(0.45, 0.5), "axial_forcing", 0.1) == []  # past the fold
    assert len(period_doublings(fixed_point(0.45, 0.5), "axial_forcing", 0.5)) == 1


@pytest.mark.parametrize(
    ("restitution", "limit"), [(0.3, 13.0), (0.5, 8.135), (0.8, 3.0), (0.97, 1.0)]
)
def test_doublings_do_not_depend_on_how_far_the_limit_is(restitution: float, limit: float) -> None:
    """Long steps led to another orbit: a wrong doubling, none, or an error of Newton's method."""
    orbit = fixed_point(existence_limit(restitution) + 1e-3, restitution)
    (first,) = period_doublings(orbit, "axial_forcing", limit, 1)
    assert first.value == pytest.approx(stability_limit(restitution), rel=1e-12)


def test_the_chaotic_attractor_begins_to_chatter() -> None:
    section = NextCollisionMap(0.55, 0.5)
    start = section.iterate(MapState(0.8, -1.3), 1000)
    onset = there(contact_onset(section, "axial_forcing", 0.58, start, impacts=50_000, digits=1e-5))
    assert 0.0 < onset.value - onset.without <= 1e-5
    after = NextCollisionMap(onset.value + 1e-3, 0.5).orbit(start, 50_000)
    assert after.contact.any()
    before = NextCollisionMap(onset.without - 1e-3, 0.5).orbit(start, 50_000)
    assert not before.contact.any()
    assert contact_onset(section, "axial_forcing", 0.552, start, impacts=5000) is None
    with pytest.raises(InputError, match="holds no contact"):
        contact_onset(NextCollisionMap(0.34, 0.5), "axial_forcing", 0.4, MapState(1.0, -0.01))


def test_faults_of_doublings_are_said() -> None:
    orbit = fixed_point(0.45, 0.5)
    with pytest.raises(
        InputError, match="axis: got 'phase_lag', allowed: axial_forcing or restitution"
    ):
        period_doublings(orbit, "phase_lag", 1.0)
    refused(r"limit: got 0\.45", period_doublings, orbit, "axial_forcing", 0.45)
    refused("count: got 0", period_doublings, orbit, "axial_forcing", 0.6, 0)
    with pytest.raises(InputError, match=r"orbit: got .*magnitude 1\.17.*allowed: a stable orbit"):
        period_doublings(fixed_point(0.5, 0.5), "axial_forcing", 0.6)

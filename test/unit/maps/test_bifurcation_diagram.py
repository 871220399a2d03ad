"""Branches: the paper's Fig. 3, chunks that join to the bit, exponents, hysteresis, rest."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps import bifurcation_diagram
from bouncing_disk_ros.maps.bifurcation_diagram import Branch, begin, follow, from_starts
from bouncing_disk_ros.maps.next_collision import Array, MapState, NextCollisionMap
from bouncing_disk_ros.maps.period_one import stability_limit
from bouncing_disk_ros.maps.periodic_orbit import periodic_orbit

PAPER = NextCollisionMap(0.335, 0.5, 0.0, 100.0)
VALUES = np.round(np.arange(0.335, 0.5605, 0.0005), 4)


def up(values: Array, before: Array | None = None) -> Branch:
    return follow(PAPER, "axial_forcing", values, before, settling=2000, measured=2000, kept=64)


@pytest.fixture(scope="module")
def upward() -> Branch:
    return up(VALUES)


def at(branch: Branch, value: float) -> int:
    return int(np.argmin(np.abs(branch.values - value)))


def test_below_the_first_doubling_it_is_the_period_1_orbit(upward: Branch) -> None:
    stable = (upward.values > 0.3355) & (upward.values < 0.48)
    axial_forcing = upward.values[stable]
    phase = np.arccos(1 / 3 / axial_forcing)
    shown = upward.forcing_phase[stable, 0]
    np.testing.assert_allclose(shown, np.repeat(phase[:, None], 64, axis=1), atol=1e-10)
    np.testing.assert_allclose(upward.axial_impact_velocity[stable], -4 / 3, atol=1e-10)
    np.testing.assert_allclose(upward.mean_speed[stable, 0], np.cos(phase), atol=1e-10)  # eq. 4


def test_the_speed_of_fig_3b(upward: Branch) -> None:
    """Falls to 0.69 at Γ₁, rises to about 0.96 at the doubling to period 4, then falls."""
    limit = stability_limit(0.5)
    speed = upward.mean_speed[:, 0]
    before, between = upward.values < limit, (upward.values > limit) & (upward.values < 0.5405)
    assert np.all(np.diff(speed[before]) < 0)
    assert speed[before][-1] == pytest.approx(0.69, abs=0.005)
    peak = upward.values[between][np.argmax(speed[between])]
    assert peak == pytest.approx(0.5307, abs=0.0005)
    assert speed[between].max() == pytest.approx(0.96, abs=0.005)
    chaotic = (upward.values > 0.5435) & (upward.values < 0.56)
    assert speed[chaotic].max() < 0.91
    assert speed[chaotic][-10:].mean() < speed[chaotic][:10].mean() - 0.1


@pytest.mark.parametrize(("axial_forcing", "n"), [(0.475, 1), (0.535, 4)])
def test_the_exponent_of_an_orbit_is_that_of_its_multiplier(
    upward: Branch, axial_forcing: float, n: int
) -> None:
    i = at(upward, axial_forcing)
    last = MapState(upward.forcing_phase[i, 0, -1], upward.axial_impact_velocity[i, 0, -1])
    orbit = periodic_orbit(NextCollisionMap(float(upward.values[i]), 0.5), last, n)
    # a vector's growth over whole repetitions swings by the condition of the eigenvectors
    basis = np.linalg.eig(orbit.map.jacobian(last, n)[:2, :2])[1]
    swing = math.log(np.linalg.cond(basis)) / 2000
    assert swing < 0.004
    assert upward.lyapunov_exponent[i, 0] == pytest.approx(
        orbit.lyapunov_exponent, abs=swing + 1e-9
    )


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
    """Beside `follow` from each of them; in pieces and on threads to the bit."""
    starts = [MapState(0.3 * k, -0.2 * k, 0.1 * k) for k in range(1, 12)]
    values, section = np.array([0.3, 0.4, 0.45, 0.5]), NextCollisionMap(0.335, 0.5, -0.4, 30.0)
    counts = {"settling": 3000, "measured": 64, "kept": 20}
    whole = from_starts(section, "axial_forcing", values, starts, **counts)
    monkeypatch.setattr(bifurcation_diagram, "LEAST_TOGETHER", 5)
    monkeypatch.setattr(bifurcation_diagram, "ROWS_TOGETHER", 1)
    pieces = from_starts(section, "axial_forcing", values, starts, **counts, workers=2)
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
    with pytest.raises(InputError, match="values: got 'none'"):
        follow(PAPER, "axial_forcing", np.zeros(0))
    with pytest.raises(InputError, match=r"restitution: got 1\.5"):
        follow(PAPER, "restitution", np.array([0.5, 1.5]))
    with pytest.raises(InputError, match=r"kept: got 11, allowed: from 1 to .* 10"):
        follow(PAPER, "axial_forcing", VALUES, measured=10, kept=11)
    with pytest.raises(InputError, match="settling: got -1"):
        follow(PAPER, "axial_forcing", VALUES, settling=-1)
    with pytest.raises(InputError, match=r"axial_forcing: got 0\.3, allowed: at least"):
        follow(PAPER, "axial_forcing", np.array([0.3]))
    with pytest.raises(InputError, match="starts: got 'none'"):
        from_starts(PAPER, "axial_forcing", VALUES, [])

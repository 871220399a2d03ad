"""Branches: hysteresis, many starts as one by one, rest, refusals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps import bifurcation_diagram
from bouncing_disk_ros.maps.bifurcation_diagram import begin, follow, from_starts
from bouncing_disk_ros.maps.next_collision import MapState, NextCollisionMap

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

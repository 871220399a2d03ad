"""Branches: hysteresis, many starts as one by one, rest, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
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

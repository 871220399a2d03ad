"""What an attractor shows of itself: mean speed, Lyapunov exponent, contacts, where it stopped."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros.maps.lyapunov_and_speed import (
    CONTACT_COUNT,
    LYAPUNOV,
    MEAN_PER_IMPACT,
    MEAN_PER_TIME,
    MEASURED,
    measure_attractor,
)

Array = NDArray[np.float64]


def measured(
    state: Array, forcing: float, settling: int = 500, n: int = 1000
) -> tuple[int, Array, Array]:
    out, results = np.zeros((10, 6)), np.zeros(5)
    return (
        measure_attractor(state, forcing, 0.5, 0.2, 100.0, settling, n, out, results),
        out,
        results,
    )


def test_an_attractor_is_measured_from_where_it_was_left() -> None:
    state = np.array([math.acos(1 / 3 / 0.42), -4 / 3, 0.0, 1.0, 0.0])
    kept, out, results = measured(state, 0.42)
    assert kept == 10
    speed = math.cos(math.acos(1 / 3 / 0.42) + 0.2)
    assert results[MEAN_PER_TIME] == pytest.approx(speed, abs=1e-13)
    assert results[MEAN_PER_IMPACT] == pytest.approx(speed, abs=1e-13)
    # complex multipliers of magnitude ε: the growth of a vector swings about ε per impact
    assert results[LYAPUNOV] == pytest.approx(math.log(0.5), abs=3 / 1000)
    assert results[[CONTACT_COUNT, MEASURED]].tolist() == [0, 1000]
    assert (state[:2] == out[-1, :2]).all()
    assert np.hypot(*state[3:]) == pytest.approx(1.0, abs=1e-15)


def test_an_attractor_with_contact_has_no_finite_exponent() -> None:
    state = np.array([1.0, -0.01, 0.0, 1.0, 0.0])
    kept, _, results = measured(state, 0.34)
    assert kept == 10
    assert results[CONTACT_COUNT] > 0
    assert results[LYAPUNOV] == -math.inf


def test_a_disk_at_rest_waits_at_the_lowest_point() -> None:
    state = np.array([1.0, -0.5, 0.0, 1.0, 0.0])
    kept, _, results = measured(state, 0.3)
    assert kept == 0
    assert np.isnan(results).all()
    assert state.tolist() == [1.5 * math.pi, 0.0, 0.0, 1.0, 0.0]
    assert measured(state, 0.34)[0] == 10  # and is thrown again where the platform is stronger

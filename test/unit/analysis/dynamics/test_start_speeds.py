"""Mean speeds of starts: eq. 4 on the period-1 orbit, the scalar map elsewhere, rest is nan."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.analysis.dynamics.next_collision import NextCollisionMap
from bouncing_disk_ros.analysis.dynamics.start_speeds import MEASURED, mean_speeds, settling_impacts
from bouncing_disk_ros.collision_map.lyapunov_and_speed import MEAN_PER_TIME, measure_attractor
from bouncing_disk_ros.collision_map.lyapunov_and_speed import MEASURED as LAST


@pytest.mark.parametrize("before", [0.0, 1.0, -2.5])
def test_the_period_one_orbit_has_the_speed_of_equation_4(before: float) -> None:
    phase = math.acos(1.0 / 3.0 / 0.45)
    tau, w = np.array([phase, phase + 0.01]), np.full(2, -4.0 / 3.0)
    found = mean_speeds(NextCollisionMap(0.45, 0.5, 0.3, 100.0), tau, w, before)
    np.testing.assert_allclose(found, math.cos(phase + 0.3), rtol=1e-12)
    assert tau[0] == phase, "the starts are left as they are"


def test_other_starts_agree_with_the_scalar_map_and_may_be_cut() -> None:
    given = (0.45, 0.5, -0.4, 3.0)
    rng = np.random.default_rng(7)
    tau, w = rng.uniform(0.0, math.tau, 12), rng.uniform(-5.0, -0.1, 12)
    found = mean_speeds(NextCollisionMap(*given), tau, w, 0.5)
    for i in range(len(tau)):
        state, out = np.array([tau[i], w[i], 0.5, 1.0, 0.0]), np.empty((1, 6))
        results = np.empty(LAST + 1)
        measure_attractor(state, *given, settling_impacts(0.5, 3.0), MEASURED, out, results)
        # the chattering orbit, which is not chaotic: rounding does not grow
        assert found[i] == pytest.approx(results[MEAN_PER_TIME], rel=1e-9)
    cut = [
        mean_speeds(NextCollisionMap(*given), tau[part], w[part], 0.5)
        for part in (slice(0, 5), slice(5, 12))
    ]
    np.testing.assert_array_equal(np.concatenate(cut), found)


def test_rest_has_no_speed_and_does_not_disturb_others() -> None:
    found = mean_speeds(
        NextCollisionMap(0.2, 0.5, 0.0, 10.0), np.array([1.0, 2.0]), np.array([-1.0, -2.0]), 0.0
    )
    assert np.isnan(found).all()


def test_slow_friction_is_given_more_impacts_up_to_a_cap() -> None:
    assert settling_impacts(0.0, 1.0) == 502
    assert settling_impacts(-1.0, 100.0) == 900
    assert settling_impacts(0.0, 1e9) == 100_000


def test_weak_impacts_are_given_the_time_they_need() -> None:
    rng = np.random.default_rng(1)
    tau, w = rng.uniform(0.0, math.tau, 30), rng.uniform(-5.0, -0.1, 30)
    # at Γ = 0.45 one chattering and one period-1 orbit: two speeds, whatever it starts with
    first, second = (
        mean_speeds(NextCollisionMap(0.45, 0.5, 0.0, 100.0), tau, w, a) for a in (0.0, 0.5)
    )
    np.testing.assert_allclose(first, second, atol=2e-3)
    assert len(np.unique(np.round(first, 2))) == 2

"""Paths of the hand and tosses in time: eq. 1, the flight's parabola, separation and landing."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.toss_path import (
    FIG_1_ANGLE,
    FIG_1_LAGS,
    FIG_2_ANGLE,
    FIG_2_LAGS,
    toss_paths,
    toss_trajectory,
)
from bouncing_disk_ros.maps.tosses import PAPER, PAPER_DISK, separation_phase, toss

G = PAPER_DISK.gravity


def test_paths_are_closed_and_have_the_arc_amplitude() -> None:
    paths = toss_paths(np.array(FIG_1_LAGS), FIG_1_ANGLE, points=721)
    assert paths.arc.shape == paths.axial_position.shape == (3, 721)
    np.testing.assert_allclose(paths.arc[:, 0], paths.arc[:, -1], atol=1e-15)
    assert np.hypot(*(np.abs(x).max() for x in (paths.arc, paths.axial_position))) == pytest.approx(
        PAPER.arc_amplitude, rel=1e-15
    )
    # θ = 0, φ_L = π/4: a helix, straight when unrolled; θ = −π/2: an ellipse, here a circle
    np.testing.assert_allclose(paths.arc[2], paths.axial_position[2], atol=1e-15)
    radius = np.hypot(paths.arc[0], paths.axial_position[0])
    np.testing.assert_allclose(radius, radius[0], rtol=1e-14)
    sine = G / ((math.tau * 3.0) ** 2 * 0.25 * math.cos(FIG_1_ANGLE))
    np.testing.assert_allclose(np.sin(paths.separation_phase), sine, rtol=1e-14)
    np.testing.assert_allclose(paths.separation_position, 0.25 * math.sqrt(0.5) * sine, rtol=1e-14)


def test_a_path_without_separation() -> None:
    paths = toss_paths(0.0, math.pi / 2, points=9)
    assert paths.arc.shape == (9,)
    assert np.isnan([paths.separation_phase, paths.separation_arc]).all()


@pytest.mark.parametrize("lag", FIG_2_LAGS)
def test_a_toss_in_time(lag: float) -> None:
    run = toss_trajectory(lag, FIG_2_ANGLE, samples=401)
    paths = toss_paths(lag, FIG_2_ANGLE)
    found = toss(lag, FIG_2_ANGLE)
    for values in run[:11]:
        assert isinstance(values, np.ndarray)
        assert values.shape == (401,)
    assert run.time[0] == 0.0  # cos(3π/2) is 2e-16 in float64, and so is the platform's velocity
    assert abs(run.axial_velocity[0]) < 1e-15 * 4.0
    assert abs(run.angular_velocity[0]) < 1e-15 * 30.0
    assert run.axial_position[0] == paths.axial_position[0]
    assert run.airborne_speed == found.airborne_speed
    flight = run.time > run.separation_time
    assert (run.phase[flight] == Phase.FLIGHT).all()
    assert (run.phase[~flight] != Phase.FLIGHT).all()
    np.testing.assert_array_equal(run.axial_position[~flight], run.platform_position[~flight])
    np.testing.assert_allclose(run.angular_velocity[flight], found.airborne_speed, rtol=1e-14)
    speed = 0.25 * math.cos(FIG_2_ANGLE) * math.tau * 3.0 * math.cos(paths.separation_phase)
    d = run.time[flight] - run.separation_time
    height = paths.separation_position + speed * d - 0.5 * G * d * d
    np.testing.assert_allclose(run.axial_position[flight], height, atol=2e-15)
    # the last sample is less than 1 ns before the landing, at some 6 m/s
    assert 0.0 <= run.landing_time - run.time[-1] < 1e-9
    assert 0.0 <= run.axial_position[-1] - run.platform_position[-1] < 1e-8
    # α̇ is the slope of α
    turned = np.sum(
        0.5 * (run.angular_velocity[1:] + run.angular_velocity[:-1]) * np.diff(run.time)
    )
    assert run.angle[-1] == pytest.approx(turned, abs=1e-3)
    tau = 1.5 * math.pi + math.tau * 3.0 * run.time
    np.testing.assert_allclose(run.forcing_phase, tau, rtol=1e-14)


def test_a_duration_may_be_given() -> None:
    run = toss_trajectory(0.3, 0.7, duration=0.2, samples=21)
    assert run.time[-1] == pytest.approx(0.2, abs=1e-9)
    assert math.isnan(run.landing_time)
    rest = toss_trajectory(0.3, math.pi / 2, duration=1.0, samples=21)
    assert math.isnan(rest.separation_time)
    assert math.isnan(rest.airborne_speed)
    assert (rest.phase != Phase.FLIGHT).all()
    again = toss_trajectory(0.3, 0.7, duration=2.0, samples=21)
    late = toss_trajectory(0.3, 0.7)
    assert again.landing_time == late.landing_time < 2.0
    assert float(separation_phase(0.7)) == pytest.approx(
        math.tau * 3.0 * late.separation_time - math.pi / 2, rel=1e-13
    )


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"amplitude_angle": 1.5}, "amplitude_angle"),
        ({"amplitude_angle": 2.0}, "amplitude_angle"),
        ({"samples": 1}, "samples"),
        ({"duration": 0.0}, "duration"),
        ({"duration": math.nan}, "duration"),
    ],
)
def test_what_cannot_be_used_is_refused(arguments: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as raised:
        toss_trajectory(**{"phase_lag": 0.0, "amplitude_angle": 0.5, **arguments})
    assert raised.value.field == field


def test_a_path_needs_points() -> None:
    with pytest.raises(InputError, match="points"):
        toss_paths(0.0, 0.5, points=1)
    with pytest.raises(InputError, match="phase_lag"):
        toss_paths(math.nan, 0.5)

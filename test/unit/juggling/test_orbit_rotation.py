"""Rotation of the disk on orbits that a controller holds: the best phase lag, and the speed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.juggler import HeardImpact, Juggler
from bouncing_disk_ros.juggling.kernels import loop_kernel as loop
from bouncing_disk_ros.juggling.loop_settings import (
    Limits,
    Sensor,
    controller_settings,
    period_one_points,
    plant_settings,
)
from bouncing_disk_ros.juggling.loop_verdict import Outcome
from bouncing_disk_ros.juggling.simulated_loop import LoopRecord, knots_of, run_loop
from bouncing_disk_ros.juggling.target_orbit import (
    best_phase_lag,
    flight_times,
    mean_rotor_speed,
    orbit_named,
)

FREQUENCY, GRAVITY, FRICTION, AMPLITUDE = 3.0, 9.81, 0.3, 1.0
OMEGA = math.tau * FREQUENCY
SPEED = math.pi * GRAVITY / OMEGA
TWO = "period-2 in 1 cycle"


def simulated(forcing: float, lag: float, angular_forcing: float, periods: float) -> LoopRecord:
    """From the impact of the orbit on, 0.3 rad late, without rotation."""
    phase = float(period_one_points(forcing, 0.5)[0, 0]) + 0.3
    motion = Motion(forcing * SPEED / OMEGA, AMPLITUDE, FREQUENCY, lag)
    # Γ_T = a_g² Φ ω² / (a_e π g μ)
    gyration = math.sqrt(
        angular_forcing * 0.1 * math.pi * GRAVITY * FRICTION / (AMPLITUDE * OMEGA * OMEGA)
    )
    disk = Disk(0.5, 0.5, FRICTION, 0.1, gyration, GRAVITY)
    start = InitialState(axial_velocity=SPEED, forcing_phase=phase)
    juggler = Juggler("deadbeat", motion, disk, phase=phase)
    simulation = Simulation(motion, disk, start)
    first = juggler.on_impact(HeardImpact(0.0, SPEED), 0)  # the kernel hears of the start too
    assert first is not None
    simulation.trajectory(first.begin_ns, axial=knots_of(first))
    return run_loop(simulation, juggler, periods=periods)


def by_kernel(forcing: float, lag: float, angular_forcing: float, periods: float) -> float:
    """Mean over the last ten periods, ωΦ, of the same run; the controller hears of its start."""
    phase = float(period_one_points(forcing, 0.5)[0, 0]) + 0.3
    plant = plant_settings(
        0.5, Sensor(), hears_velocity=True, deadline=periods + phase / math.tau, phase_lag=lag,
        angular_forcing=angular_forcing,
    )  # fmt: skip
    starts = np.array([[0.0, phase, forcing * math.sin(phase), 1.0]])
    results = np.zeros((1, loop.RESULTS))
    loop.run_loops(
        controller_settings("deadbeat", forcing, 0.5, Limits()), period_one_points(forcing, 0.5),
        plant, starts, 0.05, 5, 1, 0, results, np.zeros((0, 2)),
    )  # fmt: skip
    assert results[0, loop.R_VERDICT] == Outcome.CAPTURED
    return float(results[0, loop.R_ROTOR])


@pytest.mark.parametrize("forcing", [0.50, 0.55, 0.60])
def test_the_disk_turns_as_fast_as_the_platform_on_a_stabilised_orbit(forcing: float) -> None:
    """θ = −τ_imp: ωΦ, by the kernel and with contact, slip and friction; θ = 0: cos τ_imp of it.

    To 1e-9: the orbit is held to that, and the cosine is flat at its top.
    """
    orbit = period_one_points(forcing, 0.5)
    lag = best_phase_lag(orbit, forcing)
    assert lag == -orbit[0, 0]
    assert by_kernel(forcing, lag, 2.0, 30.0) == pytest.approx(1.0, abs=1e-9)
    record = simulated(forcing, lag, 2.0, 30.0)
    assert record.rotor_speed() == pytest.approx(OMEGA * AMPLITUDE, rel=1e-9)
    slower = simulated(forcing, 0.0, 2.0, 30.0).rotor_speed()
    assert slower == pytest.approx(OMEGA * AMPLITUDE * math.cos(-lag), rel=1e-6)


def test_the_kernel_turns_the_disk_as_the_simulation_does() -> None:
    """While it still gains speed, limited by friction in each impact: twelve periods from 0."""
    lag, angular_forcing = -0.4, 25.0
    rows = simulated(0.6, lag, angular_forcing, 12.0).rows
    times = [2.0 / FREQUENCY, *(float(t) for t in rows["time"] if t > 2.0 / FREQUENCY)]
    before = rows["angular_velocity"][rows["time"] <= 2.0 / FREQUENCY]
    first = float(before[-1]) if len(before) else 0.0
    late = rows["angular_velocity"][rows["time"] > 2.0 / FREQUENCY].tolist()
    mean = mean_rotor_speed([*times, 12.0 / FREQUENCY], [first, *late, late[-1]])
    found = by_kernel(0.6, lag, angular_forcing, 12.0)
    assert 0.1 < found < 0.8
    assert found == pytest.approx(mean / (OMEGA * AMPLITUDE), abs=1e-9)


def test_the_best_lag_of_an_orbit_with_two_impacts_is_the_top_of_all() -> None:
    forcing = 0.48
    orbit = orbit_named(TWO, forcing, 0.5)
    times = flight_times(orbit, forcing)
    assert len(orbit) == 2
    assert times.sum() == pytest.approx(math.tau, abs=1e-9)
    lags = np.linspace(-math.pi, math.pi, 100_001)
    means = (times[:, None] * np.cos(orbit[:, :1] + lags)).sum(axis=0)
    assert best_phase_lag(orbit, forcing) == pytest.approx(lags[means.argmax()], abs=1e-4)


@pytest.mark.parametrize("phase", [0.5, 2.0, 4.0, 6.0])
def test_the_best_lag_has_the_right_sign_in_every_quadrant(phase: float) -> None:
    """An orbit given twice is the same orbit."""
    orbit = np.array([[phase, 1.0]])
    twice = best_phase_lag(np.repeat(orbit, 2, axis=0), 0.5)
    assert math.remainder(twice + phase, math.tau) == pytest.approx(0.0, abs=1e-15)
    assert best_phase_lag(orbit, 0.5) == pytest.approx(twice, abs=1e-15)


def test_no_speed_of_fewer_than_two_impacts_nor_of_an_orbit_that_is_not_there() -> None:
    assert math.isnan(mean_rotor_speed([], []))
    assert math.isnan(mean_rotor_speed([1.0], [2.0]))
    assert mean_rotor_speed([0.0, 1.0, 3.0], [1.0, 4.0, 9.0]) == pytest.approx(3.0)
    with pytest.raises(InputError, match=rf"target: got 'period-3', allowed: period-1, {TWO}"):
        orbit_named("period-3", 0.48, 0.5)

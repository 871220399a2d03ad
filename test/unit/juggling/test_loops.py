"""Closed loops: kernels and simulation agree, strategies do what they promise, within limits."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase
from bouncing_disk_ros.core.offset_extremes import newest_extremes
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.juggler import HeardImpact, Juggler
from bouncing_disk_ros.juggling.kernels import loop_kernel as loop
from bouncing_disk_ros.juggling.kernels.loop_kernel import draw
from bouncing_disk_ros.juggling.loop_settings import (
    HEARS_TIMES_ONLY,
    Limits,
    Sensor,
    controller_settings,
    period_one_points,
    plant_settings,
)
from bouncing_disk_ros.juggling.loop_verdict import Outcome
from bouncing_disk_ros.juggling.own_controller import Setup, load_controller
from bouncing_disk_ros.juggling.simulated_loop import LoopRecord, knots_of, run_loop
from bouncing_disk_ros.units import NS
from support.checks import refused, there
from support.juggle_loops import watched

FREQUENCY, GRAVITY = 3.0, 9.81
OMEGA = math.tau * FREQUENCY
SPEED = math.pi * GRAVITY / OMEGA
LENGTH = SPEED / OMEGA


def motion_of(forcing: float) -> Motion:
    return Motion(forcing * LENGTH, 0.0, FREQUENCY, 0.0)


def disk_of(restitution: float = 0.5) -> Disk:
    return Disk(0.5, restitution, 0.3, 0.1, 0.1, GRAVITY)


def simulated(
    strategy: str, forcing: float, start: InitialState | None = None, *, error: float = 0.0,
    limits: Limits | None = None, **more: Any,
) -> tuple[LoopRecord, Simulation]:  # fmt: skip
    """A loop around a Simulation, by default from rest."""
    motion, disk = motion_of(forcing), disk_of()
    state = start or InitialState()
    juggler = Juggler(
        strategy, motion, disk, restitution=disk.restitution * (1.0 + error), limits=limits,
        phase=state.forcing_phase,
    )  # fmt: skip
    simulation = Simulation(motion, disk, state)
    return run_loop(simulation, juggler, **more), simulation


def after_impact(phase: float, velocity: float) -> InitialState:
    """A disk that leaves the platform, velocity in units of πg/ω."""
    return InitialState(axial_velocity=velocity * SPEED, forcing_phase=phase)


def by_kernel(
    strategy: str, forcing: float, starts: NDArray[np.float64], *, error: float = 0.0,
    sensor: Sensor | None = None, impulse: float = 0.0, periods: float = 50.0,
    limits: Limits | None = None, trace: int = 0,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    sensor, limits = sensor or Sensor(), limits or Limits()
    controller = controller_settings(strategy, forcing, 0.5 * (1.0 + error), limits)
    plant = plant_settings(
        0.5, sensor, hears_velocity=strategy not in HEARS_TIMES_ONLY, deadline=periods,
        impulse=impulse,
    )  # fmt: skip
    results, rows = np.zeros((len(starts), loop.RESULTS)), np.zeros((trace, 2))
    orbit = period_one_points(forcing, 0.5)
    loop.run_loops(controller, orbit, plant, starts, 0.05, 5, sensor.seed, 0, results, rows)
    return results, rows


def window(forcing: float, side: int) -> NDArray[np.float64]:
    """States after impacts of the window of the paper's Fig. 4."""
    tau = math.tau * (np.arange(side) + 0.5) / side
    w = -5.0 * (np.arange(side) + 0.5) / side
    w, tau = (v.ravel() for v in np.meshgrid(w, tau, indexing="ij"))
    starts = np.zeros((len(w), 4))
    starts[:, 1], starts[:, 2] = tau, forcing * np.sin(tau)
    starts[:, 3] = forcing * np.cos(tau) - 0.5 * w
    return starts


REST = np.array([[1.0, 1.5 * math.pi, -0.45, 0.0]])


# --- kernels and simulation -----------------------------------------------------------------------
@pytest.mark.parametrize("strategy", ["none", "impact_time", "deadbeat"])
def test_the_kernels_impacts_are_those_of_the_simulation(strategy: str) -> None:
    """To 1e-9: rounding, 1e-14 in an impact, grows less than tenfold in each of five."""
    forcing, phase, velocity = 0.6, 1.0, 1.4
    start = np.array([[0.0, phase, forcing * math.sin(phase), velocity]])
    _, rows = by_kernel(strategy, forcing, start, trace=5)
    motion, disk = motion_of(forcing), disk_of()
    state = after_impact(phase, velocity)
    juggler = Juggler(strategy, motion, disk, phase=phase)
    simulation = Simulation(motion, disk, state)
    first = juggler.on_impact(HeardImpact(0.0, velocity * SPEED), 0)  # the kernel hears of it too
    if first is not None:
        simulation.trajectory(first.begin_ns, axial=knots_of(first))
    found = run_loop(simulation, juggler, periods=12.0).rows[:5]
    np.testing.assert_allclose(phase + OMEGA * found["time"], rows[:, 0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found["axial_velocity"] / SPEED, rows[:, 1], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("change", [1.0, -1.5])
def test_an_impulse_on_a_disk_at_rest_is_that_of_the_simulation(change: float) -> None:
    """Up: a launch. Down: an impact, from which it bounces. It was left alone."""
    forcing = 0.34
    start = np.array([[1.0, 1.5 * math.pi, -forcing, 0.0]])
    at = 9.25 + draw(1, 0, 1 << 40)  # periods since the start, at 3π/2
    _, rows = by_kernel("none", forcing, start, impulse=change, trace=400)
    simulation = Simulation(motion_of(forcing), disk_of(), InitialState())
    at_ns = round(1e9 * at / FREQUENCY)
    simulation.advance(at_ns - 1)
    assert simulation.sample().phase is Phase.STICKING
    simulation.apply_impulse(at_ns, disk_of().mass * change * SPEED, 0.0)
    found, _ = simulation.advance(at_ns + NS)
    times = (rows[:, 0] - 1.5 * math.pi) / OMEGA
    first = int(np.searchsorted(times, 1e-9 * at_ns - 1e-6))
    count = 4 if change > 0.0 else 3
    np.testing.assert_allclose(found["time"][:count], times[first : first + count], atol=1e-7)
    speeds = rows[first : first + count, 1] * SPEED
    np.testing.assert_allclose(found["axial_velocity"][:count], speeds, atol=1e-6)


@pytest.mark.parametrize("sensor", [Sensor(), Sensor(delay=0.2, missed=0.2, seed=3)])
@pytest.mark.parametrize("strategy", ["impact_time", "deadbeat"])
def test_both_give_the_same_verdict_from_rest(strategy: str, sensor: Sensor) -> None:
    record, _ = simulated(strategy, 0.45, sensor=sensor)
    results, _ = by_kernel(strategy, 0.45, REST, sensor=sensor)
    assert record.verdict.outcome == results[0, loop.R_VERDICT] == Outcome.CAPTURED


@pytest.mark.parametrize(("error", "more"), [(0.0, 0), (-0.2, -1), (0.2, 1)])
def test_a_live_loop_judges_each_impact_by_what_was_learned_before(error: float, more: int) -> None:
    """The orbit that it aims at moves while it learns: impacts near its end count otherwise."""
    record, _ = simulated("impact_time", 0.45, error=error)
    live = there(watched(record.rows, 0.45, "impact_time", Sensor(), error=error).loop)
    assert live.watch.verdict == record.verdict._replace(impacts=record.verdict.impacts + more)


# --- strategies -----------------------------------------------------------------------------------
@pytest.mark.parametrize("forcing", [0.45, 0.55, 0.60])
def test_deadbeat_reaches_the_orbit_in_two_impacts(forcing: float) -> None:
    """The first impact after the start aims, the second one is on the orbit: to 1e-9."""
    orbit = period_one_points(forcing, 0.5)
    for late in (-0.4, 0.3):
        phase = float(orbit[0, 0]) + late
        motion, disk = motion_of(forcing), disk_of()
        juggler = Juggler("deadbeat", motion, disk, phase=phase)
        simulation = Simulation(motion, disk, after_impact(phase, 1.05))
        answer = there(juggler.on_impact(HeardImpact(0.0, 1.05 * SPEED), 0))
        simulation.trajectory(answer.begin_ns, axial=knots_of(answer))
        rows = run_loop(simulation, juggler, periods=8.0).rows
        off = [math.remainder(tau - orbit[0, 0], math.tau) for tau in rows["forcing_phase"][1:]]
        assert np.abs(off).max() < 1e-9
        assert np.abs(rows["axial_velocity"][1:] / SPEED - 1.0).max() < 1e-9


@pytest.mark.parametrize("forcing", [0.55, 0.60])
@pytest.mark.parametrize("strategy", ["impact_time", "deadbeat"])
def test_an_unstable_orbit_is_stabilised(strategy: str, forcing: float) -> None:
    record, simulation = simulated(strategy, forcing)
    assert record.verdict.outcome is Outcome.CAPTURED
    late = record.rows["forcing_phase"][-10:] - period_one_points(forcing, 0.5)[0, 0]
    assert np.abs(late).max() < 1e-9
    assert simulation.energy().residual == pytest.approx(0.0, abs=1e-10 * simulation.energy().throughput)  # noqa: E501  # fmt: skip
    assert simulated("none", forcing)[0].verdict.outcome is not Outcome.CAPTURED


def test_two_per_cent_of_the_amplitude_hold_an_unstable_orbit() -> None:
    forcing = 0.6
    phase = float(period_one_points(forcing, 0.5)[0, 0]) + 0.01
    start = np.array([[0.0, phase, forcing * math.sin(phase), 1.0]])
    held, _ = by_kernel("small", forcing, start)
    assert held[0, loop.R_VERDICT] == Outcome.CAPTURED
    assert 0.0 < held[0, loop.R_POSITION] <= 0.02 * forcing
    assert by_kernel("none", forcing, start)[0][0, loop.R_VERDICT] != Outcome.CAPTURED


@pytest.mark.parametrize("error", [-0.2, 0.0, 0.2])
def test_every_start_is_captured_and_rest_too(error: float) -> None:
    starts = np.concatenate([window(0.45, 8), REST])
    results, _ = by_kernel("deadbeat", 0.45, starts, error=error)
    assert (results[:, loop.R_VERDICT] == Outcome.CAPTURED).all()


def test_what_one_impact_says_corrects_the_restitution() -> None:
    motion, disk = motion_of(0.45), disk_of()
    juggler = Juggler("deadbeat", motion, disk, restitution=0.4)
    run_loop(Simulation(motion, disk, InitialState()), juggler, periods=50.0)
    assert juggler.restitution == pytest.approx(0.5, abs=1e-3)
    stubborn = Juggler("deadbeat", motion, disk, restitution=0.4, learns=False)
    run_loop(Simulation(motion, disk, InitialState()), stubborn, periods=10.0)
    assert stubborn.restitution == 0.4


# --- limits and refusals --------------------------------------------------------------------------
@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    forcing=st.floats(0.35, 0.65),
    position=st.floats(0.01, 0.5),
    acceleration=st.floats(0.2, 4.0),
    strategy=st.sampled_from(["impact_time", "deadbeat", "small"]),
    delay=st.floats(0.0, 0.5),
    phase=st.floats(0.0, 6.28),
    speed=st.floats(0.1, 2.0),
)
def test_limits_are_never_exceeded(
    forcing: float, position: float, acceleration: float, strategy: str, delay: float,
    phase: float, speed: float,
) -> None:  # fmt: skip
    """By the exact extremes of the polynomials that the simulation follows, to rounding."""
    limits = Limits(position, acceleration, position)
    start = after_impact(phase, forcing * math.cos(phase) + speed)
    record, simulation = simulated(
        strategy, forcing, start, limits=limits, sensor=Sensor(delay=delay, missed=0.1), periods=6.0
    )
    motion = motion_of(forcing)
    replay = Simulation(motion, disk_of(), start)
    for command in record.commands:
        replay.advance(command.begin_ns)
        replay.trajectory(command.begin_ns, axial=knots_of(command))
        most = newest_extremes(replay.offset.axial)
        assert most.position <= position * motion.axial_amplitude * (1.0 + 1e-9)
        assert most.acceleration <= acceleration * motion.axial_amplitude * OMEGA**2 * (1.0 + 1e-6)
        assert most.jump <= 1e-9 * SPEED
    assert simulation.time_ns > 0


def test_neither_an_unknown_velocity_nor_an_age_without_impacts_is_near_the_orbit() -> None:
    """Such impacts counted as captured; those of years were followed in thought, one by one."""
    record, _ = simulated("deadbeat", 0.45)
    rows = record.rows.copy()
    assert "not captured" not in watched(rows, 0.45, "deadbeat", Sensor()).status
    rows["axial_velocity"] = math.nan
    assert "not captured" in watched(rows, 0.45, "deadbeat", Sensor()).status
    juggler = Juggler("deadbeat", motion_of(0.45), disk_of())
    for time in (1.0, 1.3):
        juggler.on_impact(HeardImpact(time, 1.0 * SPEED), round(time * NS))
    later = 1e8
    assert juggler.on_impact(HeardImpact(later, 1.0 * SPEED), round(later * NS)) is not None


def test_what_cannot_juggle_is_refused_in_one_line(tmp_path: Path) -> None:
    motion, disk = motion_of(0.45), disk_of()
    refused(r"strategy: got 'deadbeet'.*deadbeat", Juggler, "deadbeet", motion, disk)
    refused("There is no period-1 orbit", Juggler, "deadbeat", motion_of(0.3), disk)
    with pytest.raises(InputError, match="a platform that moves"):
        Juggler("deadbeat", motion._replace(axial_amplitude=0.0), disk)
    with pytest.raises(InputError, match=r"restitution: got 1\.2, allowed: 0 to 1, as the"):
        Juggler("deadbeat", motion, disk, restitution=1.2)
    file = tmp_path / "mine.py"
    file.write_text("def make_controller(setup):\n    return setup.speed\n")
    with pytest.raises(InputError, match=r"controller: .* AttributeError: .*'speed'") as caught:
        load_controller(file, Setup(motion_of(0.45), disk_of(), Limits(), 0.0))
    assert "\n" not in caught.value.line

"""Loads of the disk against closed forms: load torque, dry brake, load inertia.

Random runs with these loads, and ties of their torques, are in test_inclusion.py.
"""

from __future__ import annotations

import math
from typing import Any

import pytest

from bouncing_disk_ros import simulate
from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation
from reference.cases import NS

BODY = Disk(0.25, 0.5, 0.6, 0.12, 0.1, 9.81)
GRIP = 0.6 * 0.12 * 0.25  # μ a_e m
PI = math.pi
PRESSED: dict[str, Any] = {"gravity": 10.0, "axial_amplitude": 0.0}
INERTIA = 0.0028125  # m a_g² of the default disk, kg·m²
STANDS: dict[str, Any] = {"axial_amplitude": 0.0, "angular_amplitude": 0.0}
FREE: dict[str, Any] = {
    "friction": 0.0, "axial_amplitude": 0.0, "brake_torque": 0.01, "initial_angular_velocity": 1.0,
}  # fmt: skip
LETS_GO: dict[str, Any] = {
    **PRESSED, "phase_lag": PI / 2, "initial_forcing_phase": 0.0, "friction": 0.1,
    "load_torque": -0.049, "brake_torque": 0.05,
}  # fmt: skip
THERE_AND_BACK = [
    (0.3, {"platform_rotation": (0.3, 0.0, 0.0)}), (0.5, {"platform_rotation": (0.0, 0.0, 0.0)})
]  # fmt: skip
TIED: dict[str, Any] = {
    "axial_amplitude": 0.0, "angular_amplitude": 1.0, "frequency": 1.0, "friction": 0.03,
    "friction_radius": 0.12, "mass": 0.1, "gravity": 9.81, "gyration_radius": 0.1,
    "brake_torque": 0.0035316,
}  # fmt: skip
TURN = 1.0 / 6.0  # s, where β̇ of the default motion is 0 for the first time
KNOWN = {
    # I ω²/(2 T_B), and rest
    "stops without friction": (10.0, {**FREE, "angular_amplitude": 0.0}, 0.0, 0.140625),
    "stops without friction in a fade": (
        10.0, {**FREE, "programme": [(0.05, {"angular_amplitude": 0.0})]}, 0.0, 0.140625,
    ),
    # slips back from the turn on with T_L + F − T_B = 0.05 + 0.18 − 0.2 N·m
    "held one way alone": (
        0.25, {**PRESSED, "load_torque": 0.05, "brake_torque": 0.2},
        -0.03 / INERTIA * (0.25 - TURN), -0.015 / INERTIA * (0.25 - TURN) ** 2,
    ),
    # let go at the turn by |T_L| + F − T_B = 0.049 + 0.03 − 0.05 N·m
    "lets go": (
        0.3, LETS_GO, 0.029 / INERTIA * (0.3 - TURN), 0.0145 / INERTIA * (0.3 - TURN) ** 2,
    ),
    "lets go while an input waits": (
        0.3, {**LETS_GO, "impulses": [(0.3, 0.0, 0.0)]},
        0.029 / INERTIA * (0.3 - TURN), 0.0145 / INERTIA * (0.3 - TURN) ** 2,
    ),
    "held over an offset": (
        1.0, {**STANDS, "brake_torque": 0.2, "trajectory": THERE_AND_BACK}, 0.0, 0.0,
    ),
    "tied with friction": (4.0, TIED, 0.0, 0.0),
    "friction tied with the load": (
        1.0, {**STANDS, "mass": 0.5, "friction": 0.5, "friction_radius": 0.125, "gravity": 10.0,
              "gyration_radius": 0.25, "load_torque": 0.3125, "load_inertia": 0.015625}, 0.0, 0.0,
    ),
    "where the load touches 0": (  # Γ = 1/π
        0.3, {"axial_amplitude": 0.06332573977646111, "angular_amplitude": 0.0, "frequency": 2.0,
              "gravity": 10.0, "restitution": 0.97, "friction": 0.07533036207198225,
              "friction_radius": 0.03566413246282494, "brake_torque": 0.004484617009191801,
              "initial_forcing_phase": 0.0,
              "trajectory": [(0.5, {"platform_rotation": (0.0, 0.0, 0.0)})]}, 0.0, 0.0,
    ),
    # I ω²/(2(T_B + μ a_e m g)), and rest
    "stops by brake and friction": (
        1.0, {"gravity": 9.81, "axial_amplitude": 0.0, "angular_amplitude": 0.0, "mass": 0.25,
              "friction": 0.6, "friction_radius": 0.12, "gyration_radius": 0.1,
              "brake_torque": 0.005, "load_inertia": 0.001, "initial_angular_velocity": 5.0},
        0.0, 12.5 * 0.0035 / (GRIP * 9.81 + 0.005),
    ),
    "tied with the load after a chatter": (
        1.0, {**PRESSED, "friction": 0.0, "initial_height": 0.05, "load_torque": 0.01,
              "brake_torque": 0.01}, 0.0, 0.0,
    ),
}  # fmt: skip
"""Seconds, parameters, α̇ and α at their end."""


@pytest.mark.parametrize("name", KNOWN)
def test_a_brake_does_what_its_torques_say(name: str) -> None:
    seconds, given, speed, angle = KNOWN[name]
    found = simulate(seconds, sample_rate=100.0, **given)
    end = found.samples[-1]
    assert end["angular_velocity"] == pytest.approx(speed, rel=1e-12, abs=1e-15)
    assert found.unwrapped_angle[-1] == pytest.approx(angle, rel=1e-12, abs=1e-15)
    assert abs(found.energy.residual) <= 1e-13 * found.energy.throughput


def test_a_phase_lag_is_an_angle() -> None:
    """Beyond a turn too: in the core it may be any number."""
    disk = Disk(0.25, 0.5, 0.1, 0.12, 0.106, 10.0, 0.0, -0.049, 0.05)
    ends = []
    for lag in (-26.3, math.remainder(-26.3, math.tau)):
        run = Simulation(Motion(0.0, 0.5, 3.0, lag), disk, InitialState(forcing_phase=0.3))
        _, is_behind = run.advance(2 * NS, 10_000)
        assert not is_behind
        ends.append((run.sample().angular_velocity, run.sample().unwrapped_angle))
    assert ends[0] == pytest.approx(ends[1], rel=1e-11)


def test_a_changed_inertia_keeps_the_speed() -> None:
    """The step of the energy is work of parameters."""
    run = Simulation(Motion(0.02, 0.7, 3.0, 0.4), BODY, InitialState(0.1, None, 3.0))
    run.advance(NS // 20)
    before, energy = run.sample(), run.energy()
    assert before.phase is Phase.FLIGHT
    run.set_disk(BODY._replace(load_inertia=BODY.inertia))
    after = run.sample()
    assert (after.angular_velocity, after.unwrapped_angle) == (3.0, before.unwrapped_angle)
    step = run.energy().work_parameters - energy.work_parameters
    assert step == pytest.approx(0.5 * BODY.inertia * 3.0**2, rel=1e-12)


@pytest.mark.parametrize("frequency", [0.2, 1e3, 1e7])
def test_a_brake_takes_energy_whichever_way_a_fade_turns_the_platform(frequency: float) -> None:
    """To 1e7 Hz in 1000 s: β̇ up to 2 rad/s was rounding, and the brake drove the disk."""
    slow = Motion(0.0, 0.5, 0.1, 0.0)
    sim = Simulation(slow, BODY._replace(brake_torque=1e-3), InitialState())
    sim.command([(1000 * NS, slow._replace(frequency=frequency))], 1000 * NS)
    angle = turned = 0.0
    for at in range(0, 26 * NS // 10, NS // 500):
        sim.advance(at)
        sample = sim.sample()
        assert sample.phase is Phase.STICKING
        angle, before = sample.unwrapped_angle, angle
        turned += abs(angle - before)
        assert sim.energy().loss_brake == pytest.approx(1e-3 * turned, rel=1e-3)

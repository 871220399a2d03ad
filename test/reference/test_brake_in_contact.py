"""The brake in contact: runs whose end is known, and random ones that must obey the inclusion.

Whatever happens, friction opposes w_T with at most μ a_e N, the brake opposes α̇ with at most T_B,
and the energies balance. The solution of I α̈ + T_L + F Sgn(w_T) + T_B Sgn(α̇) ∋ 0 is unique, so
nothing else does.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros import simulate
from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase, Sample
from bouncing_disk_ros.core.simulation import Simulation
from reference.cases import NS, examples
from support.offset_runs import knots, points

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


# --- random runs ----------------------------------------------------------------------------------
class Attack:
    """A disk that stays in contact under a brake, with inputs of every kind."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        period = self.one(0.1, 1.0)
        self.motion = self.random_motion(period)
        self.disk = self.random_disk()
        spin = self.one(0.0, 0.0, 1.0, -1.0) * 0.3 * math.tau / period
        self.initial = InitialState(
            angular_velocity=spin, forcing_phase=self.one(0.0, 0.5 * PI, 1.5 * PI, self.part() * 6)
        )
        self.step_ns = round(period * NS / 23.0)
        self.run = Simulation(self.motion, self.disk, self.initial)
        for _ in range(int(self.rng.integers(0, 3))):
            begin = self.step_ns * int(self.rng.integers(0, 60))
            found = points(self.rng, begin, self.one(0.0, 0.3), 1.0 / period)
            self.run.trajectory(begin, None, knots(found))
        for _ in range(int(self.rng.integers(0, 3))):
            at = self.step_ns * int(self.rng.integers(0, 60))
            size = self.one(0.0, 0.0, 1.0) * self.disk.inertia * self.part()
            self.run.apply_impulse(at, 0.0, size)

    def one(self, *values: float) -> float:
        return float(values[int(self.rng.integers(len(values)))])

    def part(self) -> float:
        return float(self.rng.uniform(-1.0, 1.0))

    def random_motion(self, period: float) -> Motion:
        """Γ < 1/π, with g as below; phases at turns and between."""
        axial = self.one(0.0, 0.0, 0.6) * 10.0 * (period / math.tau) ** 2
        swing = self.one(0.0, 0.5, 0.5, 0.01)
        lag = self.one(0.0, 0.5 * PI, 0.7 * PI * self.part(), -26.3)
        return Motion(axial, swing, 1.0 / period, lag)

    def random_disk(self) -> Disk:
        """Friction, load and brake at 0, between, and at ties of one another."""
        friction = self.one(0.0, 0.03, 0.1, 0.6)
        force = friction * 0.12 * 0.25 * 10.0
        scale = force or 0.05
        load = self.one(0.0, 0.0, scale, -scale, 0.5 * scale, scale * self.part())
        ties = (force, abs(load), force + abs(load), abs(force - abs(load)))
        brake = self.one(*ties, scale * 2.0 ** (3.0 * self.part()), 0.0)
        return Disk(0.25, 0.5, friction, 0.12, 0.1, 10.0, 0.0, load, brake)

    def act(self) -> bool:
        """Now and then an input that acts at once; whether it begins a new ledger."""
        match int(self.rng.integers(60)):
            case 0:
                self.disk = self.random_disk()
                self.run.set_disk(self.disk)
            case 1:
                self.run.reset()
                return True
            case 2:
                target = self.random_motion(1.0 / self.motion.frequency)
                lasts = int(self.step_ns * self.one(3.0, 30.0))
                self.run.command([(self.run.time_ns + lasts, target)], lasts)
            case 3:
                self.run = Simulation.restore(json.loads(json.dumps(self.run.snapshot())))
        return False


def obeys(sample: Sample, disk: Disk, rest: float) -> None:
    """The torques at one instant; speeds below `rest` (rad/s) may have any sign."""
    slip = sample.angular_velocity - sample.platform_angular_velocity
    most = disk.friction * disk.friction_radius * sample.axial_force
    slack = 1e-12 * (most + abs(disk.load_torque) + disk.brake_torque)
    rubs, spin = sample.friction_torque, sample.angular_velocity
    assert abs(rubs) <= most + slack
    if abs(slip) > rest:
        assert rubs == pytest.approx(-math.copysign(most, slip), rel=1e-12, abs=slack)
    if sample.phase is Phase.HELD:
        assert spin == 0.0
        assert abs(rubs - disk.load_torque) <= disk.brake_torque + slack
    if sample.phase is Phase.STICKING:
        assert abs(slip) <= rest


@pytest.mark.parametrize("block", range(4))
def test_a_brake_obeys_the_inclusion(block: int) -> None:
    """Friction, brake, load, ties, offsets, fades, impulses, resets and restored checkpoints."""
    for seed in range(examples(10 * block), examples(10 * (block + 1))):
        case = Attack(seed)
        lost = 0.0
        for step in range(1, 90):
            _, is_behind = case.run.advance(step * case.step_ns, 2_000)
            assert not is_behind, seed
            sample, energy = case.run.sample(), case.run.energy()
            fastest = math.tau * case.motion.frequency
            if case.disk.brake_torque > 0.0:
                obeys(sample, case.disk, 1e-9 * fastest)
            given = [value for name, value in energy._asdict().items() if name.startswith("work")]
            others = energy.loss_sliding + energy.loss_impact_axial + energy.loss_impact_friction
            # the brake's work as all other entries tell it
            taken = sum(given) - others - (energy.kinetic + energy.potential - energy.initial)
            rounding = 1e-12 * energy.throughput
            assert abs(taken - energy.loss_brake) <= rounding, seed
            assert taken >= lost - rounding, seed
            lost = 0.0 if case.act() else taken

"""Single tosses beside the same run of the simulator, whose events are proved (test_referee.py)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.core.model import Disk, InitialState, Phase
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.maps.toss_paths import toss_paths
from bouncing_disk_ros.maps.tosses import TossSetting, motion_of, toss
from reference.cases import FIRST, NS, examples

EPS = float(np.finfo(float).eps)


def random_disk(rng: np.random.Generator) -> Disk:
    """With or without friction, preload and load torque."""
    friction, preload, load = (
        float(rng.choice([0.0, rng.uniform(low, high)]))
        for low, high in ((0.05, 2.0), (0.0, 3.0), (-0.1, 0.1))
    )
    mass, radius, gyration = rng.uniform([0.1, 0.05, 0.05], [2.0, 0.3, 0.3]).tolist()
    gravity = float(10.0 ** rng.uniform(-1.0, 2.0))
    return Disk(mass, 0.5, friction, radius, gyration, gravity, preload, load)


def test_a_toss_is_that_of_the_simulator() -> None:
    """Separation to the nanosecond; α̇, works and what is made of them, to some roundings."""
    rng, thrown = np.random.default_rng(FIRST), 0
    for _ in range(examples(60)):
        disk = random_disk(rng)
        frequency = float(10.0 ** rng.uniform(-0.5, 1.5))
        omega, pull = math.tau * frequency, disk.gravity + disk.preload / disk.mass
        setting = TossSetting(float(rng.uniform(1.1, 4.0)) * pull / omega**2, frequency, disk)
        lag, angle, tau = rng.uniform([-3.0, 0.05, 0.0], [3.0, 1.5, 6.28]).tolist()
        speed = float(rng.choice([0.0, rng.uniform(-20.0, 20.0)]))
        found = toss(lag, angle, setting, angular_velocity=speed, forcing_phase=tau)
        if not found.delay * NS > 10.0:  # it stays, or flies at once
            continue
        thrown += 1
        motion = motion_of(lag, angle, setting)
        start = InitialState(angular_velocity=speed, forcing_phase=tau)
        run, leaves = Simulation(motion, disk, start), round(float(found.delay) * NS)
        run.advance(leaves - 2)
        assert run.sample().phase is not Phase.FLIGHT
        run.advance(leaves + 2)
        sample, energy = run.sample(), run.energy()
        assert sample.phase is Phase.FLIGHT
        swing, inertia = motion.angular_amplitude * omega, disk.inertia
        grip = disk.friction * disk.friction_radius * disk.mass / inertia
        fastest = abs(speed) + swing + grip * pull * float(found.delay)
        later = 4e-9 * abs(disk.load_torque) / inertia
        final = float(found.airborne_speed)
        assert sample.angular_velocity == pytest.approx(final, abs=64 * EPS * fastest + later)
        work = float(found.input_energy)
        assert energy.work_axial + energy.work_angular == pytest.approx(
            work, abs=64 * EPS * energy.throughput
        )
        gain = 0.5 * inertia * (final**2 - speed**2)
        assert float(found.speed_ratio) == pytest.approx(final / swing, rel=4 * EPS)
        efficiency = gain / work if work > 0.0 else math.nan
        assert float(found.efficiency) == pytest.approx(efficiency, rel=1e-12, nan_ok=True)
    assert thrown > examples(60) // 3


def test_paths_of_the_hand_are_those_of_the_platform() -> None:
    setting = TossSetting(0.3, 2.0, Disk(0.5, 0.5, 0.6, 0.12, 0.1, 10.0))
    for lag, angle in ((0.7, 0.4), (-2.0, 1.1)):
        motion = motion_of(lag, angle, setting)
        found = toss_paths(lag, angle, setting, points=17)
        tau = 1.5 * math.pi + np.linspace(0.0, math.tau, 17)
        rise = motion.axial_amplitude * np.sin(tau)
        turned = 0.12 * motion.angular_amplitude * np.sin(tau + lag)
        np.testing.assert_allclose(found.axial_position, rise, atol=1e-15)
        np.testing.assert_allclose(found.arc, turned, atol=1e-15)

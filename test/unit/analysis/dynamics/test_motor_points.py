"""The means of a motor are those of the simulation itself, whatever it does."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from bouncing_disk_ros.analysis.dynamics.motor_points import (
    CHATTERS,
    CONTACT_ONLY,
    NOT_PERIODIC,
    Run,
    measure,
)
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation

MOTION = Motion(1e-6, 4e-4, 40_000.0, -0.7383651652519078)
DISK = Disk(5e-4, 0.5, 0.2, 2.5e-3, 2.83e-3, 9.80665, 22.3)
PERIOD_NS = 25_000
LEFT_OUT = 2000


def motors() -> Iterator[tuple[Motion, Disk]]:
    """From rest at 40 kHz: chattering, contact alone and held, with loads and brakes."""
    rng = np.random.default_rng(140)
    for preload in (15.3, 26.0, 31.0, 33.0):
        for _ in range(6):
            limit = DISK.friction * DISK.friction_radius * preload
            yield (
                MOTION._replace(
                    phase_lag=rng.uniform(-3, 3),
                    angular_amplitude=4e-4 * 10 ** rng.uniform(-2, 0.5),
                ),
                DISK._replace(
                    preload=preload,
                    load_torque=limit * rng.uniform(-0.8, 0.8) * rng.integers(0, 2),
                    brake_torque=limit * 10 ** rng.uniform(-2, 0.3) * rng.integers(0, 2),
                    load_inertia=4e-9 * rng.uniform(0, 2) * rng.integers(0, 2),
                ),
            )


def test_means_over_a_cycle_are_those_of_a_long_simulation() -> None:
    given = list(motors())
    found = measure(given, Run("rest"))
    assert set(found.kind.tolist()) >= {CHATTERS, CONTACT_ONLY}
    compared = 0
    for i, (motion, disk) in enumerate(given):
        if found.cycles[i] == 0:
            continue
        simulation = Simulation(motion, disk, InitialState())
        seen = []
        for periods in (LEFT_OUT, LEFT_OUT + 50 * int(found.cycles[i])):
            while simulation.advance(periods * PERIOD_NS)[1]:
                pass
            seen.append((simulation.sample(), simulation.energy()))
        (before, energy), (after, later) = seen
        t = (after.time_ns - before.time_ns) * 1e-9
        speed = (after.unwrapped_angle - before.unwrapped_angle) / t
        scale = math.tau * motion.frequency * motion.angular_amplitude
        assert found.mean_speed[i] == pytest.approx(speed, rel=1e-6, abs=1e-7 * scale), (i, disk)
        power = (later.work_axial - energy.work_axial) / t
        turning = (later.work_angular - energy.work_angular) / t
        size = abs(power) + abs(turning) + 1e-9
        assert found.axial_power[i] == pytest.approx(power, abs=1e-5 * size)
        assert found.angular_power[i] == pytest.approx(turning, abs=1e-5 * size)
        assert found.brake_power[i] == pytest.approx(
            (later.loss_brake - energy.loss_brake) / t, abs=1e-5 * size
        )
        assert found.sliding_loss[i] == pytest.approx(
            (later.loss_sliding - energy.loss_sliding) / t, abs=1e-5 * size
        )
        compared += 1
    assert compared >= 18


def test_where_nothing_repeats_the_error_says_how_far_the_mean_is() -> None:
    chaotic = [(MOTION, DISK._replace(preload=18.2, load_torque=load)) for load in (0.0, 0.002)]
    found = measure(chaotic, Run(longest=9_000))
    longer = measure(chaotic, Run(longest=90_000))
    assert found.kind.tolist() == [NOT_PERIODIC] * 2
    assert (found.measured >= 512).all()
    assert (longer.mean_speed_error < found.mean_speed_error).all()
    assert (abs(longer.mean_speed - found.mean_speed) < 4.0 * found.mean_speed_error).all()
    assert (found.contact_share == 0.0).all()
    np.testing.assert_allclose(found.impact_rate, 40_000.0, rtol=0.05)


def test_contact_is_all_of_the_time_or_none() -> None:
    found = measure([(MOTION, DISK), (MOTION, DISK._replace(preload=33.0))], Run())
    assert found.contact_share.tolist() == pytest.approx([0.0, 1.0], abs=1e-12)
    assert found.impact_rate.tolist() == pytest.approx([40_000.0, 0.0])
    assert found.friction_work_per_turn[1] == pytest.approx(
        math.tau * found.sliding_loss[1] / abs(found.mean_speed[1])
    )


def test_a_motor_followed_keeps_the_orbit_that_a_start_from_rest_does_not_find() -> None:
    """At Γ from 0.48 down to 0.34 with ε = 0.5 a rotor at rest ends with contact."""
    disks = [DISK._replace(preload=preload) for preload in np.linspace(21.0, 29.5, 12)]
    line = [(MOTION, disk) for disk in disks]
    followed = measure(line, Run("followed"), len(line))
    assert followed.period.tolist() == [1] * 12
    np.testing.assert_allclose(followed.mean_speed, measure(line, Run()).mean_speed, rtol=1e-9)
    assert (measure(line, Run("rest")).kind == CHATTERS).all()
    # beyond the end of the orbit it is lost, and not found again on the way
    there = [(MOTION, DISK._replace(preload=preload)) for preload in (29.0, 30.1, 30.5, 29.0)]
    found = measure(there, Run("followed"), 4)
    assert found.kind.tolist() == [0, 0, CHATTERS, CHATTERS]
    rows = measure([*there, *there], Run("followed"), 4)
    assert rows.kind.tolist() == [*found.kind.tolist()] * 2


def test_a_brake_that_holds_is_at_rest() -> None:
    """Pressed so that it never leaves the stator, with a brake stronger than friction."""
    held = DISK._replace(preload=40.0, brake_torque=0.2)
    found = measure([(MOTION, held)], Run("rest"))
    assert found.kind[0] == CONTACT_ONLY
    assert found.mean_speed[0] == 0.0
    assert math.isnan(found.friction_work_per_turn[0])
    assert math.isnan(found.efficiency[0])
    assert found.sliding_loss[0] > 0.0
    assert found.angular_power[0] == pytest.approx(found.sliding_loss[0], rel=1e-9)


def test_a_rotor_that_friction_turns_slowly_is_left_to_settle() -> None:
    """Γ_T = 400: 300 periods would not do."""
    heavy = DISK._replace(load_inertia=50 * DISK.inertia)
    found = measure([(MOTION, heavy._replace(load_torque=0.005))], Run())
    expected = 4e-4 * math.tau * 40_000.0 - 0.5 * 0.005 / (heavy.inertia * 40_000.0)
    assert found.mean_speed[0] == pytest.approx(expected, rel=1e-3)

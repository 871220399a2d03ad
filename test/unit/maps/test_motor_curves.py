"""Closed forms of a motor in period 1 against what the stepper settles on, over random motors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.maps import motor_curves
from bouncing_disk_ros.maps.period_one import period_one, stability_limit
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.motor_study.motor_points import BOUNCES, RUNS_AWAY, Run, measure

MOTION = Motion(1e-6, 4e-4, 40_000.0, -0.7383651652519078)
DISK = Disk(5e-4, 0.5, 0.2, 2.5e-3, 2.83e-3, 9.80665, 22.3)
RELATIVE = 1e-10


@st.composite
def motors(draw: st.DrawFn) -> tuple[Motion, Disk]:
    """Motors well inside the period-1 regime, from pizza to ultrasonic ones, turning either way."""
    part = st.floats(0.15, 0.85)
    restitution = draw(st.floats(0.3, 0.7))
    least = (1.0 - restitution) / (1.0 + restitution)
    forcing = least + draw(part) * (stability_limit(restitution) - least)
    frequency = 10.0 ** draw(st.floats(0.0, 5.0))
    gravity, mass = draw(st.floats(1.0, 20.0)), 10.0 ** draw(st.floats(-4.0, 0.0))
    preload = mass * gravity * draw(st.floats(-0.5, 10.0))
    pull = gravity + preload / mass
    amplitude = forcing * math.pi * pull / (math.tau * frequency) ** 2
    lag = (
        -math.acos(least / forcing)
        + draw(st.floats(-1.2, 1.2))
        + draw(st.sampled_from([0, math.pi]))
    )
    radius = 10.0 ** draw(st.floats(-3.0, -1.0))
    inertia = mass * (0.7 * radius) ** 2
    disk = Disk(
        mass, restitution, draw(st.floats(0.1, 1.0)), radius, 0.7 * radius, gravity, preload,
        load_inertia=inertia * draw(st.floats(0.0, 3.0)),
    )  # fmt: skip
    # the speed that one impact can give, times a number on either side of 1
    reach = motor_curves.friction_limit(disk) / (disk.inertia * frequency)
    turn = reach / math.tau / frequency * draw(st.floats(0.2, 1.8))
    return Motion(amplitude, turn, frequency, lag), disk


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(motors(), st.floats(0.02, 0.98))
def test_speed_under_a_load_is_a_straight_line_up_to_the_limit_of_friction(
    motor: tuple[Motion, Disk], part: float
) -> None:
    """With the powers and the efficiency of a load against the rotor."""
    motion, disk = motor
    torque, speed = part * motor_curves.friction_limit(disk), motor_curves.no_load_speed(*motor)
    loads = [math.copysign(torque, sign * speed) for sign in (1.0, -1.0)]
    disks = [disk._replace(load_torque=load) for load in loads]
    found = measure([(motion, one) for one in disks], Run())
    assert found["kind"].tolist() == [BOUNCES] * 2
    expected = [motor_curves.mean_speed(motion, one) for one in disks]
    top, momentum = abs(speed), disk.inertia * motion.frequency
    np.testing.assert_allclose(found["mean_speed"], expected, rtol=RELATIVE, atol=RELATIVE * top)
    line = speed - np.array(loads) / (2 * momentum)
    np.testing.assert_allclose(expected, line, rtol=1e-12, atol=1e-12 * top)
    orbit = period_one(motion, disk)
    assert orbit is not None
    output = torque * (top - 0.5 * torque / momentum)
    lost = (1.0 - disk.restitution**2) * orbit.axial_impact_velocity**2
    impacts, friction = 0.5 * disk.mass * lost * motion.frequency, 0.5 * torque**2 / momentum
    scale = impacts + friction
    power = float(found["output_power"][0])
    rounded = 1e-10 * scale  # powers that are small beside the others have their rounding
    assert power == pytest.approx(output, abs=rounded + 1e-9 * abs(output))
    assert float(found["impact_loss"][0]) == pytest.approx(impacts, rel=1e-9)
    rubbed = float(found["impact_friction_loss"][0])
    assert rubbed == pytest.approx(friction, abs=rounded + 1e-9 * friction)
    if output > 1e-3 * scale:
        apart = 1e-9 + rounded / output
        assert float(found["efficiency"][0]) == pytest.approx(output / (output + scale), rel=apart)
    elif output < 0.0:
        assert math.isnan(found["efficiency"][0])


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(motors(), st.floats(0.05, 3.0), st.floats(-0.95, 0.95))
def test_speed_under_a_brake_has_its_knee(
    motor: tuple[Motion, Disk], part: float, load: float
) -> None:
    """Below the knee the same line, beyond it I(Δα̇)²f/(2T); with a load as large at most."""
    motion, disk = motor
    speed, momentum = motor_curves.no_load_speed(motion, disk), disk.inertia * motion.frequency
    knee = min(motor_curves.friction_limit(disk), momentum * abs(speed))
    brake = part * knee / (1.0 + abs(load))
    both = disk._replace(brake_torque=brake, load_torque=load * brake)
    against = brake * (1.0 + math.copysign(load, load * speed))
    assume(abs(against - knee) > 1e-3 * knee and against > 1e-3 * knee)
    found = measure([(motion, both)], Run())
    if against < knee:
        expected = speed - math.copysign(0.5 * against / momentum, speed)
    else:
        given_speed = min(abs(speed), motor_curves.friction_limit(disk) / momentum)
        expected = math.copysign(0.5 * momentum * given_speed**2 / against, speed)
    assert motor_curves.mean_speed(motion, both) == pytest.approx(expected, rel=1e-12)
    assert float(found["mean_speed"][0]) == pytest.approx(expected, rel=RELATIVE)
    assert found["kind"][0] == BOUNCES
    assert found["output_power"][0] >= 0.0 if abs(load) == 0.0 else True


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_beyond_the_limit_the_rotor_runs_away(sign: float) -> None:
    limit = motor_curves.friction_limit(DISK)
    disks = [DISK._replace(load_torque=sign * limit * part) for part in (0.999, 1.001)]
    held = DISK._replace(load_torque=sign * limit * 1.001, brake_torque=0.01 * limit)
    found = measure([(MOTION, disk) for disk in (*disks, held)], Run())
    assert found["kind"][1] == RUNS_AWAY
    assert np.isnan(found["mean_speed"]).tolist() == [False, True, False]
    assert math.isnan(motor_curves.mean_speed(MOTION, disks[1]))


def test_regimes_along_the_preload() -> None:
    regimes = motor_curves.preload_regimes(MOTION, DISK)
    at = [axial_forcing_of(MOTION, DISK._replace(preload=preload)) for preload in regimes]
    assert at == pytest.approx([1.0 / math.pi, 1.0 / 3.0, stability_limit(0.5)], rel=1e-12)
    beside = [regimes.doubling * 0.995, regimes.doubling * 1.005, regimes.no_period_one * 0.999,
              regimes.no_period_one * 1.001, regimes.contact_lasts * 1.001]  # fmt: skip
    found = measure(
        [(MOTION, DISK._replace(preload=preload)) for preload in beside], Run(settling=3000)
    )
    assert found["period"][:3].tolist() == [2, 1, 1]
    assert found["kind"].tolist() == [BOUNCES, BOUNCES, BOUNCES, 1, 2]


def test_where_contact_lasts_period_1_can_be_beside_it_and_without_it_no_closed_forms() -> None:
    """For (1−ε)/(1+ε) < 1/π: both are found at one preload, each from its own start."""
    disk = DISK._replace(restitution=0.6)
    regimes = motor_curves.preload_regimes(MOTION, disk)
    assert regimes.contact_lasts < regimes.no_period_one
    between = disk._replace(preload=0.5 * (regimes.contact_lasts + regimes.no_period_one))
    from_rest = measure([(MOTION, between)], Run(start="rest"))
    bouncing = measure([(MOTION, between)], Run())
    assert (from_rest["kind"][0], bouncing["kind"][0], bouncing["period"][0]) == (2, BOUNCES, 1)
    pressed = DISK._replace(preload=200.0)
    assert math.isnan(motor_curves.no_load_speed(MOTION, pressed))
    assert math.isnan(motor_curves.mean_speed(MOTION, pressed))

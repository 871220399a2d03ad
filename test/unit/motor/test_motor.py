"""What a motor settles on, and maps of it: means that longer runs confirm, closed forms."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.maps import motor_curves
from bouncing_disk_ros.motor_study.compute import Motor, derived, stall
from bouncing_disk_ros.motor_study.motor_points import (
    CHATTERS,
    CONTACT_ONLY,
    MEANS,
    NOT_PERIODIC,
    UNSETTLED,
    Run,
    measure,
)
from bouncing_disk_ros.motor_study.options import DEFINITION
from bouncing_disk_ros.parameters import Value
from bouncing_disk_ros.run.presets import load_preset
from bouncing_disk_ros.study import named
from support.shown import result_of

MOTION = Motion(1e-6, 4e-4, 40_000.0, -0.7383651652519078)
DISK = Disk(5e-4, 0.5, 0.2, 2.5e-3, 2.83e-3, 9.80665, 22.3)
PERIOD_NS = 25_000


def assert_within(
    found: Mapping[str, NDArray[Any]], longer: Mapping[str, NDArray[Any]], errors: float
) -> None:
    """Each mean is that of the longer run within so many of their errors."""
    for name in MEANS:
        short, long = found[name], longer[name]
        known = np.isfinite(short) & np.isfinite(long)
        assert known.any(), name
        apart = abs(short - long)[known]
        allowed = np.hypot(found[f"{name}_error"], longer[f"{name}_error"])[known]
        rounding = 1e-12 * abs(long[known])
        assert (apart <= errors * allowed + rounding).all(), (name, apart / allowed)


def test_where_nothing_repeats_the_errors_say_how_far_the_means_are() -> None:
    """Chaos at Γ = 0.55, and at Γ = 40 with ε = 0.85, where the powers take long to be known."""
    chaotic = [(MOTION, DISK._replace(preload=18.2, load_torque=load)) for load in (0.0, 0.002)]
    wild = DISK._replace(preload=0.245, restitution=0.85, load_torque=2e-5, brake_torque=1e-5)
    chaotic += [(MOTION, wild)]
    found = measure(chaotic, Run(longest=9_000))
    longer = measure(chaotic, Run(longest=90_000))
    assert found["kind"].tolist() == longer["kind"].tolist() == [NOT_PERIODIC] * 3
    assert (found["measured"] >= 512).all()
    assert_within(found, longer, 4.0)
    assert (found["axial_power_error"] > 0.0).all()
    assert (found["contact_share"][:2] == 0.0).all()
    np.testing.assert_allclose(found["impact_rate"][:2], 40_000.0, rtol=0.05)


def test_a_speed_that_still_drifts_is_not_taken_for_a_mean() -> None:
    """The period-1 orbit is barely unstable here: the motion leaves it over some 800 periods."""
    motion = Motion(1e-6, 4e-4, 40_000.0, -0.7383651652519078)
    disk = DISK._replace(gyration_radius=0.00282842712474619, preload=20.65326633165829,
                         load_torque=8.040201005025126e-05)  # fmt: skip
    found = measure([(motion, disk)], Run())
    settled = measure([(motion, disk)], Run(settling=5_000))
    apart = abs(found["mean_speed"] - settled["mean_speed"])[0]
    assert apart <= 3.0 * found["mean_speed_error"][0]


def test_where_roundings_decide_the_means_are_those_of_motors_equal_within_them() -> None:
    """It comes back after 42 periods, or 95, or as many as the last digit of ε has it."""
    motion = Motion(
        6.272433458335658e-07, 0.0001582891617782492, 7572.60735889837, -0.43275486701401267
    )
    disk = Disk(
        mass=0.000289954493726261, restitution=0.7597222196725844, friction=0.24404804379755368,
        friction_radius=0.02815191547424804, gyration_radius=0.025585201589502612,
        gravity=0.029710301109808948, preload=0.28366674026542665,
        load_torque=0.00039253333928555194, load_inertia=8.133295643917608e-08,
    )  # fmt: skip
    amplitudes = [motion.axial_amplitude * (1.0 + 2e-15 * k) for k in range(4)]
    found = measure(
        [(motion._replace(axial_amplitude=one), disk) for one in amplitudes], Run("rest")
    )
    assert found["kind"].tolist() == [NOT_PERIODIC] * 4
    assert (found["mean_speed_error"] > 0.0).all()
    longer = measure([(motion, disk)] * 4, Run("rest", longest=150_000))
    assert_within(found, longer, 4.0)


def drift(motion: Motion, disk: Disk, speed: float) -> float:
    """By how much a rotor's speed changes from period 100 to 300, of a disk put on the platform."""
    simulation = Simulation(motion, disk, InitialState(angular_velocity=speed))
    seen = []
    for periods in (100, 300):
        while simulation.advance(periods * PERIOD_NS)[1]:
            pass
        seen.append(simulation.sample().angular_velocity)
    return float(seen[1] - seen[0])


def test_a_heavy_rotor_has_the_speed_at_which_it_does_not_drift() -> None:
    """It would take up to 1e7 periods to come to it; on the platform and in chatter."""
    heavy = [
        DISK._replace(preload=preload, load_inertia=1e-4, load_torque=load)
        for preload in (40.0, 23.0)
        for load in (0.0, 0.004)
    ]
    found = measure([(MOTION, disk) for disk in heavy], Run("rest"))
    assert found["kind"].tolist() == [CONTACT_ONLY] * 2 + [CHATTERS] * 2
    assert (found["mean_speed_error"] < 1e-7).all()
    for disk, speed in zip(heavy, found["mean_speed"].tolist(), strict=True):
        at, above, below = (drift(MOTION, disk, speed + d) for d in (0.0, 1.0, -1.0))
        assert above < 0.0 < below
        # the speed at one phase differs from the mean by what a period can change it
        swing = motor_curves.friction_limit(disk) / (disk.inertia * MOTION.frequency)
        assert abs(at) <= min(abs(above), abs(below)) * (swing + 1e-3)
    # slow against the period, friction balances the load: ∫(g + s̈) sgn(α̇ − β̇) dt = 0
    phases = (np.arange(200_000) + 0.5) * (math.tau / 200_000)
    peak = math.tau * MOTION.frequency * MOTION.angular_amplitude
    pull = heavy[0].gravity + heavy[0].preload / heavy[0].mass
    pressed = pull - MOTION.axial_amplitude * (math.tau * MOTION.frequency) ** 2 * np.sin(phases)
    turning = peak * np.cos(phases + MOTION.phase_lag)
    balance = np.mean(pressed * np.sign(found["mean_speed"][0] - turning)) / pull
    assert abs(balance) < 1e-4
    assert found["mean_speed"][0] == pytest.approx(-45.80, abs=0.005)


def test_what_does_not_settle_has_no_mean_and_a_brake_that_holds_is_at_rest() -> None:
    """Chaos with a rotor too heavy for the periods allowed; a rotor that nothing turns or slows."""
    heavy = DISK._replace(preload=18.2, load_inertia=1e-4)
    free = DISK._replace(friction=0.0)
    found = measure([(MOTION, heavy), (MOTION, free)], Run())
    assert found["kind"].tolist() == [UNSETTLED] * 2
    assert np.isnan(found["mean_speed"]).all()
    assert all(np.isnan(found[f"{name}_error"]).all() for name in MEANS)
    held = DISK._replace(preload=40.0, brake_torque=0.2)
    still = measure([(MOTION, held)], Run("rest"))
    assert still["kind"][0] == CONTACT_ONLY
    assert still["mean_speed"][0] == 0.0
    assert math.isnan(still["friction_work_per_turn"][0])
    assert math.isnan(still["efficiency"][0])
    assert still["sliding_loss"][0] > 0.0
    assert still["angular_power"][0] == pytest.approx(still["sliding_loss"][0], rel=1e-9)


def test_motors_measured_together_have_the_bits_of_each_one_alone() -> None:
    """Their flights are found once, in chaos with chatter too; with loads, lags and preloads."""
    motors = [
        (MOTION._replace(phase_lag=lag), DISK._replace(preload=preload, **load))
        for lag in (MOTION.phase_lag, 0.4)
        for preload in (16.8, 18.2, 22.3)
        for load in ({"load_torque": 0.002}, {"load_torque": -0.001}, {"brake_torque": 0.001})
    ]
    run = Run(longest=3_000)
    together = measure(motors, run)
    assert NOT_PERIODIC in together["kind"].tolist()
    for i in range(len(motors)):
        alone = measure([motors[i]], run)
        assert together.keys() == alone.keys()
        for name in together:
            assert_same_bits(together[name][i], alone[name][0], name)


def assert_same_bits(one: float, other: float, name: str) -> None:
    """One number is the other, or both are nan."""
    assert one == other or (math.isnan(one) and math.isnan(other)), (name, one, other)


def test_rise_and_stop_times_are_those_of_constant_torque() -> None:
    """A rotor that slips all the way: it rises by T* − T_B and stops by T* + T_B."""
    disk = DISK._replace(load_inertia=2e-7, brake_torque=0.002)
    found = measure([(MOTION, disk)], Run())
    limit, speed = motor_curves.friction_limit(disk), float(found["mean_speed"][0])
    risen = disk.inertia * speed / (limit - 0.002)
    stopped = disk.inertia * speed / (limit + 0.002)
    period = 1.0 / MOTION.frequency
    for part, rise, stop in (
        (1.0 - math.exp(-1.0), found["rise_time"], found["stop_time"]),
        (0.95, found["rise_time_95"], found["stop_time_95"]),
    ):
        assert rise[0] == pytest.approx(part * risen, abs=period)
        assert stop[0] == pytest.approx(part * stopped, rel=1e-12)


def test_a_motor_followed_keeps_the_orbit_that_a_start_from_rest_does_not_find() -> None:
    """At Γ from 0.48 down to 0.34 with ε = 0.5 a rotor at rest ends with contact."""
    disks = [DISK._replace(preload=preload) for preload in np.linspace(21.0, 29.5, 12)]
    line = [(MOTION, disk) for disk in disks]
    followed = measure(line, Run("followed"), len(line))
    assert followed["period"].tolist() == [1] * 12
    np.testing.assert_allclose(
        followed["mean_speed"], measure(line, Run())["mean_speed"], rtol=1e-9
    )
    assert (measure(line, Run("rest"))["kind"] == CHATTERS).all()
    # beyond the end of the orbit it is lost, and not found again on the way
    there = [(MOTION, DISK._replace(preload=preload)) for preload in (29.0, 30.1, 30.5, 29.0)]
    found = measure(there, Run("followed"), 4)
    assert found["kind"].tolist() == [0, 0, CHATTERS, CHATTERS]
    rows = measure([*there, *there], Run("followed"), 4)
    assert rows["kind"].tolist() == [*found["kind"].tolist()] * 2


# --- the study ------------------------------------------------------------------------------------
SMALL: dict[str, Value] = {"x_count": 9, "y_begin": 21.0, "y_end": 30.0, "y_count": 4}


def test_the_defaults_are_the_preset_swum_and_a_plane_may_stand_in_part() -> None:
    preset = load_preset("swum")
    table = DEFINITION.options
    shared = {name: value for name, value in preset.items() if name in table}
    assert len(shared) == 10
    assert {name: table[name].default for name in shared} == shared
    named("motor", x_begin=-0.1, x_end=0.1)
    named("motor", y_begin=25.0, y_end=40.0, brake_torque=1.0)
    named("motor", x_axis="angular_amplitude", x_begin=0.0, x_end=1e-3)


def test_a_map_of_preload_and_load_has_stall_and_no_load_speed() -> None:
    study, found = named("motor", **SMALL), result_of("motor", **SMALL)
    assert isinstance(study, Motor)
    assert found["mean_speed"].dims == ("preload", "load_torque")
    assert found["mean_speed"].attrs["units"] == "rad/s"
    for i, preload in enumerate(found["preload"].values):
        motion, disk = study.motor_at({"preload": preload, "load_torque": 0.0})
        assert float(found["no_load_speed"][i]) == pytest.approx(
            motor_curves.no_load_speed(motion, disk), rel=1e-9
        )
        assert float(found["stall_torque"][i]) == pytest.approx(
            motor_curves.friction_limit(disk), rel=1e-9
        )
        row = found["mean_speed"].values[i]
        beyond = found["load_torque"].values > motor_curves.friction_limit(disk)
        assert np.isnan(row).tolist() == beyond.tolist()
        assert ((found["kind"].values[i] == 4) == beyond).all()
    best = found["efficiency"].max("load_torque")
    np.testing.assert_array_equal(found["best_efficiency"].values, best.values)
    regimes = motor_curves.preload_regimes(*study.motor_at({"preload": 21.0, "load_torque": 0.0}))
    assert found.attrs["preload_doubling"] == regimes.doubling


def test_the_best_phase_lag_meets_the_impact() -> None:
    """θ = −τ_imp; half a turn beside it the rotor turns as fast, but backwards."""
    found = result_of(
        "motor", x_axis="phase_lag", x_begin=-1.0, x_end=-0.4, x_count=61, y_begin=22.3,
        y_end=22.3, y_count=1,
    )  # fmt: skip
    assert float(found["best_phase_lag"][0]) == pytest.approx(-0.7384, abs=0.006)
    assert float(found["best_speed"][0]) == pytest.approx(100.53, rel=1e-4)
    assert "stall_torque" not in found


def test_stall_is_where_the_speed_is_0_and_no_load_that_turns_back_counts_for_the_best_lag() -> (
    None
):
    loads = np.linspace(-2.0, 4.0, 7)
    falling = 2.0 - loads
    assert stall(loads, falling, 10.0) == pytest.approx(2.0)
    assert stall(loads, np.where(loads > 1.5, np.nan, falling), 1.5) == 1.5
    coarse = np.array([0.0, 1.0, 2.0]), np.array([2.0, 0.5, np.nan])
    assert stall(*coarse, 1.9) == pytest.approx(4.0 / 3.0), "before friction gives way"
    assert math.isnan(stall(coarse[0], np.array([2.0, np.nan, np.nan]), 0.9)), "none below T*"
    assert math.isnan(stall(loads, falling + 10.0, 10.0)), "the axis ends before"
    assert stall(loads, -1.0 - loads, 10.0) == pytest.approx(-1.0), "it turns the other way"
    assert math.isnan(stall(loads[4:], falling[4:], 10.0)), "0 is not on the axis"
    assert stall(loads, -loads, 10.0) == 0.0
    speed = xr.DataArray([[40.0, 60.0, 20.0], [-90.0, 10.0, -100.0]], dims=("load", "phase_lag"))
    result = xr.Dataset({"mean_speed": speed}, {"phase_lag": [-1.5, -0.7, 1.5]})
    found = derived(result, "load", "phase_lag", lambda _: np.zeros(0))
    assert found["best_phase_lag"].values.tolist() == [-0.7, -0.7]
    assert found["best_speed"].values.tolist() == [60.0, 10.0]

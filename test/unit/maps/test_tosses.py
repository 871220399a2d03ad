"""Single tosses: the rides of the core's stepper, their measures, extremes, paths and refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.core.model import Disk, InitialState, Phase
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.single_toss import (
    TOSS_NONE,
    TOSS_SLID,
    TOSS_STAYS,
    TOSS_STUCK,
    TOSS_UNRESOLVED,
)
from bouncing_disk_ros.maps.tosses import (
    CODES,
    LOWEST,
    PAPER,
    PAPER_DISK,
    Pixels,
    Toss,
    TossSetting,
    motion_of,
    separation_phase,
    toss,
    toss_pixels,
)
from reference.cases import FIXED, NS

EPS = float(np.finfo(float).eps)
OMEGA = math.tau * PAPER.frequency
LOADED = PAPER_DISK._replace(preload=1.5, load_torque=0.05, friction=0.3, mass=0.4)


def stepper(
    lag: float, angle: float, setting: TossSetting, speed: float, tau: float, delay: float
) -> tuple[float, float, Phase]:
    """α̇, the platform's work and the phase just after separation, by the simulation itself."""
    start = InitialState(angular_velocity=speed, forcing_phase=tau)
    run = Simulation(motion_of(lag, angle, setting), setting.disk, start)
    run.advance(math.ceil(delay * NS) + 1)
    energy, sample = run.energy(), run.sample()
    return sample.angular_velocity, energy.work_axial + energy.work_angular, sample.phase


@given(
    lag=st.floats(-4.0, 4.0),
    angle=st.floats(0.01, 1.3),
    speed=st.just(0.0) | st.floats(-40.0, 40.0),
    tau=st.just(LOWEST) | st.floats(0.0, 6.28),
    disk=st.sampled_from([PAPER_DISK, LOADED]),
)
@FIXED
def test_a_toss_is_a_run_of_the_simulation(
    lag: float, angle: float, speed: float, tau: float, disk: Disk
) -> None:
    setting = TossSetting(disk=disk)
    found = toss(lag, angle, setting, angular_velocity=speed, forcing_phase=tau)
    assert found.code in (TOSS_SLID, TOSS_STUCK, TOSS_NONE)
    final, work, phase = stepper(lag, angle, setting, speed, tau, float(found.delay))
    assert phase == Phase.FLIGHT
    # After the separation only the load torque acts, for 2 ns at most. The bounds that steer the
    # search for roots may differ by an ulp, so instants differ by a few: each moves α̇ by the
    # acceleration of friction, of the order of ω times the speeds.
    scale = abs(speed) + OMEGA * 0.25 / 0.12 + 100.0
    late = 3e-9 * disk.load_torque / (disk.mass * disk.gyration_radius**2)
    assert float(found.airborne_speed) == pytest.approx(final, rel=0, abs=64 * EPS * scale + late)
    energy = 0.5 * disk.mass * (disk.gyration_radius * scale) ** 2 + disk.mass * 25.0
    assert float(found.input_energy) == pytest.approx(work, rel=0, abs=256 * EPS * energy)


def test_measures_are_what_their_names_say() -> None:
    found = toss([0.0, 1.0], 0.6, angular_velocity=3.0)
    inertia = PAPER_DISK.mass * PAPER_DISK.gyration_radius**2
    gain = 0.5 * inertia * (found.airborne_speed**2 - 9.0)
    np.testing.assert_allclose(found.rotational_energy, gain, rtol=1e-13)
    np.testing.assert_allclose(found.efficiency, gain / found.input_energy, rtol=1e-13)
    swing = OMEGA * 0.25 * math.sin(0.6) / 0.12
    np.testing.assert_allclose(found.speed_ratio, found.airborne_speed / swing, rtol=1e-14)
    delay = (math.pi / 2 + separation_phase(0.6)) / OMEGA
    np.testing.assert_allclose(found.delay, delay, rtol=4 * EPS)


@given(lag=st.floats(-3.2, 3.2), angle=st.floats(0.01, 1.4))
@FIXED
def test_from_rest_no_disk_outruns_its_platform(lag: float, angle: float) -> None:
    found, mirrored = toss(lag, angle), toss(lag + math.pi, angle)
    assert abs(found.speed_ratio) <= 1.0 + 4 * EPS
    assert 0.0 <= found.efficiency < 1.0
    # sin(θ + π) is −sin θ but for the rounding of θ + π, and a crease doubles nothing
    swing = OMEGA * 0.25 / 0.12
    assert mirrored.airborne_speed == pytest.approx(-found.airborne_speed, abs=1e-13 * swing)
    assert mirrored.efficiency == pytest.approx(found.efficiency, abs=1e-13)


def test_mass_changes_no_ratio() -> None:
    lag, angle = np.linspace(-3, 3, 7)[:, None], np.linspace(0.1, 1.4, 5)
    heavy = toss(lag, angle, TossSetting(disk=PAPER_DISK._replace(mass=8.0)))
    light = toss(lag, angle)
    np.testing.assert_allclose(heavy.airborne_speed, light.airborne_speed, rtol=1e-14)
    np.testing.assert_allclose(heavy.efficiency, light.efficiency, rtol=1e-13)
    np.testing.assert_allclose(heavy.input_energy, 32.0 * light.input_energy, rtol=1e-13)


@pytest.mark.parametrize("disk", [LOADED, PAPER_DISK])  # one by one, in lanes
def test_a_table_may_be_cut_anywhere(disk: Disk) -> None:
    rng = np.random.default_rng(11)
    low, high = [0.0, 0.0, -4.0, 0.0, -30.0], [0.3, 2.0, 4.0, 6.28, 30.0]
    starts = rng.uniform(low, high, (500, 5))
    whole = toss_pixels(starts, 3.0, disk)
    assert {TOSS_SLID, TOSS_NONE, TOSS_STAYS} <= set(whole.code.tolist())
    for cut in (slice(0, 1), slice(123, 400), slice(499, 500), slice(7, 7)):
        part = toss_pixels(starts[cut], 3.0, disk)
        for name in Pixels._fields:
            np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[cut])


def test_a_small_table_is_a_part_of_a_map() -> None:
    """Few tosses ride one after the other, many in lanes: apart by roundings of speeds of 40."""
    lag, angle = np.linspace(-3, 3, 40), np.linspace(0.05, 1.2, 40)
    whole = toss(lag, angle)
    for k in range(0, 40, 5):
        part = toss(lag[k : k + 5], angle[k : k + 5])
        np.testing.assert_array_equal(part.code, whole.code[k : k + 5])
        for name in Toss._fields[:-1]:
            found, expected = getattr(part, name), getattr(whole, name)[k : k + 5]
            np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-12)


def test_how_a_toss_ends() -> None:
    """Γ = 1/π at cos φ_L = g/(ω²c); at τ = π/2 the platform is already falling away."""
    limit = math.acos(10.0 / OMEGA**2 / 0.25)
    angles = np.array([limit - 1e-9, limit + 1e-9, math.pi / 2])
    stays = toss(0.0, angles)
    assert stays.code.tolist() == [TOSS_SLID, TOSS_STAYS, TOSS_STAYS]
    for name in Toss._fields[:-1]:
        values = getattr(stays, name)
        assert not np.isnan(values[0])
        assert np.isnan(values[1:]).all()
    assert np.isnan(separation_phase(angles)).tolist() == [False, True, True]
    at_once = toss(0.3, 0.5, angular_velocity=7.0, forcing_phase=math.pi / 2)
    assert at_once.code == TOSS_NONE
    assert list(map(float, at_once[:1] + at_once[4:6])) == [7.0, 0.0, 0.0]
    assert np.isnan(at_once.efficiency)
    lifted = toss(0.0, 0.0)
    assert lifted.code == TOSS_STUCK
    assert lifted.airborne_speed == 0.0
    assert np.isnan(lifted.speed_ratio)
    start = np.array([[0.2, 1.0, 1.5, LOWEST, 0.0]])  # slip, and slip the other way
    assert toss_pixels(start, 3.0, PAPER_DISK, 1).code[0] == TOSS_UNRESOLVED
    assert np.isnan(toss_pixels(start, 3.0, PAPER_DISK, 1).airborne_speed[0])
    assert toss_pixels(start, 3.0, PAPER_DISK, 5).code[0] == TOSS_SLID
    assert set(CODES) == {TOSS_SLID, TOSS_STUCK, TOSS_NONE, TOSS_STAYS, TOSS_UNRESOLVED}


def test_without_friction_nothing_turns() -> None:
    found = toss(
        0.4, 0.7, TossSetting(disk=PAPER_DISK._replace(friction=0.0)), angular_velocity=5.0
    )
    assert found.airborne_speed == 5.0
    assert found.efficiency == 0.0


def test_numbers_of_numpy_will_do() -> None:
    disk = PAPER_DISK._replace(friction=np.float64(0.6), gravity=np.float64(10.0))
    setting = TossSetting(np.float64(0.25), np.float64(3.0), disk)
    assert toss(0.1, 0.7, setting) == toss(0.1, 0.7)


def test_whole_turns_of_the_start_phase_change_nothing() -> None:
    here, there = toss(0.2, 0.7), toss(0.2, 0.7, forcing_phase=LOWEST - 4 * math.pi)
    assert there.airborne_speed == pytest.approx(here.airborne_speed, rel=1e-13)
    assert toss(0.2, 0.7, forcing_phase=-1e-17).code == toss(0.2, 0.7, forcing_phase=0.0).code


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"phase_lag": math.nan}, "phase_lag"),
        ({"phase_lag": [0.0, math.inf]}, "phase_lag"),
        ({"phase_lag": "north"}, "phase_lag"),
        ({"amplitude_angle": -0.1}, "amplitude_angle"),
        ({"amplitude_angle": 45.0}, "amplitude_angle"),
        ({"amplitude_angle": [0.1, math.nan]}, "amplitude_angle"),
        ({"angular_velocity": math.inf}, "angular_velocity"),
        ({"forcing_phase": math.nan}, "forcing_phase"),
        ({"phase_lag": [0.0, 1.0], "amplitude_angle": [0.1, 0.2, 0.3]}, "toss"),
        ({"setting": PAPER._replace(arc_amplitude=0.0)}, "arc_amplitude"),
        ({"setting": PAPER._replace(arc_amplitude=math.nan)}, "arc_amplitude"),
        ({"setting": PAPER._replace(frequency=-3.0)}, "frequency"),
        ({"setting": TossSetting(disk=PAPER_DISK._replace(mass=-1.0))}, "mass"),
        ({"setting": TossSetting(disk=PAPER_DISK._replace(preload=-9.0))}, "preload"),
    ],
)
def test_what_cannot_be_used_is_refused(arguments: dict[str, Any], field: str) -> None:
    with pytest.raises(InputError) as raised:
        toss(**{"phase_lag": 0.0, "amplitude_angle": 0.5, **arguments})
    assert raised.value.field == field

"""Corners where something just touches: zeros of w_T, of N, of the gap, and inputs on an event."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from bouncing_disk_ros.core.model import IMPACT_DTYPE, Disk, ImpactKind, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation

SECOND = 10**9
PIZZA = Disk(0.25, 0.5, 0.6, 0.12, 0.1, 10.0)
INERTIA = PIZZA.mass * PIZZA.gyration_radius**2
GRIP = PIZZA.friction * PIZZA.friction_radius * PIZZA.gravity / PIZZA.gyration_radius**2
STILL = Motion(0.0, 0.0, 1.0, 0.0)


def forced(forcing: float, angular: float = 0.0, lag: float = 0.0, f: float = 1.0) -> Motion:
    amplitude = forcing * math.pi * PIZZA.gravity / (math.tau * f) ** 2
    return Motion(amplitude, angular, f, lag)


# 1 ---------------------------------------------------------------------------------------------


def test_1_a_load_that_touches_zero_keeps_contact() -> None:
    """Γ = 1/π: a = 0 with ȧ = 0 and ä > 0 at the crest; started at it, or coming to it."""
    frequency = 1 / math.tau
    omega = math.tau * frequency
    disk = PIZZA._replace(gravity=1.0)
    motion = Motion(1.0 / omega**2, 0.0, frequency, 0.0)
    for phase in (0.5 * math.pi, 0.0):
        run = Simulation(motion, disk, InitialState(forcing_phase=phase))
        for _ in range(100):
            rows, _ = run.advance(run.time_ns + SECOND)
            assert run.sample().phase != Phase.FLIGHT or run.sample().gap < 1e-15
            assert len(rows) <= 1  # a rounding above 1/π would hop by a rounding


@pytest.mark.parametrize("end", [0.3, 0.55, 0.8])
def test_1_a_fade_that_ends_beyond_separation_launches(end: float) -> None:
    """From a still platform into Γ = 2: in contact until a falls through 0, then in flight."""
    run = Simulation(STILL, PIZZA, InitialState(forcing_phase=0.0))
    run.command([(round(end * SECOND), forced(2.0))], crossfade_ns=round(end * SECOND))
    phases = []
    while run.time_ns < 2 * SECOND:
        run.advance(run.time_ns + SECOND // 1000)
        sample = run.sample()
        phases.append(sample.phase)
        assert sample.gap >= 0.0
        if sample.phase != Phase.FLIGHT:
            assert sample.axial_force >= 0.0
    assert phases[0] != Phase.FLIGHT
    assert Phase.FLIGHT in phases


# 3 ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("depth", [1e-6, 1e-9, 1e-12])
def test_3_a_graze_is_an_impact_if_the_gap_falls_below_zero(depth: float) -> None:
    """Γ = 1.5: a disk that meets the crest with no relative speed, or misses it by `depth`."""
    motion = forced(1.5)
    omega = math.tau
    late, crest = 0.05, 0.5 * math.pi
    start = crest - omega * late
    fall = PIZZA.gravity * late  # at the crest ṡ = 0 and the disk turns round
    height = motion.axial_amplitude * (1 - math.sin(start)) - 0.5 * PIZZA.gravity * late**2
    for offset in (depth, -depth):
        begin = InitialState(height + offset, fall, forcing_phase=start)
        rows, _ = Simulation(motion, PIZZA, begin).advance(round(1.5 * late * SECOND))
        if offset > 0:
            assert len(rows) == 0
            continue
        falling = motion.axial_amplitude * omega**2 - PIZZA.gravity  # −a at the crest
        speed = math.sqrt(2 * depth * falling)
        assert len(rows) >= 1
        assert rows["kind"][0] == ImpactKind.IMPACT
        # the next order of the gap, s⁗d⁴/24, is (ωd)² of it
        allowed = (omega * speed / falling) ** 2 + 1e-15 / depth
        assert rows["axial_impact_velocity"][0] == pytest.approx(-speed, rel=allowed + 1e-9)


# 4, 5 ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("offset", [1e-9, 1e-13, 0.0, -1e-15, 1e-15])
def test_4_a_tangential_touch_keeps_its_sign(offset: float) -> None:
    """α̇ falls by k and touches β̇ = Φω cos τ where β̈ = −k: sliding goes on with the same sign."""
    omega, touch = math.tau, 0.5
    swing = GRIP / (omega**2 * math.sin(touch))
    motion = Motion(0.0, swing, 1.0, 0.0)
    speed = swing * omega * math.cos(touch) + GRIP * touch / omega + offset
    run = Simulation(motion, PIZZA, InitialState(angular_velocity=speed, forcing_phase=0.0))
    run.advance(round(0.99 * touch / omega * SECOND))
    assert run.sample().phase == Phase.SLIDING
    run.advance(round(0.2 * SECOND))
    sample = run.sample()
    assert sample.phase == Phase.SLIDING
    assert sample.friction_torque == pytest.approx(-INERTIA * GRIP, rel=1e-14)
    # a dip of δ below zero could stick for √(δ/(Φω³)) at most, in which friction changes nothing
    assert sample.angular_velocity == pytest.approx(
        speed - GRIP * 0.2, abs=1e-6 if offset <= 0 else 1e-12
    )


def test_5_slip_before_separation_where_the_torque_vanishes_too_fast() -> None:
    """θ = −τ_sep but |Ṙ| > μ a_e|Ṅ|: R and N vanish together, yet it slips before."""
    sep = math.asin(1 / (math.pi * 0.45))
    weight_rate = PIZZA.friction * PIZZA.friction_radius * PIZZA.mass * math.cos(sep)
    weight_rate *= forced(0.45).axial_amplitude * math.tau**3
    for ratio, phase in ((1.5, Phase.SLIDING), (0.7, Phase.STICKING)):
        swing = ratio * weight_rate / (INERTIA * math.tau**3)
        motion = forced(0.45, swing, -sep)
        start = sep - 0.3
        spin = swing * math.tau * math.cos(start - sep)
        run = Simulation(motion, PIZZA, InitialState(angular_velocity=spin, forcing_phase=start))
        run.advance(round(0.299 / math.tau * SECOND))
        assert run.sample().phase == phase
        run.advance(round(0.301 / math.tau * SECOND))
        assert run.sample().phase == Phase.FLIGHT


# 6 ---------------------------------------------------------------------------------------------


def test_6_zeros_of_slip_without_friction_are_no_events() -> None:
    run = Simulation(forced(0.2, 1.0), PIZZA._replace(friction=0.0), InitialState())
    rows, behind = run.advance(100_000 * SECOND, max_events=20)
    assert not behind
    assert len(rows) == 0
    assert run.sample().angular_velocity == 0.0


def test_6_a_load_beyond_friction_turns_the_disk_for_ever() -> None:
    """|T_L| > μ a_e N: it never sticks; α̇ grows against the limit of friction."""
    disk = PIZZA._replace(load_torque=2 * INERTIA * GRIP)
    run = Simulation(STILL, disk, InitialState())
    rows, behind = run.advance(10_000 * SECOND, max_events=50)
    assert not behind
    assert len(rows) == 0
    sample = run.sample()
    assert sample.phase == Phase.SLIDING
    assert sample.angular_velocity == pytest.approx(-GRIP * 1e4, rel=1e-13)
    assert sample.friction_torque == pytest.approx(INERTIA * GRIP, rel=1e-14)


# 9 ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [5e-324, 1e-310, 1e-160, 1 - 1e-9, 1.0 - 2**-53, 1.0])
@pytest.mark.parametrize("impulse", [5e-324, 1e-300, 1e-160, 1e-20, 1e-14])
def test_9_bounces_too_small_for_the_clock_neither_hang_nor_lose_the_disk(
    restitution: float, impulse: float
) -> None:
    """A flight that does not move the forcing phase is no flight: contact, and no endless loop."""
    disk = PIZZA._replace(restitution=restitution)
    run = Simulation(forced(0.3), disk, InitialState(forcing_phase=1.0))
    run.apply_impulse(SECOND, impulse, 0.0)
    _, behind = run.advance(2 * SECOND, max_events=100_000)
    sample = run.sample()
    assert sample.gap < 1e-12
    assert not behind or run.time_ns >= SECOND
    if impulse <= 1e-20:
        assert sample.phase in (Phase.STICKING, Phase.SLIDING)
    run = Simulation(forced(0.3), disk, InitialState(height=0.1, forcing_phase=1.0))
    rows, _ = run.advance(SECOND, max_events=1000)
    assert len(rows) == 1 or restitution > 1e-100


def test_9_a_bounce_of_the_smallest_speed_leaves_a_platform_that_falls_away() -> None:
    """u = ε w is 1.5e-323 m/s: a step that it allows is rounded to 0."""
    disk = Disk(0.3, 5e-324, 0.0, 0.12, 0.106, 9.81, preload=-0.125 * 0.3 * 9.81)
    motion = Motion(0.08673944398508296, 0.0, 3.0, 0.0)
    disks = disk, disk._replace(restitution=0.0)
    runs = [Simulation(motion, one, InitialState()) for one in disks]
    times = [run.advance(2 * SECOND)[0]["time"] for run in runs]
    assert len(times[0]) > 0
    np.testing.assert_allclose(times[0], times[1], rtol=0, atol=1e-12)


# 10 --------------------------------------------------------------------------------------------


def test_10_an_angular_kick_in_contact_slips_and_sticks_again() -> None:
    run = Simulation(STILL, PIZZA, InitialState())
    run.apply_impulse(SECOND, 0.0, 0.5 * INERTIA)
    run.advance(SECOND)
    assert run.sample().phase == Phase.SLIDING
    assert run.sample().angular_velocity == 0.5
    rows, _ = run.advance(SECOND + math.ceil(0.5 / GRIP * SECOND) + 1)
    assert len(rows) == 0
    sample = run.sample()
    assert sample.phase == Phase.STICKING
    assert sample.angle == pytest.approx(0.5**2 / (2 * GRIP), rel=1e-14)
    assert run.energy().loss_sliding == pytest.approx(0.5 * INERTIA * 0.25, rel=1e-13)


# 11, 12, 13 ------------------------------------------------------------------------------------


def test_11_after_a_reset_the_run_repeats_itself() -> None:
    motion = forced(0.6, 1.0, 0.3)
    run = Simulation(motion, PIZZA, InitialState(height=0.1))
    first, _ = run.advance(20 * SECOND)
    run.reset()
    assert run.time_ns == 20 * SECOND
    second, _ = run.advance(40 * SECOND)
    physical = [n for n in IMPACT_DTYPE.names or () if n not in ("index", "time", "cycles")]
    assert len(first) > 50
    for name in physical:
        np.testing.assert_array_equal(first[name], second[name])
    assert np.all(second["cycles"] >= first["cycles"][-1])
    np.testing.assert_allclose(second["time"] - 20, first["time"], rtol=0, atol=1e-13)


def test_12_a_checkpoint_in_a_chatter_and_before_a_held_row() -> None:
    """Rows that wait for the next advance, open rows and queued kicks are part of a checkpoint."""
    disk = PIZZA._replace(restitution=0.9)
    run = Simulation(STILL, disk, InitialState(0.2), chatter_report_speed=100.0)
    run.apply_impulse(5 * SECOND, 0.1, 0.01)
    for instant in (SECOND // 2, SECOND, 2 * SECOND):
        run.advance(instant)
        twin = Simulation.restore(json.loads(json.dumps(run.snapshot())))
        assert twin.sample() == run.sample()
        rows, _ = twin.advance(8 * SECOND)
        original = Simulation.restore(run.snapshot())
        assert rows.tobytes() == original.advance(8 * SECOND)[0].tobytes()
    run.apply_impulse(run.time_ns, -0.5, 0.0)
    twin = Simulation.restore(run.snapshot())
    assert twin.advance(run.time_ns)[0].tobytes() == run.advance(run.time_ns)[0].tobytes()


def test_13_a_preload_may_lift_almost_the_whole_weight() -> None:
    disk = PIZZA._replace(preload=-0.999 * PIZZA.mass * PIZZA.gravity)
    run = Simulation(STILL, disk, InitialState(height=0.005))
    rows, _ = run.advance(2 * SECOND)
    assert rows["time"][0] == pytest.approx(1.0, rel=1e-12)
    assert rows["axial_impact_velocity"][0] == pytest.approx(-0.01, rel=1e-12)


def test_13_angles_and_velocities_are_those_of_the_start() -> None:
    start = InitialState(0.5, 1.0, -3.0, 100.0, 0.7)
    sample = Simulation(forced(0.5, 1.0), PIZZA, start).sample()
    assert sample.unwrapped_angle == pytest.approx(100.0, rel=1e-15)
    assert (sample.axial_velocity, sample.angular_velocity) == (1.0, -3.0)
    assert sample.forcing_phase == 0.7
    assert sample.axial_position == sample.platform_position + 0.5

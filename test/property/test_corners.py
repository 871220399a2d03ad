"""The rules for the corners of the model, one test (or more) each; numbers are theirs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, ImpactKind, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation

G = 10.0
F = 3.0
W = math.tau * F
SECOND = 10**9
PERIOD = round(SECOND / F)
PIZZA = Disk(0.3, 0.5, 0.6, 0.12, 0.3 / (2 * math.sqrt(2)), G)
CONTACT = (Phase.STICKING, Phase.SLIDING)


def motion(forcing: float, angular: float = 0.5, lag: float = 0.0) -> Motion:
    """A steady motion at 3 Hz of a given Γ."""
    return Motion(forcing * math.pi * G / W**2, angular, F, lag)


def tau_sep(forcing: float) -> float:
    """Forcing phase of separation, eq. 3."""
    return math.asin(1 / (math.pi * forcing))


def ns_of(phase: float) -> int:
    """Nanoseconds in which the forcing phase grows by `phase`."""
    return round(phase / W * SECOND)


def rows_until(sim: Simulation, until_ns: int) -> NDArray[Any]:
    """All rows up to an instant; fails when the simulation falls behind."""
    rows, behind = sim.advance(until_ns)
    assert not behind
    return rows


# 1: gap = 0 and u = 0 --------------------------------------------------------------------------


@pytest.mark.parametrize("forcing", [0.45, 2.0])
def test_1_at_rest_on_the_platform_the_load_decides(forcing: float) -> None:
    up, down = math.pi / 2, 1.5 * math.pi  # crest: a < 0; trough: a > 0
    start = InitialState(forcing_phase=up)
    assert Simulation(motion(forcing), PIZZA, start).sample().phase == Phase.FLIGHT
    start = InitialState(forcing_phase=down)
    assert Simulation(motion(forcing), PIZZA, start).sample().phase in CONTACT


def test_1_an_inelastic_impact_on_a_falling_platform_is_followed_by_flight() -> None:
    """ε = 0 where a < 0: the disk does not stay."""
    phase = math.pi / 2 + 0.2
    m = motion(0.8)
    climb = m.axial_amplitude * W * math.cos(phase)
    start = InitialState(0.0, climb - 0.5, 0.0, 0.0, phase)
    sim = Simulation(m, PIZZA._replace(restitution=0.0), start)
    rows = rows_until(sim, 0)
    assert len(rows) == 1
    assert rows["axial_impact_velocity"][0] == pytest.approx(-0.5, rel=1e-15)
    assert sim.sample().phase == Phase.FLIGHT


def test_1_a_parameter_change_that_lifts_the_load_launches() -> None:
    sim = Simulation(motion(0.45), PIZZA, InitialState(forcing_phase=0.4))
    rows_until(sim, ns_of(tau_sep(0.45) - 0.45))
    assert sim.sample().phase in CONTACT
    sim.set_disk(PIZZA._replace(preload=-0.5 * PIZZA.mass * G))  # now a < 0
    assert sim.sample().phase == Phase.FLIGHT
    rows_until(sim, sim.time_ns + PERIOD // 10)
    assert sim.sample().gap > 0


# 2: launches -----------------------------------------------------------------------------------


@pytest.mark.parametrize("forcing", [0.319, 0.34, 0.45, 1.0, 30.0])
def test_2_separation_at_its_phase_is_left_once_and_for_good(forcing: float) -> None:
    """At τ_sep gap, velocity and acceleration are all zero: no loop, no re-contact."""
    sep = tau_sep(forcing)
    sim = Simulation(motion(forcing), PIZZA, InitialState(forcing_phase=sep - 0.1))
    instant = ns_of(0.1)
    rows = rows_until(sim, instant - 2)
    assert sim.sample().phase in CONTACT
    rows = rows_until(sim, instant + 2)
    assert len(rows) == 0
    assert sim.sample().phase == Phase.FLIGHT
    rows_until(sim, instant + ns_of(0.5 * (math.pi - 2 * sep)))
    assert sim.sample().gap > 0


@pytest.mark.parametrize("forcing", [0.0, 0.1, 0.3, 1 / math.pi])
def test_2_weak_forcing_never_leaves(forcing: float) -> None:
    sim = Simulation(motion(forcing), PIZZA, InitialState())
    for _ in range(50):
        assert len(rows_until(sim, sim.time_ns + PERIOD // 7)) == 0
        assert sim.sample().phase in CONTACT
        assert sim.sample().gap == 0


def test_2_launch_exactly_at_separation() -> None:
    """An initial state at the very phase of separation flies and lands once, not at once."""
    sep = tau_sep(0.45)
    for phase in (math.nextafter(sep, 0), sep, math.nextafter(sep, 9)):
        sim = Simulation(motion(0.45), PIZZA, InitialState(forcing_phase=phase))
        first = rows_until(sim, 3 * PERIOD)[0]
        assert first["time"] > 0.05
        assert first["axial_impact_velocity"] < -0.1


# 3: impacts at separation, grazes --------------------------------------------------------------


def test_3_an_impact_at_the_separation_phase_is_ordinary() -> None:
    sep = tau_sep(0.45)
    m = motion(0.45)
    climb = m.axial_amplitude * W * math.cos(sep)
    sim = Simulation(m, PIZZA, InitialState(0.0, climb - 1.0, 0.0, 0.0, sep))
    row = rows_until(sim, 0)[0]
    assert row["kind"] == ImpactKind.IMPACT
    assert row["axial_velocity"] - climb == pytest.approx(0.5, rel=1e-14)


# 4: stick and slip -----------------------------------------------------------------------------


def test_4_stick_until_the_limit_then_slip_against_the_torque() -> None:
    """A platform that only rotates: slip begins where m a_g²|β̈| = μ a_e m g."""
    limit = PIZZA.friction * PIZZA.friction_radius * G / PIZZA.gyration_radius**2
    m = Motion(0.0, 1.5 * limit / W**2, F, 0.0)
    sim = Simulation(m, PIZZA, InitialState(forcing_phase=0.0, angular_velocity=0.0))
    # start with α̇ = β̇ (sticking): β̈ = −Φω² sin τ reaches −limit at sin τ = 2/3
    start = InitialState(0.0, None, m.angular_amplitude * W, 0.0, 0.0)
    sim = Simulation(m, PIZZA, start)
    assert sim.sample().phase == Phase.STICKING
    slip = math.asin(2 / 3)
    rows_until(sim, ns_of(slip) - 2)
    assert sim.sample().phase == Phase.STICKING
    rows_until(sim, ns_of(slip) + 2)
    sample = sim.sample()
    assert sample.phase == Phase.SLIDING
    assert sample.friction_torque < 0  # the platform brakes: friction holds the disk back
    inertia = PIZZA.mass * PIZZA.gyration_radius**2
    assert sample.friction_torque == pytest.approx(-inertia * limit, rel=1e-14)


def test_4_a_slip_reverses_where_it_cannot_stick() -> None:
    """Friction far too weak to stick: w_T changes sign again and again, the torque with it."""
    weak = PIZZA._replace(friction=0.01)
    sim = Simulation(Motion(0.0, 0.5, F, 0.0), weak, InitialState())
    signs = set()
    for _ in range(40):
        rows_until(sim, sim.time_ns + PERIOD // 10)
        sample = sim.sample()
        assert sample.phase == Phase.SLIDING
        slip = sample.angular_velocity - sample.platform_angular_velocity
        if abs(slip) > 1e-6:
            assert sample.friction_torque * slip < 0
            signs.add(sample.friction_torque > 0)
    assert signs == {True, False}


# 5: the load vanishes while sticking -----------------------------------------------------------


@pytest.mark.parametrize("forcing", [0.45, 0.7, 1.5])
def test_5_the_best_lag_sticks_up_to_separation(forcing: float) -> None:
    """θ = −τ_sep: the torque needed vanishes with the load; the disk leaves with ν = 1."""
    sep = tau_sep(forcing)
    m = motion(forcing, 0.05, -sep)
    sim = Simulation(m, PIZZA, InitialState(0.0, None, 0.05 * W * math.cos(1.5 * math.pi - sep)))
    rows_until(sim, ns_of(sep + 0.5 * math.pi) - 3)
    assert sim.sample().phase == Phase.STICKING
    rows_until(sim, ns_of(sep + 0.5 * math.pi) + 3)
    sample = sim.sample()
    assert sample.phase == Phase.FLIGHT
    assert sample.angular_velocity / (W * 0.05) == pytest.approx(1.0, abs=1e-15)


def test_5_otherwise_slip_precedes_separation() -> None:
    sep = tau_sep(0.45)
    sim = Simulation(motion(0.45, 0.5, 1.0), PIZZA, InitialState())
    rows_until(sim, ns_of(sep + 0.5 * math.pi) - 1000)
    before = sim.sample()
    assert before.phase == Phase.SLIDING
    rows_until(sim, sim.time_ns + 2000)
    after = sim.sample()
    assert after.phase == Phase.FLIGHT
    # at separation α̇ stays as it is: over 2 µs friction has next to no load left
    assert after.angular_velocity == pytest.approx(before.angular_velocity, abs=1e-7)


# 6: no friction, load torque, endless sliding --------------------------------------------------


def test_6_without_friction_nothing_sticks_and_nothing_turns() -> None:
    sim = Simulation(motion(0.2), PIZZA._replace(friction=0.0), InitialState())
    for _ in range(20):
        rows_until(sim, sim.time_ns + PERIOD // 3)
        sample = sim.sample()
        assert sample.phase == Phase.SLIDING
        assert sample.friction_torque == 0 == sample.angular_velocity


def test_6_huge_friction_sticks_at_once() -> None:
    sim = Simulation(motion(0.2), PIZZA._replace(friction=1e9), InitialState(angular_velocity=3.0))
    rows_until(sim, 10)
    sample = sim.sample()
    assert sample.phase == Phase.STICKING
    assert sample.angular_velocity == sample.platform_angular_velocity


@pytest.mark.parametrize("speed", [5.0, -5.0])
def test_6_a_load_torque_is_like_a_hanging_weight(speed: float) -> None:
    """In flight α̈ = −T_L/(m a_g²) whatever the sign of α̇."""
    disk = PIZZA._replace(load_torque=0.01)
    sim = Simulation(motion(0.0), disk, InitialState(10.0, None, speed))
    rows_until(sim, SECOND)
    lag = 0.01 / (disk.mass * disk.gyration_radius**2)
    sample = sim.sample()
    assert sample.phase == Phase.FLIGHT
    assert sample.angular_velocity == pytest.approx(speed - lag, rel=1e-14)
    assert sample.unwrapped_angle == pytest.approx(speed - lag / 2, rel=1e-14)


def test_6_an_impact_without_slip_has_no_angular_impulse() -> None:
    m = Motion(0.0, 0.0, F, 0.0)
    rows = rows_until(Simulation(m, PIZZA, InitialState(height=0.1)), SECOND)
    assert len(rows) > 5
    assert not rows["angular_impulse"].any()


def test_6_endless_slow_sliding_is_skipped_not_stepped() -> None:
    """Ten million periods with w_T far from 0: closed form, in a handful of events."""
    disk = PIZZA._replace(friction=1e-12)
    sim = Simulation(Motion(1e-12, 1e-3, 1e5, 0.3), disk, InitialState(angular_velocity=1e4))
    rows, behind = sim.advance(100 * SECOND, max_events=50)
    assert not behind
    assert len(rows) == 0
    lost = 1e-12 * disk.friction_radius * G / disk.gyration_radius**2 * 100
    # α̇ itself is rounded to 2e-12: the change of 1e-7 is known to a few 1e-5 of itself
    assert 1e4 - sim.sample().angular_velocity == pytest.approx(lost, abs=1e-11)


# 7, 8: chattering ------------------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize(("spin", "load"), [(1e4, 0.0), (0.0, 0.001)], ids=["slips", "sticks"])
def test_7_a_disk_dropped_on_a_still_platform_stops_in_closed_form(
    restitution: float, spin: float, load: float
) -> None:
    """T = t₀(1 + ε)/(1 − ε) with the fall time t₀; ΣF̂ by momentum; the row tells the end.

    ΣĤ is −μ a_e ΣF̂ where all impacts slip; where they stick, it takes what the load brings.
    """
    disk = PIZZA._replace(restitution=restitution, load_torque=load)
    start = InitialState(height=0.2, angular_velocity=spin)
    sim = Simulation(Motion(0.0, 0.0, F, 0.0), disk, start, chatter_report_speed=100.0)
    fall = math.sqrt(2 * 0.2 / G)
    end = fall * (1 + restitution) / (1 - restitution)
    rows = rows_until(sim, round((end + 1) * SECOND))
    assert rows["kind"].tolist() == [ImpactKind.CHATTER_TAIL]
    assert rows["time"][0] == pytest.approx(end, rel=1e-13)
    # the momentum that gravity gave over the whole time
    pressed = disk.mass * G * end
    assert rows["axial_impulse"][0] == pytest.approx(pressed, rel=1e-12)
    turned = -disk.friction * disk.friction_radius * pressed if spin else load * end
    assert rows["angular_impulse"][0] == pytest.approx(turned, rel=1e-12)
    assert sim.sample().phase in CONTACT


def test_7_what_is_reported_changes_nothing() -> None:
    ends = []
    for speed in (0.0, 0.01, 100.0):
        sim = Simulation(motion(0.6), PIZZA, InitialState(), chatter_report_speed=speed)
        rows_until(sim, 20 * PERIOD)
        ends.append((sim.sample(), sim.energy()))
    assert ends[0] == ends[1] == ends[2]


@pytest.mark.parametrize("load", [0.0, 0.05])
def test_8_friction_in_a_chatter_sticks_or_slips_as_in_the_single_impacts(load: float) -> None:
    """The closed form takes over later with a shorter horizon: both ways end alike."""
    disk = PIZZA._replace(load_torque=load)
    whole = Simulation(motion(0.6), disk, InitialState())
    halted = Simulation(motion(0.6), disk, InitialState())
    for _ in range(400):  # an input that changes nothing, every so often: chatter is cut by it
        goal = halted.time_ns + PERIOD // 97
        rows_until(halted, goal)
        halted.apply_impulse(goal, 0.0, 0.0)
        rows_until(whole, goal)
    a, b = whole.sample(), halted.sample()
    assert a.phase == b.phase
    assert a.angular_velocity == pytest.approx(b.angular_velocity, abs=1e-10)
    assert a.unwrapped_angle == pytest.approx(b.unwrapped_angle, abs=1e-10)
    assert a.axial_position == pytest.approx(b.axial_position, abs=1e-12)


# 9: cut chatters, budgets ----------------------------------------------------------------------


def test_9_an_input_in_a_chatter_closes_its_row_as_cut() -> None:
    sim = Simulation(Motion(0.0, 0.0, F, 0.0), PIZZA, InitialState(height=0.2),
                     chatter_report_speed=100.0)  # fmt: skip
    fall = math.sqrt(2 * 0.2 / G)
    cut = round(2.9 * fall * SECOND)  # the end would be at 3
    rows_until(sim, cut)
    sim.apply_impulse(cut, 0.3, 0.0)
    rows = rows_until(sim, 20 * SECOND)
    assert rows["kind"].tolist() == [ImpactKind.CHATTER_CUT, ImpactKind.CHATTER_TAIL]
    # flights take 1, then 1, 1/2, 1/4, ... of the fall time: 1 + Σ < 2.9
    assert rows["count"][0] == 1 + sum(1 + 2 - 2 * 0.5**n < 2.9 for n in range(1, 50))
    assert sim.rows_total == 2


def test_9_nearly_elastic_bouncing_exhausts_the_budget_not_the_patience() -> None:
    disk = PIZZA._replace(restitution=1 - 1e-6)
    sim = Simulation(motion(0.2), disk, InitialState(height=1e-3))
    rows, behind = sim.advance(10**6 * SECOND, max_events=5000)
    assert behind
    assert sim.time_ns < 10**6 * SECOND
    assert len(rows) == 5000


def test_9_an_elastic_disk_bounces_for_ever() -> None:
    sim = Simulation(Motion(0.0, 0.0, F, 0.0), PIZZA._replace(restitution=1.0), InitialState(0.2))
    rows = rows_until(sim, 100 * SECOND)
    np.testing.assert_allclose(rows["axial_impact_velocity"], -2.0, rtol=1e-13)
    flight = np.diff(rows["time"])
    np.testing.assert_allclose(flight, 0.4, rtol=1e-12)


@pytest.mark.parametrize("lag", [0.1, 0.7, 2.0, -1.3])
def test_4_a_disk_that_sticks_goes_through_a_cross_fade_without_slipping(lag: float) -> None:
    m = motion(0.2, 0.02, lag)
    sim = Simulation(m, PIZZA, InitialState(0.0, None, 0.02 * W * math.cos(1.5 * math.pi + lag)))
    sim.command([(2 * SECOND, m._replace(angular_amplitude=0.03, frequency=2.9))], SECOND)
    for end in (SECOND, 2 * SECOND):
        for instant in (end - 1, end, end + 1):
            rows_until(sim, instant)
            assert sim.sample().phase == Phase.STICKING


def test_a_fade_of_a_nanosecond_under_a_falling_disk_stays_finite() -> None:
    """It takes 1/1000 of a period; the landing lies many fades ahead, where the blend must not be
    evaluated."""
    disk = Disk(0.5, 1.0, 0.3, 0.1, 0.1, G)
    sim = Simulation(Motion(0.0, 0.0, 2.0, 0.0), disk, InitialState(0.0134, -1.1))
    sim.command([(1, Motion(0.0, 0.0, 3.0, 1.0))], crossfade_ns=1)
    assert sim.motion_in_force.end_ns == 333_333
    rows = rows_until(sim, SECOND // 50)
    speed = math.sqrt(1.1**2 + 2 * G * 0.0134)
    assert rows["axial_impact_velocity"][0] == pytest.approx(-speed, rel=1e-13)
    assert rows["time"][0] == pytest.approx((speed - 1.1) / G, rel=1e-13)


# 10: order at one instant ----------------------------------------------------------------------


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_10_a_kick_down_in_contact_is_an_impact(restitution: float) -> None:
    disk = PIZZA._replace(restitution=restitution)
    sim = Simulation(Motion(0.0, 0.0, F, 0.0), disk, InitialState())
    sim.apply_impulse(SECOND, -0.6, 0.0)
    rows = rows_until(sim, SECOND)
    assert rows["axial_impact_velocity"].tolist() == [-2.0]
    assert rows["time"][0] == 1.0
    assert sim.sample().axial_velocity == 2.0 * restitution


def test_10_a_kick_up_launches_without_friction() -> None:
    sim = Simulation(Motion(0.0, 0.0, F, 0.0), PIZZA, InitialState(angular_velocity=50.0))
    sim.apply_impulse(0, 0.6, 0.0)
    assert len(rows_until(sim, 1000)) == 0
    sample = sim.sample()
    assert sample.phase == Phase.FLIGHT
    assert sample.angular_velocity == 50.0


def test_10_kicks_of_one_instant_act_together_and_turn_first() -> None:
    """−1 and +1 cancel before the impact law sees them; an angular kick acts before it."""
    sim = Simulation(Motion(0.0, 0.0, F, 0.0), PIZZA, InitialState())
    for axial, angular in ((-0.3, 0.0), (0.3, 0.0)):
        sim.apply_impulse(SECOND, axial, angular)
    assert len(rows_until(sim, 2 * SECOND)) == 0
    for axial, angular in ((0.0, 0.01), (-0.3, 0.0)):
        sim.apply_impulse(3 * SECOND, axial, angular)
    row = rows_until(sim, 3 * SECOND)[0]
    assert row["angular_impact_velocity"] == pytest.approx(
        0.01 / (PIZZA.mass * PIZZA.gyration_radius**2), rel=1e-14
    )
    assert row["angular_impulse"] < 0


# 11: reset -------------------------------------------------------------------------------------


def test_11_reset_clears_fades_queue_and_books_and_time_goes_on() -> None:
    sim = Simulation(motion(0.45), PIZZA, InitialState())
    sim.command([(4 * SECOND, motion(0.6))])
    sim.apply_impulse(5 * SECOND, 0.1, 0.0)
    rows_until(sim, 2 * SECOND)
    cycles, index = sim.sample().cycles, sim.rows_total
    sim.reset()
    assert sim.time_ns == 2 * SECOND
    assert sim.pending == ()
    assert sim.latest_target == motion(0.45)
    energy = sim.energy()
    # w_T of the start is the rounding of cos(3π/2): the slip that ends it at once is booked
    works = (energy.work_axial, energy.work_angular, energy.work_impulses, energy.work_parameters)
    losses = (energy.loss_impact_axial, energy.loss_impact_friction, energy.loss_sliding)
    assert sum(abs(value) for value in (*works, *losses)) < 1e-28
    sample = sim.sample()
    assert sample.turns == 0
    assert abs(sample.angle) < 1e-28
    assert sample.cycles in (cycles, cycles + 1)
    assert rows_until(sim, 4 * SECOND)["index"][0] == index


# 12: bits --------------------------------------------------------------------------------------
# (patterns of ticks, checkpoints and processors: test_invariants.py, unit/core/test_simulation.py)


def test_12_looking_does_not_move_the_anchor() -> None:
    sim, other = (Simulation(motion(0.55), PIZZA, InitialState()) for _ in range(2))
    for _ in range(1000):
        sim.advance(sim.time_ns + PERIOD // 13)
        sim.sample()
    other.advance(sim.time_ns)
    assert sim.snapshot()["engine"] == other.snapshot()["engine"]


# 13: the start ---------------------------------------------------------------------------------


def test_13_touching_with_a_downward_velocity_is_an_impact_at_zero() -> None:
    sim = Simulation(motion(0.45), PIZZA, InitialState(0.0, -1.0, 0.0, 0.0, math.pi))
    row = rows_until(sim, 0)[0]
    climb = -motion(0.45).axial_amplitude * W
    assert row["time"] == 0
    assert row["axial_impact_velocity"] == pytest.approx(-1.0 - climb, rel=1e-14)


# Degenerate platforms and long runs ------------------------------------------------------------


@pytest.mark.parametrize("m", [Motion(0.0, 0.5, F, 0.1), Motion(0.04, 0.0, F, 0.1),
                               Motion(0.0, 0.0, F, 0.1)])  # fmt: skip
def test_a_platform_that_does_not_move_one_way_or_the_other(m: Motion) -> None:
    sim = Simulation(m, PIZZA, InitialState(height=0.05, angular_velocity=2.0))
    rows = rows_until(sim, 30 * PERIOD)
    assert len(rows) > 3
    energy = sim.energy()
    assert abs(energy.residual) < 1e-13 * energy.throughput
    if m.axial_amplitude == 0:
        assert sim.sample().phase in CONTACT


def test_a_thousand_million_periods_at_rest_cost_nothing() -> None:
    """Sticking at 100 kHz for three hours; the phase is still that of the clock."""
    sim = Simulation(Motion(1e-12, 1e-10, 1e5, 0.3), PIZZA, InitialState())
    rows, behind = sim.advance(10_000 * SECOND, max_events=20)
    assert not behind
    assert len(rows) == 0
    sample = sim.sample()
    assert sample.phase == Phase.STICKING
    assert sample.forcing_phase == pytest.approx(1.5 * math.pi, abs=3e-15)
    assert sample.cycles == 10**9

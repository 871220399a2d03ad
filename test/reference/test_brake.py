"""Loads of the disk against closed forms: load torque, dry brake, load inertia."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase, join_rows
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.proof.event_trace import trace
from bouncing_disk_ros.run.input_records import Record, from_json, to_json
from bouncing_disk_ros.run.session import Session
from reference.cases import FIXED, NS, SLOW, Case, examples, runs
from support.replayed import replayed

# --- contact: held, let go ------------------------------------------------------------------------
PRESSED = Disk(0.25, 0.5, 0.6, 0.12, 0.1, 9.81)
GRIP = 0.6 * 0.12 * 0.25  # μ a_e m


def test_a_strong_brake_holds_the_disk_for_good() -> None:
    """Γ < 1/π: the friction of the platform that slides beneath, by quadrature over |β̇|."""
    motion = Motion(0.02, 0.7, 3.0, 0.4)
    disk = PRESSED._replace(brake_torque=2.0 * GRIP * 9.81, load_torque=0.3 * GRIP * 9.81)
    run = Simulation(motion, disk, InitialState(0.0, None, 0.0, 0.3, 0.1))
    run.advance(10**9 + 123)
    assert run.sample().phase is Phase.HELD
    begin, at = run.energy(), run.time_ns
    assert run.sample().angular_velocity == 0.0
    run.advance(at + 7_654_321_987)
    end = run.energy()
    w = math.tau * 3.0

    def power(t: NDArray[np.float64]) -> NDArray[np.float64]:
        tau = 0.1 + w * t
        rate = 0.7 * w * np.cos(tau + 0.4)
        return np.asarray(GRIP * (9.81 - 0.02 * w * w * np.sin(tau)) * np.abs(rate))

    first, last = at / NS, (at + 7_654_321_987) / NS
    turns = [(math.pi * (k + 0.5) - 0.5) / w for k in range(200)]
    nodes = np.array([first, *(t for t in turns if first < t < last), last])
    # half a turn of two sines by 20 points: to rounding
    x, weights = np.polynomial.legendre.leggauss(20)
    middle, half = 0.5 * (nodes[1:] + nodes[:-1]), 0.5 * np.diff(nodes)
    parts = half * (power(middle[:, None] + half[:, None] * x) @ weights)
    expected = math.fsum(parts.tolist())
    assert end.loss_sliding - begin.loss_sliding == pytest.approx(expected, rel=1e-12)
    assert end.work_angular - begin.work_angular == pytest.approx(expected, rel=1e-12)
    assert run.sample().unwrapped_angle == 0.3
    assert run.sample().friction_torque != 0.0


@pytest.mark.parametrize("load", [0.0, 0.4])
def test_a_held_disk_lets_go_where_friction_outgrows_the_brake(load: float) -> None:
    """|T_L ± μ a_e N| = T_B, N = m(g − Aω² sin τ): a sine in closed form, to 40 digits."""
    motion = Motion(0.02, 0.9, 3.0, -0.3)
    brake = 1.2 * GRIP * 9.81
    disk = PRESSED._replace(brake_torque=brake, load_torque=load * GRIP * 9.81)
    run = Simulation(motion, disk, InitialState(0.0, None, 0.0, 0.0, 0.5))
    found = [e for e in trace(run, 2 * NS) if e.before.phase is Phase.HELD and e.after is not None]
    ends = [event for event in found if event.after.phase is Phase.SLIDING]  # type: ignore[union-attr]
    assert len(ends) > 4
    mpmath.mp.dps = 40
    w = mpmath.mpf(math.tau * 3.0)
    for event in ends:
        side = event.before.slip_sign
        force = (mpmath.mpf(disk.brake_torque) * side - disk.load_torque) / side / mpmath.mpf(GRIP)
        sine = (mpmath.mpf(9.81) - force) / (mpmath.mpf(0.02) * w * w)
        roots = [mpmath.asin(sine), mpmath.pi - mpmath.asin(sine)]
        ahead = min((root - mpmath.mpf(event.before.tau)) % (2 * mpmath.pi) for root in roots)
        slope = abs(0.02 * float(w) ** 3 * math.cos(event.before.tau + float(ahead)))
        allowed = 16 * 2.0**-53 * (9.81 + brake / GRIP) / slope
        assert abs(event.delay - float(ahead / w)) <= allowed + 4 * 2.0**-53 * event.delay


@given(
    friction=st.floats(0.2, 1.0),
    swing=st.floats(0.1, 1.5),
    lag=st.floats(-3.0, 3.0),
    brake=st.floats(0.05, 0.9),
    load=st.sampled_from([0.0, -0.1, 0.2]),
)
@settings(SLOW, max_examples=examples(10))
def test_slides_end_where_the_platform_is_caught_or_the_disk_stops(
    friction: float, swing: float, lag: float, brake: float, load: float
) -> None:
    """To 40 digits: α̇ and w_T of each slide keep their signs until one is 0 at its end."""
    force = friction * 0.12 * 0.25 * 9.81
    motion = Motion(0.02, swing, 3.0, lag)
    disk = PRESSED._replace(friction=friction, brake_torque=brake * force, load_torque=load * force)
    run = Simulation(motion, disk, InitialState(0.0, None, 3.0, 0.0, 0.2))
    mpmath.mp.dps = 40
    w, grip = mpmath.mpf(math.tau * 3.0), mpmath.mpf(friction * 0.12 * 0.25) / disk.inertia
    kinds = set()
    for event in trace(run, 3 * NS):
        state, after = event.before, event.after
        if state.phase is not Phase.SLIDING or after is None or event.delay == 0.0:
            continue
        torques = mpmath.mpf(disk.load_torque), mpmath.mpf(disk.brake_torque)

        def at(t: mpmath.mpf, spin: float) -> tuple[mpmath.mpf, mpmath.mpf]:
            tau = state.tau + w * t  # noqa: B023 (used before the next event)
            rise = 0.02 * w * (mpmath.cos(tau) - mpmath.cos(mpmath.mpf(state.tau)))  # noqa: B023
            drag = (torques[0] + spin * torques[1]) / disk.inertia  # noqa: B023
            speed = state.omega - state.slip_sign * grip * (9.81 * t + rise) - drag * t  # noqa: B023
            return speed, speed - swing * w * mpmath.cos(tau + lag)

        middle = at(mpmath.mpf(event.delay) / 2, 1.0)[0]
        spin = math.copysign(1.0, state.omega or float(middle))
        speed, slip = at(mpmath.mpf(event.delay), spin)
        scale = abs(state.omega) + float(w) * swing + 9.81 * float(grip) * event.delay
        if after.phase is Phase.HELD or after.omega == 0.0:
            kinds.add("stops")
            assert abs(speed) <= 64 * 2.0**-53 * scale
        elif after.phase is Phase.STICKING or after.slip_sign != state.slip_sign:
            kinds.add("catches")
            assert abs(slip) <= 64 * 2.0**-53 * scale
        for k in range(1, 50):
            speed, slip = at(mpmath.mpf(event.delay) * k / 50, spin)
            assert speed * spin >= -1e-14
            assert slip * state.slip_sign >= -1e-14
    assert kinds or run.sample().phase is not Phase.SLIDING


def test_a_brake_without_motion_of_the_platform_ends_the_slip_at_rest() -> None:
    """Φ = 0, A = 0: α̇ falls at (μ a_e m g + T_B)/I to 0 and stays there."""
    disk = PRESSED._replace(brake_torque=0.005, load_inertia=0.001)
    run = Simulation(Motion(0.0, 0.0, 3.0, 0.0), disk, InitialState(angular_velocity=5.0))
    slows = (GRIP * 9.81 + 0.005) / disk.inertia
    run.advance(20 * NS)
    assert run.sample().angular_velocity == 0.0
    assert run.sample().phase is Phase.STICKING
    assert run.sample().unwrapped_angle == pytest.approx(12.5 / slows, rel=1e-14)
    energy = run.energy()
    assert energy.loss_brake == pytest.approx(0.005 * 12.5 / slows, rel=1e-14)
    assert run.sample().friction_torque == 0.0  # nothing moves: the least friction


# --- any run --------------------------------------------------------------------------------------
@given(case=runs(brake=True), parts=st.lists(st.integers(1, 500), min_size=3, max_size=12))
@settings(FIXED, max_examples=examples(50))
def test_a_brake_only_takes(case: Case, parts: list[int]) -> None:
    """Its loss never falls, whatever the interval, and the ledger balances to rounding."""
    run = case.start()
    last, now = 0.0, 0
    for part in parts:
        now += part * 10**7
        run.advance(now)
        energy = run.energy()
        assert energy.loss_brake >= last
        assert abs(energy.residual) <= 1e-12 * energy.throughput
        last = energy.loss_brake


@given(case=runs(brake=True), ticks=st.lists(st.integers(1, 10**9), min_size=1, max_size=20))
@settings(FIXED, max_examples=examples(50))
def test_bits_with_a_brake_do_not_depend_on_the_pattern_of_ticks(
    case: Case, ticks: list[int]
) -> None:
    end = 3 * NS
    once, often = case.start(), case.start()
    rows = [once.advance(end)[0]]
    parts = [often.advance(min(now, end))[0] for now in np.cumsum(ticks)]
    parts.append(often.advance(end)[0])
    assert b"".join(part.tobytes() for part in rows) == b"".join(p.tobytes() for p in parts)
    assert once.sample() == often.sample()


@given(case=runs(), seconds=st.floats(0.1, 3.0))
@settings(FIXED, max_examples=examples(50))
def test_a_changed_inertia_keeps_the_speed(case: Case, seconds: float) -> None:
    """The step of the energy is work of parameters."""
    run = case.start()
    run.advance(round(seconds * NS))
    before, energy = run.sample(), run.energy()
    run.set_disk(run.disk._replace(load_inertia=run.disk.inertia))
    after = run.sample()
    assert (after.angular_velocity, after.unwrapped_angle) == (
        before.angular_velocity, before.unwrapped_angle,
    )  # fmt: skip
    step = run.energy().work_parameters - energy.work_parameters
    own = run.disk.mass * run.disk.gyration_radius**2
    rounding = 4e-16 * run.energy().throughput  # of the energies whose difference the step is
    assert step == pytest.approx(0.5 * own * before.angular_velocity**2, rel=1e-12, abs=rounding)


def test_loads_changed_while_it_runs_replay_bit_for_bit() -> None:
    records: list[Record] = []
    session = Session(parameters.complete({"axial_amplitude": 0.03}), records.append)
    batches = []
    for values in (
        {"brake_torque": 0.05},
        {"load_inertia": 0.002, "load_torque": 0.01},
        {"brake_torque": 1.0},
        {"brake_torque": 0.0, "load_inertia": 0.0},
    ):
        session.set_parameters(parameters.checked(values))
        session.advance(session.time_ns + 1_234_567_891)
        batches += [rows for rows in session.take_rows() if len(rows)]
        session.snapshot()
    rows = join_rows(batches)
    assert len(rows) > 10
    for first in (0, len(records) // 2):  # from the start, and from a snapshot under a brake
        again, _ = replayed(
            [from_json(to_json(record)) for record in records[first:]], session.time_ns
        )
        assert again.tobytes() == rows[len(rows) - len(again) :].tobytes()
        assert len(again) > 0
    assert session.simulation.energy().loss_brake > 0.0

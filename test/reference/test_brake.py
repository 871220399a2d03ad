"""Loads of the disk against closed forms: load torque, dry brake, load inertia.

Random runs with these loads, and ties of their torques, are in test_inclusion.py.
"""

from __future__ import annotations

import math
from typing import Any

import mpmath
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bouncing_disk_ros import simulate
from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.proof.event_trace import trace
from reference.cases import NS, SLOW, examples

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


@pytest.mark.parametrize("load", [0.0, 0.4])
def test_a_held_disk_lets_go_where_friction_outgrows_the_brake(load: float) -> None:
    """|T_L ± μ a_e N| = T_B, N = m(g − Aω² sin τ): a sine in closed form, to 40 digits."""
    motion = Motion(0.02, 0.9, 3.0, -0.3)
    brake = 1.2 * GRIP * 9.81
    disk = BODY._replace(brake_torque=brake, load_torque=load * GRIP * 9.81)
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
    disk = BODY._replace(friction=friction, brake_torque=brake * force, load_torque=load * force)
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
        for k in range(1, 12):
            speed, slip = at(mpmath.mpf(event.delay) * k / 12, spin)
            assert speed * spin >= -1e-14
            assert slip * state.slip_sign >= -1e-14
    assert kinds or run.sample().phase is not Phase.SLIDING


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

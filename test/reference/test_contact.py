"""Sticking and sliding on a platform that does not throw the disk: stick, slip and reversal.

The core's angle and angular velocity at many instants against the sequence of phases found in 60
digits. Each root of w_T is known to a few ulp of its terms over |ẇ_T|; at a root w_T = 0, so an
error of the instant changes α̇ in second order only. Errors add from phase to phase: TOLERANCE·n
of the fastest speeds.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mpf

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation
from reference.cases import NS, SLOW, axial_amplitude, examples
from reference.precise import Constants
from reference.precise_contact import Contact, Turning
from reference.precise_path import Path

EPS = float(np.finfo(float).eps)
ROUNDINGS = 8.0
FREQUENCY = 2.0
OMEGA = math.tau * FREQUENCY
PERIODS = 2.5


def signed(largest: float) -> st.SearchStrategy[float]:
    """Zero, or clearly not zero."""
    return st.just(0.0) | st.floats(0.01, largest) | st.floats(-largest, -0.01)


def compare(motion: Motion, disk: Disk, initial: InitialState, count: int = 40) -> list[Turning]:
    """Compare the core with the exact sequence at `count` instants; return the sequence."""
    path = Path(motion, initial.forcing_phase)
    contact = Contact(path, disk)
    end = mpf(round(PERIODS / motion.frequency * NS)) / NS
    phases = contact.sequence(mpf(initial.angle), mpf(initial.angular_velocity), end)
    run = Simulation(motion, disk, initial)
    k = Constants(disk)
    omega = math.tau * motion.frequency
    speed = abs(initial.angular_velocity) + omega * motion.angular_amplitude
    speed += float((k.grip * k.gravity + abs(k.brake)) * end)
    for i in range(1, count + 1):
        instant = round(float(end) * NS * i / count)
        rows, behind = run.advance(instant)
        assert not behind
        assert len(rows) == 0
        t = mpf(instant) / NS
        n = max(j for j, phase in enumerate(phases[:-1]) if phase.t <= t)
        exact, sample = contact.carried(phases[n], t), run.sample()
        apart = min(abs(phase.t - t) for phase in phases[1:])
        if apart * omega > 1e-6:  # which phase it is, is a matter of rounding at its ends
            assert (sample.phase == Phase.STICKING) == (phases[n].slip == 0)
        assert sample.phase != Phase.FLIGHT
        # a phase that begins without a jump of the acceleration (slip out of stick) moves
        # by √(rounding) at most, and what it brings about by the third power of it
        rounding = ROUNDINGS * EPS * (n + 1) * (1 + initial.forcing_phase + omega * float(t))
        assert sample.angular_velocity == pytest.approx(
            float(exact.spin), rel=0, abs=rounding * speed
        )
        turned = abs(initial.angle) + speed * float(t) + math.pi
        assert sample.unwrapped_angle == pytest.approx(
            float(exact.angle), rel=0, abs=rounding * turned
        )
    return phases


@given(
    friction=st.floats(0.01, 1.0),
    swing=st.just(0.0) | st.floats(0.05, 3.0),
    phase=st.floats(0.0, 6.28),
    spin=signed(3.0),
    load=signed(0.8),
)
@settings(SLOW, max_examples=examples(10))
def test_platform_that_only_rotates(
    friction: float, swing: float, phase: float, spin: float, load: float
) -> None:
    """A = 0: Coulomb stick and slip under a constant force."""
    torque = friction * 0.1 * 0.5 * 9.81
    disk = Disk(0.5, 0.5, friction, 0.1, 0.08, 9.81, 0.0, load * torque)
    motion = Motion(0.0, swing * torque / (0.5 * 0.08**2 * OMEGA**2), FREQUENCY, 0.3)
    start = spin * OMEGA * motion.angular_amplitude
    compare(motion, disk, InitialState(angular_velocity=start, angle=0.4, forcing_phase=phase))


@given(
    axial_forcing=st.floats(0.02, 0.31),
    friction=st.floats(0.05, 1.0),
    swing=st.floats(0.2, 3.0),
    lag=st.floats(-3.0, 3.0),
    phase=st.floats(0.0, 6.28),
    spin=signed(2.0),
)
@settings(SLOW, max_examples=examples(4))
def test_platform_that_presses(
    axial_forcing: float, friction: float, swing: float, lag: float, phase: float, spin: float
) -> None:
    """Γ < 1/π: contact never ends while its force, and with it friction, comes and goes."""
    disk = Disk(0.5, 0.5, friction, 0.1, 0.08, 9.81, 1.0)
    torque = friction * 0.1 * (0.5 * 9.81 + 1.0)
    amplitude = axial_amplitude(axial_forcing, FREQUENCY, disk)
    motion = Motion(amplitude, swing * torque / (0.5 * 0.08**2 * OMEGA**2), FREQUENCY, lag)
    start = spin * OMEGA * motion.angular_amplitude
    compare(motion, disk, InitialState(angular_velocity=start, angle=-2.0, forcing_phase=phase))


def test_stick_and_slip_take_turns_as_coulomb_says() -> None:
    """μ a_e g = a_g²Φω²/1.2: stick ends where |sin τ| = 1/1.2, as the acceleration grows."""
    grip = 0.4 * 0.1 * 9.81 / 0.08**2
    motion = Motion(0.0, 1.2 * grip / OMEGA**2, FREQUENCY, 0.0)
    disk = Disk(0.5, 0.5, 0.4, 0.1, 0.08, 9.81)
    spin = 2 * OMEGA * motion.angular_amplitude
    phases = compare(motion, disk, InitialState(angular_velocity=spin, forcing_phase=0.0))
    ends = [(b.t, b.slip) for a, b in pairwise(phases[:-1]) if a.slip == 0]
    assert len(ends) > 2
    for t, slip in ends:
        assert math.sin(OMEGA * float(t)) == pytest.approx(slip / 1.2, abs=20 * EPS)


def test_huge_friction_never_slips() -> None:
    disk = Disk(0.5, 0.5, 1e9, 0.1, 0.08, 9.81)
    motion = Motion(axial_amplitude(0.3, FREQUENCY, disk), 2.0, FREQUENCY, 0.7)
    path = Path(motion, 1.0)
    start = InitialState(angular_velocity=float(path.at(mpf(0)).b1), forcing_phase=1.0)
    run = Simulation(motion, disk, start)
    run.advance(1)
    for instant in range(10_000_000, 2 * NS, 100_000_000):
        run.advance(instant)
        sample = run.sample()
        assert sample.phase == Phase.STICKING
        assert sample.angular_velocity == sample.platform_angular_velocity


@pytest.mark.parametrize("early", [1e-4, 1e-6])
def test_a_disk_slips_before_the_load_is_gone(early: float) -> None:
    """Friction holds until grip·a = Φω² sin τ: `early` rad before separation by the choice of μ."""
    disk = Disk(0.5, 0.5, 1.0, 0.1, 0.08, 9.81)
    amplitude, swing = axial_amplitude(0.45, FREQUENCY, disk), 0.5
    leave = math.asin(1.0 / (0.45 * math.pi))
    grip = (
        swing * math.sin(leave - early) / (amplitude * (math.sin(leave) - math.sin(leave - early)))
    )
    disk = disk._replace(friction=grip * 0.08**2 / 0.1)
    run = Simulation(
        Motion(amplitude, swing, FREQUENCY, 0.0), disk, InitialState(forcing_phase=leave - 0.1)
    )
    for ahead, phase in ((1.5, Phase.STICKING), (0.5, Phase.SLIDING), (-0.5, Phase.FLIGHT)):
        run.advance(round((0.1 - ahead * early) / OMEGA * NS))
        assert run.sample().phase == phase

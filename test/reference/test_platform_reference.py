"""The platform's motion in and around cross-fades against the blend in 60 digits.

A disk pressed on so hard that it sticks shows the accelerations: N = m(g + P/m + s̈) and M = m
a_g²β̈. With ω, A, Φ, θ blended, each quantity is a sum of terms of at most `size`; the rounding
of the phase τ (a few ulp of its 2π and of what has passed since the anchor) multiplies by ω at
most.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mpf

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation
from reference.cases import NS, SLOW, Fade
from reference.precise_path import Path

EPS = float(np.finfo(float).eps)
ROUNDINGS = 8.0
PRESSED = Disk(0.5, 0.5, 1e6, 0.1, 0.08, 9.81, 1e3)
AMPLITUDES = st.just(0.0) | st.floats(0.01, 1.0)
ANGLES = st.just(0.0) | st.floats(0.01, 2.0)
FREQUENCIES, LAGS = st.floats(0.5, 3.0), st.floats(-3.14, 3.14)


@given(
    first=st.builds(Motion, AMPLITUDES, ANGLES, FREQUENCIES, LAGS),
    second=st.builds(Motion, AMPLITUDES, ANGLES, FREQUENCIES, LAGS),
    third=st.builds(Motion, AMPLITUDES, ANGLES, FREQUENCIES, LAGS),
    phase=st.floats(0.0, 6.28),
    duration=st.floats(0.05, 2.0),
    pause=st.floats(0.0, 0.5),
)
@settings(SLOW, max_examples=40)
def test_motion_through_two_crossfades(
    first: Motion, second: Motion, third: Motion, phase: float, duration: float, pause: float
) -> None:
    """Position, velocity and acceleration of both axes: exact, so they never jump (C²)."""
    length = round(duration * NS)
    begin = round(0.1 * NS)
    fades = (
        Fade(begin, begin + length, second),
        Fade(begin + length + round(pause * NS), begin + 2 * length + round(pause * NS), third),
    )
    run = Simulation(first, PRESSED, InitialState(forcing_phase=phase))
    run.command([(fade.end_ns, fade.target) for fade in fades], crossfade_ns=length)
    assert [tuple(fade) for fade in run.pending] == [tuple(fade) for fade in fades]
    path = Path(first, phase, fades)
    edges = [t for fade in fades for t in fade[:2]]
    instants = {round(fade.begin_ns + length * k / 7) for fade in fades for k in range(8)}
    instants |= {edge + near for edge in edges for near in (-1, 0, 1)}
    fastest = float(path.omega) + 3 / duration  # Ȧ ≤ 15/8 ΔA/D, θ̇ likewise with |Δθ| ≤ π
    inertia = PRESSED.mass * PRESSED.gyration_radius**2
    for instant in sorted(instants):
        rows, _ = run.advance(instant)
        assert len(rows) == 0
        sample, exact = run.sample(), path.at(mpf(instant) / NS)
        assert sample.phase == Phase.STICKING
        tau = 1 + phase + float(path.omega) * instant / NS
        few = ROUNDINGS * EPS * tau
        reach, swing = few * float(path.reach), few * float(path.swing)
        blend = 1 + 8 / duration**2 / fastest**2  # b'' ≤ 10/√3/D²

        def close(found: float, wanted: Any, within: float) -> None:
            assert found == pytest.approx(float(wanted), rel=0, abs=within + 1e-300)

        close(sample.platform_position, exact.s, reach)
        close(sample.platform_velocity, exact.s1, reach * fastest)
        close(sample.platform_angle, exact.b, swing)
        close(sample.platform_angular_velocity, exact.b1, swing * (fastest + 6 / duration))
        weight = PRESSED.mass * PRESSED.gravity + PRESSED.preload
        close(
            sample.axial_force,
            PRESSED.mass * exact.s2 + weight,
            4 * EPS * weight + PRESSED.mass * reach * fastest**2 * blend,
        )
        turning = (fastest + 6 / duration) ** 2 * blend
        close(sample.friction_torque, inertia * exact.b2, inertia * swing * turning)


def test_the_phase_goes_on_through_a_fade() -> None:
    """ONE forcing phase τ = ∫ω dt: over a fade of D the mean of both frequencies."""
    run = Simulation(Motion(0.0, 0.0, 2.0, 0.0), PRESSED, InitialState(forcing_phase=0.5))
    run.command([(3 * NS, Motion(0.0, 0.0, 5.0, 0.0))], crossfade_ns=2 * NS)
    run.advance(10 * NS)
    sample = run.sample()
    turned = math.tau * (2.0 * 1 + 3.5 * 2 + 5.0 * 7) + 0.5
    assert sample.cycles == math.floor(turned / math.tau)
    assert sample.forcing_phase == pytest.approx(math.fmod(turned, math.tau), abs=1e-13)


@pytest.mark.parametrize(("start", "target"), [(3.0, -3.0), (-3.0, 3.0), (0.1, -0.1)])
def test_the_phase_lag_goes_the_short_way(start: float, target: float) -> None:
    run = Simulation(Motion(0.0, 1.0, 1.0, start), PRESSED, InitialState(forcing_phase=0.0))
    run.command([(2 * NS, Motion(0.0, 1.0, 1.0, target))], crossfade_ns=2 * NS)
    run.advance(NS)  # half of the way
    short = (target - start + math.pi) % math.tau - math.pi
    angle = math.sin(math.tau + start + short / 2)
    assert run.sample().platform_angle == pytest.approx(angle, abs=1e-14)

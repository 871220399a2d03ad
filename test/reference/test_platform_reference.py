"""The platform's motion in and around cross-fades against the blend in 50 digits.

A disk pressed on so hard that it sticks shows the accelerations: N = m(g + P/m + s̈) and M = m
a_g²β̈. With ω, A, Φ, θ blended, each quantity is a sum of terms of at most `size`; the rounding
of the phase τ (a few ulp of its 2π and of what has passed since the anchor) multiplies by ω at
most.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, Phase
from bouncing_disk_ros.core.simulation import Simulation
from reference.cases import NS, SLOW
from support.fifty_digits import DIGITS, Fade, Path

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
    begins = (NS // 10, NS // 10 + length + round(pause * NS))
    fades = [(at, at + length, to) for at, to in zip(begins, (second, third), strict=True)]
    run = Simulation(first, PRESSED, InitialState(forcing_phase=phase))
    run.command([(end, target) for _, end, target in fades], crossfade_ns=length)
    assert [tuple(fade) for fade in run.pending] == fades
    instants = {round(begin + length * k / 7) for begin in begins for k in range(8)}
    instants |= {t + near for fade in fades for t in fade[:2] for near in (-1, 0, 1)}
    with mp.workdps(DIGITS):
        seconds = [Fade(mpf(begin) / NS, mpf(end) / NS, target) for begin, end, target in fades]
        path = Path(first, phase, seconds)
        exact = {at: (*path.axial(mpf(at) / NS), *path.angular(mpf(at) / NS)) for at in instants}
    motions = (first, second, third)
    omega = math.tau * max(motion.frequency for motion in motions)
    fastest = omega + 3 / duration  # Ȧ ≤ 15/8 ΔA/D, θ̇ likewise with |Δθ| ≤ π
    inertia = PRESSED.mass * PRESSED.gyration_radius**2
    for instant in sorted(instants):
        rows, _ = run.advance(instant)
        assert len(rows) == 0
        sample, (s, s1, s2, b, b1, b2) = run.sample(), map(float, exact[instant])
        assert sample.phase == Phase.STICKING
        few = ROUNDINGS * EPS * (1 + phase + omega * instant / NS)
        reach = few * max(motion.axial_amplitude for motion in motions)
        swing = few * max(motion.angular_amplitude for motion in motions)
        blend = 1 + 8 / duration**2 / fastest**2  # b'' ≤ 10/√3/D²

        def close(found: float, wanted: float, within: float) -> None:
            assert found == pytest.approx(wanted, rel=0, abs=within + 1e-300)

        close(sample.platform_position, s, reach)
        close(sample.platform_velocity, s1, reach * fastest)
        close(sample.platform_angle, b, swing)
        close(sample.platform_angular_velocity, b1, swing * (fastest + 6 / duration))
        weight = PRESSED.mass * PRESSED.gravity + PRESSED.preload
        close(
            sample.axial_force,
            PRESSED.mass * s2 + weight,
            4 * EPS * weight + PRESSED.mass * reach * fastest**2 * blend,
        )
        turning = (fastest + 6 / duration) ** 2 * blend
        close(sample.friction_torque, inertia * b2, inertia * swing * turning)

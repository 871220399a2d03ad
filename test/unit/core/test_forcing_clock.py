"""Time and phase stay tied to 1e-15 rad after a century, steady or fading."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.core import forcing_clock as forcing_clock_kernels
from bouncing_disk_ros.core import platform as platform_kernels
from bouncing_disk_ros.core.model import Motion
from support.kernels import Kernels

forcing_clock = Kernels(forcing_clock_kernels)
platform = Kernels(platform_kernels)

CENTURY_NS = 100 * 365 * 86400 * 10**9
ANCHOR_NS, ANCHOR_CYCLES, ANCHOR_TAU = 123_456_789, 17, 4.0


def steady(frequency: float) -> object:
    motion = Motion(1e-3, 0.1, frequency, 0.3)
    return platform.steady(motion, ANCHOR_NS, ANCHOR_CYCLES, ANCHOR_TAU)[0]


@given(st.floats(0.1, 2e5), st.integers(0, CENTURY_NS))
def test_phase_of_an_instant_is_exact_after_a_century(frequency: float, later_ns: int) -> None:
    cycles, tau = forcing_clock.phase_of(steady(frequency), ANCHOR_NS + later_ns, 0.0)
    with mpmath.workdps(60):
        exact = mpmath.mpf(later_ns) * frequency / 10**9 + mpmath.mpf(ANCHOR_TAU) / (2 * mpmath.pi)
        off = (cycles - ANCHOR_CYCLES - exact) + mpmath.mpf(tau) / (2 * mpmath.pi)
    assert abs(off) * math.tau < 3e-15  # three roundings of numbers below 2π
    assert 0 <= tau < math.tau


@given(st.floats(0.1, 2e5), st.integers(0, 10**12), st.floats(0, 6.283))
def test_instant_of_a_phase_goes_back_to_it(frequency: float, cycles: int, tau: float) -> None:
    cycles = min(cycles, int(CENTURY_NS * 1e-9 * frequency))
    motion = steady(frequency)
    ns, sub = forcing_clock.instant_of(motion, ANCHOR_CYCLES + 1 + cycles, tau)
    assert 0 <= sub < 1
    back, phase = forcing_clock.phase_of(motion, ns, sub)
    turns = (back - ANCHOR_CYCLES - 1 - cycles) + (phase - tau) / math.tau
    assert abs(turns) * math.tau < 4e-15


@given(
    st.floats(0.5, 1e5),
    st.floats(0.3, 3),
    st.integers(10**6, 10**11),
    st.fractions(0, 1),
)
def test_phase_in_a_fade_is_the_integral_of_the_frequency(
    frequency: float, ratio: float, duration_ns: int, part: Fraction
) -> None:
    start, target = Motion(1, 1, frequency, 0), Motion(1, 1, frequency * ratio, 0)
    motion = platform.fade(start, target, 0, duration_ns, 0, 1.0)[0]
    ns = int(part * duration_ns)
    cycles, tau = forcing_clock.phase_of(motion, ns, 0.0)
    with mpmath.workdps(60):
        x = mpmath.mpf(ns) / duration_ns
        grown = mpmath.mpf(float(motion["df"])) * duration_ns * (2.5 * x**4 - 3 * x**5 + x**6)
        exact = (mpmath.mpf(frequency) * ns + grown) / 10**9 + 1 / (2 * mpmath.pi)
        off = cycles - exact + mpmath.mpf(tau) / (2 * mpmath.pi)
    assert abs(off) * math.tau < 3e-15


@pytest.mark.parametrize("turns", [0, 1, 3, 10**6])
def test_clock_after_whole_periods_keeps_the_phase(turns: int) -> None:
    motion = steady(50.0)
    d = turns / 50.0
    start = forcing_clock.Clock(ANCHOR_NS, 0.0, ANCHOR_CYCLES, ANCHOR_TAU)
    _, _, cycles, tau = forcing_clock.clock_after(motion, start, d)
    # d itself is rounded: half an ulp of it, times ω
    off = (cycles - ANCHOR_CYCLES - turns) * math.tau + tau - ANCHOR_TAU
    assert abs(off) < 4e-15 + math.ulp(max(d, 1.0)) * 50 * math.tau


def test_later_carries_whole_nanoseconds() -> None:
    assert forcing_clock.later(5, 0.75, 1.5e-9) == (7, 0.25)
    ns, sub = forcing_clock.later(10**18, 0.5, 2.0**-30)
    exact = Fraction(1, 2) + Fraction(10**9) / 2**30
    assert ns - 10**18 == int(exact)
    assert sub == pytest.approx(float(exact - int(exact)), abs=2e-16)

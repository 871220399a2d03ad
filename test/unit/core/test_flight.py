"""The gap keeps its digits; the first root is found and none is passed."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.core import flight as flight_kernels
from bouncing_disk_ros.core import platform as platform_kernels
from bouncing_disk_ros.core import roots as roots_kernels
from bouncing_disk_ros.core.arithmetic import sincos as sincos_kernel
from bouncing_disk_ros.core.model import Motion
from support.kernels import Kernels, from_python

flight = Kernels(flight_kernels)
platform = Kernels(platform_kernels)
roots = Kernels(roots_kernels)
sincos = from_python(sincos_kernel)

G = 9.81
DURATIONS = st.floats(-11, -0.1).map(lambda x: 10**x)


def exact_gap(record: Any, since: float, tau: float, gap: float, u: float, d: float) -> Any:
    """Gap after d seconds in 60 digits; the platform moves as the record says."""
    steady = record["kind"] == 0

    def position(e: Any) -> Any:
        if steady:
            return mpmath.mpf(float(record["a"])) * mpmath.sin(tau + float(record["omega"]) * e)
        duration = mpmath.mpf(float(record["duration"]))
        x0, x = mpmath.mpf(since) / duration, (mpmath.mpf(since) + e) / duration

        def integral(y: Any) -> Any:
            return y**4 * (mpmath.mpf("2.5") - 3 * y + y**2)

        cycles = float(record["f"]) * e + float(record["df"]) * duration * (
            integral(x) - integral(x0)
        )
        b = x**3 * (10 - 15 * x + 6 * x**2)
        amplitude = float(record["a"]) + float(record["da"]) * b
        return amplitude * mpmath.sin(tau + 2 * mpmath.pi * cycles)

    e = mpmath.mpf(d)
    start, rate = position(mpmath.mpf(0)), mpmath.diff(position, 0, h=mpmath.mpf(10) ** -30)
    return gap + u * e - G * e**2 / 2 - (position(e) - start - rate * e)


@pytest.mark.parametrize("fading", [False, True])
@given(tau=st.floats(0, 6.28), d=DURATIONS, speed=st.floats(0.1, 2))
def test_gap_keeps_the_digits_of_tiny_bounces(
    tau: float, d: float, speed: float, fading: bool
) -> None:
    start = Motion(0.01, 0.0, 3.0, 0.0)
    if fading:
        record = platform.fade(start, Motion(0.02, 0.0, 4.0, 0.0), 0, 10**9, 0, 0.0)[0]
    else:
        record = platform.steady(start, 0, 0, 0.0)[0]
    since, u = 0.37 if fading else 0.0, speed * G * d  # a bounce of about this duration
    s, c = sincos(tau)
    gap = flight.gap_after(record, flight.Launch(since, s, c, G, 0.0, u), d)[0]
    with mpmath.workdps(60):
        exact = exact_gap(record, since, tau, 0.0, u, d)
        # every term is below (g + |s̈|) d² and has a few roundings
        assert abs(gap - exact) < 2e-15 * (G + float(record["s2"])) * d * d


@given(
    amplitude=st.floats(0, 0.1),
    tau=st.floats(0, 6.28),
    u=st.floats(1e-6, 5),
    gap=st.just(0.0) | st.floats(0, 0.1),
)
def test_no_root_is_passed(amplitude: float, tau: float, u: float, gap: float) -> None:
    record = platform.steady(Motion(amplitude, 0.0, 3.0, 0.0), 0, 0, 0.0)[0]
    s, c = sincos(tau)
    jet = platform.axial_jet(record, s, c, 0.0)
    launch = flight.Launch(0.0, s, c, G, gap, u)
    d, w = flight.first_impact(record, launch, jet, 0.0, math.inf)
    assert w < 0
    arrival = flight.gap_after(record, launch, d)
    scale = gap + u * d + G * d * d + amplitude
    assert abs(arrival[0]) < 1e-15 * scale + abs(w) * 4 * math.ulp(d)
    assert arrival[1] == pytest.approx(w, abs=1e-14 * (abs(u) + G * d + amplitude * 20))
    for part in np.linspace(0.001, 0.999, 60):  # nothing below zero on the way
        assert flight.gap_after(record, launch, d * part)[0] > -1e-15 * scale


@pytest.mark.parametrize(
    ("x", "v", "g"),
    [
        *((0.02, 3.0, G), (-0.05, 1.8, G), (0.05, 0.7, G), (0.3, -1.0, G)),
        *((0.5, -18.8, 1e-6), (0.5, -18.8, 1e-9), (0.3, -1.0, 1e9)),
    ],
)
def test_a_thrown_disk_is_above_the_platform_s_top_from_begin_to_end(
    x: float, v: float, g: float
) -> None:
    """The search leaves this interval out: a longer one would pass impacts below the top."""
    top = 0.05
    begin, end = flight.above_platform(top, x, v, g)
    # roundings of heights up to v²/2g
    assert x + (v - 0.5 * g * end) * end == pytest.approx(top, abs=1e-14)
    if x < top:
        assert x + (v - 0.5 * g * begin) * begin == pytest.approx(top, abs=1e-14)
    else:
        assert begin == 0.0
    assert begin < end


@pytest.mark.parametrize("clearance", [1e-9, 1e-13, -1e-13, -1e-9])
def test_a_graze_is_decided_by_the_sign_of_the_least_gap(clearance: float) -> None:
    """The disk passes the platform's crest with no relative velocity, `clearance` above it."""
    amplitude, w = 1.0, math.tau
    record = platform.steady(Motion(amplitude, 0.0, 1.0, 0.0), 0, 0, 0.0)[0]
    d = 0.5 / w  # until the crest, where the platform falls away faster than the disk
    tau = math.pi / 2 - 0.5
    s, c = sincos(tau)
    start = amplitude + clearance - 0.5 * G * d * d
    gap, u = start - amplitude * s, G * d - amplitude * w * c
    jet = platform.axial_jet(record, s, c, 0.0)
    launch = flight.Launch(0.0, s, c, G, gap, u)
    first, speed = flight.first_impact(record, launch, jet, 0.0, math.inf)
    assert speed < 0
    if clearance > 0:
        assert first > 1.5 * d
    else:
        curvature = amplitude * w * w - G
        assert first == pytest.approx(d - math.sqrt(-2 * clearance / curvature), rel=1e-3)


@pytest.mark.parametrize("forcing", [0.32, 0.45, 1.0, 30.0])
def test_separation_phase_is_eq_3(forcing: float) -> None:
    amplitude = forcing * math.pi * G / (math.tau * 3.0) ** 2
    record = platform.steady(Motion(amplitude, 0.0, 3.0, 0.0), 0, 0, 0.0)[0]
    tau = flight.separation_phase(record, G)
    # conditioning of the arcsine: the argument has a few roundings
    assert tau == pytest.approx(
        math.asin(1 / (math.pi * forcing)), abs=1e-15 / math.sqrt(1 - (1 / math.pi / forcing) ** 2)
    )


@given(
    root=st.floats(0.1, 10), slope=st.floats(0.01, 5), bend=st.floats(-3, 3), jerk=st.floats(-2, 2)
)
def test_safe_steps_never_pass_the_root_of_a_cubic(
    root: float, slope: float, bend: float, jerk: float
) -> None:
    """h(x) = slope·y + bend·y²/2 + jerk·y³/6 with y = root − x, falling at the root."""

    def jet(x: float) -> tuple[float, float, float]:
        y = root - x
        h = y * (slope + y * (bend / 2 + y * jerk / 6))
        return h, -(slope + y * (bend + y * jerk / 2)), bend + y * jerk

    k = max(-min(jet(0.0)[2], jet(root)[2]), 1e-9)
    xs = np.linspace(0, root, 500, endpoint=False)
    if min(jet(x)[0] for x in xs) <= 0:
        return  # not the first root
    x = 0.0
    for _ in range(50):
        h, h1, h2 = jet(x)
        if h <= 1e-14 * (1 + root**3):
            break
        step = roots.safe_step(h, h1, -h2, k, abs(jerk))
        assert 0 < step <= (root - x) * (1 + 1e-9) + 1e-12
        x += step

"""Platform derivatives against 40-digit ones; fades do not jump; bounds hold."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bouncing_disk_ros.core import platform as platform_kernels
from bouncing_disk_ros.core.arithmetic import sincos as sincos_kernel
from bouncing_disk_ros.core.model import Motion
from support.kernels import Kernels, from_python

platform = Kernels(platform_kernels)
sincos = from_python(sincos_kernel)

MOTIONS = st.builds(
    Motion, st.floats(0, 1), st.floats(0, 3), st.floats(0.5, 5), st.floats(-3.1, 3.1)
)
SECOND = 10**9


def exact_motion(record: Any, angular: bool) -> Any:
    """s or β of a fade from 0 to 1 s as a function of mpmath time, τ = 1 at the start."""

    def value(t: Any) -> Any:
        b = t**3 * (10 - 15 * t + 6 * t**2)
        grown = t**4 * (mpmath.mpf("2.5") - 3 * t + t**2)
        tau = 1 + 2 * mpmath.pi * (float(record["f"]) * t + float(record["df"]) * grown)
        if not angular:
            return (float(record["a"]) + float(record["da"]) * b) * mpmath.sin(tau)
        lag = float(record["lag"]) + float(record["dlag"]) * b
        return (float(record["p"]) + float(record["dp"]) * b) * mpmath.sin(tau + lag)

    return value


def core_jet(record: Any, t: float, angular: bool) -> tuple[float, ...]:
    tau = 1.0 + platform.phase_advance(record, 0.0, t)
    jet = platform.angular_jet if angular else platform.axial_jet
    return tuple(jet(record, *sincos(tau), t))


@pytest.mark.parametrize("angular", [False, True])
@given(start=MOTIONS, target=MOTIONS, t=st.floats(0.001, 0.999))
def test_derivatives_in_a_fade(start: Motion, target: Motion, t: float, angular: bool) -> None:
    record = platform.fade(start, target, 0, SECOND, 0, 1.0)[0]
    with mpmath.workdps(40):
        exact = mpmath.taylor(exact_motion(record, angular), mpmath.mpf(t), 4)
    scale = max(start[0] + target[0], start[1] + target[1], 1e-3)
    rate = math.tau * max(start.frequency, target.frequency) + 10.0  # of the blend: below 10/s
    for n, (value, coefficient) in enumerate(zip(core_jet(record, t, angular), exact, strict=True)):
        reference = float(coefficient * math.factorial(n))
        # each derivative is a sum of some ten terms below scale·rateⁿ, at a phase good to 1e-14
        assert abs(value - reference) < 1e-13 * scale * rate**n * 4**n


@given(start=MOTIONS, target=MOTIONS)
def test_bounds_bound(start: Motion, target: Motion) -> None:
    record = platform.fade(start, target, 0, SECOND, 0, 1.0)[0]
    for t in np.linspace(0, 1, 41):
        axial, angular = core_jet(record, t, False), core_jet(record, t, True)
        assert abs(axial[0]) <= record["top"]
        for n, name in ((2, "s2"), (3, "s3"), (4, "s4")):
            assert abs(axial[n]) <= record[name]
        for n, name in ((2, "b2"), (3, "b3"), (4, "b4")):
            assert abs(angular[n]) <= record[name]

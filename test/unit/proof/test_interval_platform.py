"""The platform in ball arithmetic: its motion, its derivatives and its bounds."""

from __future__ import annotations

import math

import pytest
from flint import arb, ctx

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.proof.exact_records import MotionRecord, State
from bouncing_disk_ros.proof.platforms import interval, platform_of

BEGUN_NS = 300_000_000
STATE = State(BEGUN_NS, 0.0, 0, 1.0, Phase.FLIGHT, 0.0, 0.0, 0.0, 0.0)
STEADY = MotionRecord(False, 0, 2**63 - 1, 0, 0.2, 0.1, 0.0, 0.7, 0.0, 2.0, 0.0, 0.4, 0.0)
FADE = STEADY._replace(
    fading=True, end_ns=2_000_000_000, da=0.3, dp=-0.5, df=3.0, dlag=-1.1
)  # the state is 0.3 s into it


def blend(t: float) -> float:
    x = (BEGUN_NS * 1e-9 + t) / 2.0
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def s_and_angle(motion: MotionRecord, t: float) -> tuple[float, float]:
    """s and β by the definition; the phase by Simpson's rule."""
    b, n = blend(t) if motion.fading else 0.0, 2000
    rates = [
        motion.f + motion.df * (blend(t * k / n) if motion.fading else 0.0) for k in range(n + 1)
    ]
    weights = [*[1.0, *([4.0, 2.0] * (n // 2))][:n], 1.0]
    turned = t / (3.0 * n) * sum(w * r for w, r in zip(weights, rates, strict=True))
    tau = STATE.tau + math.tau * turned
    lag = motion.lag + motion.dlag * b
    return (motion.a + motion.da * b) * math.sin(tau), (motion.p + motion.dp * b) * math.sin(
        tau + lag
    )


@pytest.mark.parametrize("motion", [STEADY, FADE])
@pytest.mark.parametrize("t", [0.0, 0.1, 0.77, 1.7])
def test_position_and_angle_are_those_of_the_definition(motion: MotionRecord, t: float) -> None:
    platform = platform_of(motion, STATE)
    axial, angular = platform.mix(arb(1), arb(0)), platform.mix(arb(0), arb(1))
    s, angle = s_and_angle(motion, t)
    assert float(axial.jet(arb(t))[0]) == pytest.approx(s, abs=1e-12)
    assert float(angular.jet(arb(t))[0]) == pytest.approx(angle, abs=1e-12)
    mixed = platform.mix(arb(2), arb(-3)).jet(arb(t))[0]
    assert float(mixed) == pytest.approx(2.0 * s - 3.0 * angle, abs=1e-12)


@pytest.mark.parametrize("motion", [STEADY, FADE])
def test_derivatives_are_those_of_the_value(motion: MotionRecord) -> None:
    """Central differences of one derivative, in many digits, against the next."""
    with ctx.workprec(400):
        mixed = platform_of(motion, STATE).mix(arb(2), arb(-3))
        h = arb(2) ** -60
        for t in (arb(0.1), arb(1.3)):
            before, here, after = (mixed.jet(t + k * h) for k in (-1, 0, 1))
            for order in range(4):
                difference = (after[order] - before[order]) / (2 * h)
                assert abs(difference - here[order + 1]) < arb(10) ** -20


@pytest.mark.parametrize("motion", [STEADY, FADE])
@pytest.mark.parametrize("width", [1e-3, 0.05, 0.9])
def test_ranges_and_envelopes_hold_all_values(motion: MotionRecord, width: float) -> None:
    mixed = platform_of(motion, STATE).mix(arb(2), arb(-3))
    for a in (0.0, 0.4, 0.8):
        whole = interval(a, a + width)
        over, bounds = mixed.jet(whole), mixed.envelope(whole)
        for k in range(11):
            values = mixed.jet(arb(a + width * k / 10))
            for value, ball, bound in zip(values, over, bounds, strict=True):
                assert ball.contains(value)
                assert abs(value) <= bound * (1 + arb(10) ** -30)

"""What docs/juggling.md states of closed loops: many starts, impulses, and the same through ROS.

make soak
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros import run_study
from bouncing_disk_ros.core.model import InitialState
from bouncing_disk_ros.juggling.kernels import loop_kernel as loop
from bouncing_disk_ros.juggling.loop_settings import (
    HEARS_TIMES_ONLY,
    Limits,
    Sensor,
    controller_settings,
    period_one_points,
    plant_settings,
)
from bouncing_disk_ros.juggling.loop_verdict import Outcome
from bouncing_disk_ros.juggling.simulated_loop import draw
from bouncing_disk_ros.testing import SteppedSimulator
from support.juggle_loops import FREQUENCY, GRAVITY, Make, run_both

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]

INSTANTS = 48
CASES: dict[str, tuple[float, float, Sensor]] = {
    "exact": (0.45, 0.0, Sensor()),
    "restitution believed too low": (0.45, -0.2, Sensor()),
    "restitution believed too high": (0.45, 0.2, Sensor()),
    "delay": (0.45, 0.0, Sensor(delay=0.5)),
    "missed": (0.45, 0.0, Sensor(missed=0.2)),
    "jitter": (0.45, 0.0, Sensor(jitter=0.005)),
    "0.50": (0.50, 0.0, Sensor()),
    "0.55": (0.55, 0.0, Sensor()),
    "0.60": (0.60, 0.0, Sensor()),
}
STARTS: dict[str, tuple[float, float] | None] = {
    "rest": None,
    "slow": (2.0, -0.6),
    "fast": (5.0, -4.5),
}


def test_a_hundred_thousand_starts_are_captured(tmp_path: Any) -> None:
    result = run_study(
        "juggling", path=tmp_path / "result.zarr", strategies="none impact_time deadbeat",
        width=400, height=250,
    )  # fmt: skip
    assert result is not None
    none, *closed = result["captured"].values[:, 0]
    assert none == pytest.approx(0.3472, abs=0.002)
    assert min(closed) >= 0.999
    assert float(result["largest_offset"].max()) <= 0.3
    assert float(result["largest_acceleration"].max()) <= 2.0


def outcome(strategy: str, impulse: float, part: float) -> Outcome:
    """At Γ = 0.45 from the orbit on; the impulse acts in a part of the tenth flight."""
    forcing = 0.45
    orbit = period_one_points(forcing, 0.5)
    phase = float(orbit[0, 0])
    plant = plant_settings(
        0.5, Sensor(), hears_velocity=strategy not in HEARS_TIMES_ONLY, deadline=50.0,
        impulse=impulse,
    )  # fmt: skip
    begin = phase + math.tau * (10.0 + part)
    plant[loop.IMPULSE_AT] = begin - math.tau * draw(1, 0, 1 << 40)  # which the kernel adds
    results = np.zeros((1, loop.RESULTS))
    starts = np.array([[0.0, phase, forcing * math.sin(phase), 1.0]])
    settings = controller_settings(strategy, forcing, 0.5, Limits())
    loop.run_loops(settings, orbit, plant, starts, 0.05, 5, 1, 0, results, np.zeros((0, 2)))
    return Outcome(int(results[0, loop.R_VERDICT]))


@pytest.mark.parametrize("strategy", ["impact_time", "deadbeat"])
def test_twice_the_impulse_that_ends_the_open_loop_is_survived(strategy: str) -> None:
    """At each instant of a flight, up and down."""
    smallest = {1: math.inf, -1: math.inf}
    for k in range(INSTANTS):
        part = (k + 0.5) / INSTANTS
        for sign in smallest:
            for size in np.arange(0.01, 3.0, 0.01):
                if outcome("none", sign * size, part) is not Outcome.CAPTURED:
                    smallest[sign] = min(smallest[sign], float(size))
                    assert outcome(strategy, 2.0 * sign * size, part) is Outcome.CAPTURED
                    break
    assert smallest == pytest.approx({1: 0.19, -1: 0.35})


@pytest.fixture
def make(ros_domain: int, warm_kernels: None) -> Iterator[Make]:
    made: list[SteppedSimulator] = []

    def one(**values: Any) -> SteppedSimulator:
        made.append(SteppedSimulator(publish_clock=True, **values))
        return made[-1]

    yield one
    for simulator in made:
        simulator.close()


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("strategy", ["none", "impact_time", "deadbeat"])
@pytest.mark.parametrize("case", CASES)
def test_through_ros_the_impacts_and_verdicts_are_the_same(
    make: Make, case: str, strategy: str, start: str
) -> None:
    forcing, error, sensor = CASES[case]
    state, place = None, STARTS[start]
    if place is not None:
        phase, w = place
        velocity = (forcing * math.cos(phase) - 0.5 * w) * GRAVITY / (2.0 * FREQUENCY)
        state = InitialState(axial_velocity=velocity, forcing_phase=phase)
    rows, record, status = run_both(
        make, forcing, strategy, sensor, periods=50, start=state, error=error
    )
    np.testing.assert_array_equal(rows["time"], record.rows["time"])
    np.testing.assert_array_equal(rows["axial_velocity"], record.rows["axial_velocity"])
    captured = record.verdict.outcome is Outcome.CAPTURED
    assert captured == (": captured" in status)
    assert captured or strategy == "none"

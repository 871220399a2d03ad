"""What docs/juggling.md states of closed loops: many starts and impulses.

make soak
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from bouncing_disk_ros import run_study
from bouncing_disk_ros.juggling.kernels import loop_kernel as loop
from bouncing_disk_ros.juggling.kernels.loop_kernel import draw
from bouncing_disk_ros.juggling.loop_settings import (
    HEARS_TIMES_ONLY,
    Limits,
    Sensor,
    controller_settings,
    period_one_points,
    plant_settings,
)
from bouncing_disk_ros.juggling.loop_verdict import Outcome

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]

INSTANTS = 48


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

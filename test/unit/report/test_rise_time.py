"""Rise times of lines, exponentials and steps; nothing where there is nothing to tell."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.report.rise_time import rise_time_of

TIMES = np.linspace(-1.0, 50.0, 5101)


def test_an_exponential_takes_its_time_constant_and_three_of_them() -> None:
    speeds = 5.0 * (1.0 - np.exp(-np.maximum(TIMES, 0.0) / 2.0))
    found = rise_time_of(TIMES, speeds, 0.0)
    assert found is not None
    assert found.to_1_e == pytest.approx(2.0, rel=1e-4)
    assert found.to_95 == pytest.approx(2.0 * math.log(20.0), rel=1e-4)


@pytest.mark.parametrize(
    ("times", "speeds"),
    [
        (TIMES, np.full(TIMES.shape, 3.0)),
        (TIMES, 3.0 + 0.1 * np.sin(40.0 * TIMES)),
        (TIMES[TIMES > 0.0], TIMES[TIMES > 0.0]),
        (TIMES[:104], TIMES[:104]),
        (TIMES[:0], TIMES[:0]),
    ],
)
def test_no_clear_change_or_nothing_from_before_it(
    times: np.ndarray[tuple[int], np.dtype[np.float64]],
    speeds: np.ndarray[tuple[int], np.dtype[np.float64]],
) -> None:
    assert rise_time_of(times, speeds, 0.0) is None

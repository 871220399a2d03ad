"""Rise times of lines, exponentials and steps; nothing where there is nothing to tell."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.report.rise_time import rise_time_of

TIMES = np.linspace(-1.0, 50.0, 5101)


def test_a_line_that_ends_and_its_way_back() -> None:
    up = np.clip(TIMES, 0.0, 10.0) * 3.0 + 2.0
    found = rise_time_of(TIMES, up, 0.0)
    assert found is not None
    assert (found.initial, found.final) == (2.0, 32.0)
    assert found.to_1_e == pytest.approx(10.0 * (1.0 - math.exp(-1.0)), abs=1e-9)
    assert found.to_95 == pytest.approx(9.5, abs=1e-9)
    down = rise_time_of(TIMES, -up, 0.0)
    assert down is not None
    assert (down.to_1_e, down.to_95) == (found.to_1_e, found.to_95)


def test_an_exponential_takes_its_time_constant_and_three_of_them() -> None:
    speeds = 5.0 * (1.0 - np.exp(-np.maximum(TIMES, 0.0) / 2.0))
    found = rise_time_of(TIMES, speeds, 0.0)
    assert found is not None
    assert found.to_1_e == pytest.approx(2.0, rel=1e-4)
    assert found.to_95 == pytest.approx(2.0 * math.log(20.0), rel=1e-4)


def test_between_two_samples_a_straight_line_is_taken() -> None:
    found = rise_time_of(np.arange(-1.0, 20.0), np.where(np.arange(-1.0, 20.0) > 0, 1.0, 0.0), 0.0)
    assert found is not None
    assert found.to_95 == pytest.approx(0.95)


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


def test_a_speed_that_wanders_after_the_change_has_ended() -> None:
    times = np.linspace(-1.0, 30.0, 600)
    speeds = np.where(times < 0.0, 0.0, 25.0 + 2.0 * np.sin(3.0 * times))
    found = rise_time_of(times, speeds, 0.0)
    assert found is not None
    assert found.ended

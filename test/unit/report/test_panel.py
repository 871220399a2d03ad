"""Thinning that hides nothing it does not say: extremes stay, periods are not aliased."""

from __future__ import annotations

import numpy as np

from bouncing_disk_ros.report.panel import (
    Panel,
    envelope,
    places,
    series,
    spread,
    with_gaps,
)


def test_a_random_choice_sees_both_points_of_a_period_two_orbit() -> None:
    chosen = spread(100_000, 1000)
    assert len(np.unique(chosen)) == 1000
    assert np.all(np.diff(chosen) > 0)
    # of 1000 fair choices 500 ± 16 are odd: 6 standard deviations
    assert abs(np.sum(chosen % 2) - 500) < 6 * 16
    np.testing.assert_array_equal(spread(100_000, 1000), chosen)
    np.testing.assert_array_equal(spread(3, 1000), [0, 1, 2])


def test_an_envelope_keeps_every_spike() -> None:
    values = np.zeros(100_000)
    spikes = np.arange(500, 100_000, 1000)
    values[spikes] = np.where(spikes // 1000 % 2, 1.0, -1.0)
    kept = envelope(values, 2000)
    assert set(spikes) <= set(kept.tolist())
    assert len(kept) <= 2000 + 2
    assert (kept[0], kept[-1]) == (0, 99_999)
    np.testing.assert_array_equal(envelope(values[:5], 2000), np.arange(5))


def test_lines_are_broken_at_gaps() -> None:
    x, y = with_gaps(np.array([0.0, 1.0, 5.0]), np.array([7.0, 8.0, 9.0]), 2.0)
    np.testing.assert_array_equal(x, [0.0, 1.0, np.nan, 5.0])
    np.testing.assert_array_equal(y, [7.0, 8.0, np.nan, 9.0])


def test_places_counts_what_can_be_told_apart() -> None:
    x = np.tile([0.1, 0.5, 0.9], 1000)
    assert places(series("three points", x + 1e-9 * np.arange(3000), x)) == 3
    assert places(series("one", [1.0], [2.0])) == 1
    assert places(series("none", [], [])) == 0
    assert Panel("", "", "", [series("none", [], [])]).is_empty

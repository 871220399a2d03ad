"""What panels show: thinning hides nothing that it does not say, pairs are successive."""

from __future__ import annotations

import numpy as np
import pytest

from bouncing_disk_ros.core.model import ImpactKind
from bouncing_disk_ros.report.panel import (
    Panel,
    envelope,
    places,
    series,
    spread,
    with_gaps,
)
from bouncing_disk_ros.report.section import single_impacts, successive_impacts
from support.map_rows import map_rows


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


def test_lines_are_broken_at_gaps_and_places_count_what_can_be_told_apart() -> None:
    x, y = with_gaps(np.array([0.0, 1.0, 5.0]), np.array([7.0, 8.0, 9.0]), 2.0)
    np.testing.assert_array_equal(x, [0.0, 1.0, np.nan, 5.0])
    np.testing.assert_array_equal(y, [7.0, 8.0, np.nan, 9.0])
    x = np.tile([0.1, 0.5, 0.9], 1000)
    assert places(series("three points", x + 1e-9 * np.arange(3000), x)) == 3
    assert places(series("one", [1.0], [2.0])) == 1
    assert places(series("none", [], [])) == 0
    assert Panel("", "", "", [series("none", [], [])]).is_empty


# --- successive impacts ---------------------------------------------------------------------------
def test_no_pair_crosses_a_gap_or_a_sum() -> None:
    rows = map_rows(0.549, 20)
    first, second = successive_impacts(rows)
    assert np.array_equal(first, rows[:-1])
    assert np.array_equal(second, rows[1:])
    rows["kind"][5], rows["count"][5] = ImpactKind.CHATTER_CUT, 3
    rows["kind"][12] = ImpactKind.CHATTER_TAIL
    first, second = successive_impacts(np.delete(rows, 9))
    broken = {4, 5, 8, 9, 11, 12, 19}  # the first of a pair with 5, 9 (lost), 12, or none after
    assert first["index"].tolist() == [i for i in range(20) if i not in broken]
    assert np.array_equal(second["index"], first["index"] + 1.0)
    assert np.flatnonzero(~single_impacts(rows)).tolist() == [5, 12]


@pytest.mark.parametrize("n", [0, 1])
def test_few_rows_have_no_pair(n: int) -> None:
    assert not len(successive_impacts(map_rows(0.549, 20)[:n])[0])

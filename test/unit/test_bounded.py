"""Histories that stay within a size: the newest of what comes, or every so many of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from bouncing_disk_ros.bounded import Downsampled, Newest, NewestRows

DTYPE = np.dtype([("time", "f8")])


def rows(begin: int, end: int) -> NDArray[np.void]:
    return np.arange(begin, end, dtype=float).view(DTYPE)


@pytest.mark.parametrize("most", [1, 5, 700, 5000])
def test_a_table_keeps_the_newest_rows_however_they_come(most: int) -> None:
    table, end = NewestRows(DTYPE, most), 0
    for count in (1, 3, 9, 2, 5, 1, 1, 1, 50, 4, 0, *[700] * 9, 3, 2048, 9000, 1, *[333] * 40):
        table.append(rows(end, end + count))
        end += count
        first = max(0, end - most)
        assert np.array_equal(table.rows, rows(first, end))
        assert (len(table), table.dropped) == (end - first, first)


def test_rows_are_found_by_their_time() -> None:
    table = NewestRows(DTYPE, 5)
    table.append(rows(0, 20))
    assert table.between(16.0, 18.0, 10)["time"].tolist() == [17.0, 18.0]
    assert table.between(-math.inf, math.inf, 2)["time"].tolist() == [18.0, 19.0]
    last = table.last(17.5)
    assert last is not None
    assert last["time"] == 17.0
    assert table.last(-1.0) is None
    table.clear()
    assert len(table) == 0


def test_rows_are_not_changed_by_those_who_read_them_and_none_may_be_kept() -> None:
    """A reader who set the times to 0 in place changed the record, and what is computed from it."""
    table = NewestRows(DTYPE, 5)
    table.append(rows(0, 3))
    with pytest.raises(ValueError, match="read-only"):
        table.rows["time"] -= 1.0
    changed = table.rows.copy()
    changed["time"] -= 1.0
    assert table.rows["time"].tolist() == [0.0, 1.0, 2.0]
    none = NewestRows(DTYPE, 0)
    none.append(rows(0, 3))
    assert (len(none), none.dropped) == (0, 3)


def test_a_list_keeps_the_newest_and_a_downsampled_one_even_steps() -> None:
    kept = Newest[int](8)
    for number in range(1000):
        kept.append(number)
        assert kept == list(range(kept.dropped, number + 1))
        assert min(8, number + 1) <= len(kept) < 16
    sparse = Downsampled[int](8)
    for number in range(1000):
        sparse.append(number)
    assert 4 <= len(sparse) <= 8
    assert sparse == list(range(0, 1000, sparse.step))

"""The section and the return map: the right pairs, in the right units."""

from __future__ import annotations

import numpy as np
import pytest

from bouncing_disk_ros.core.model import ImpactKind
from bouncing_disk_ros.report.section import single_impacts, successive_impacts
from support.map_rows import map_rows


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

"""The digests of pinned runs tell what must be told apart, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from support.digest import Near, differences, digest_of


@pytest.mark.parametrize(
    ("before", "now"),
    [
        (0.0, -0.0),
        (1.0, np.nextafter(1.0, 2.0)),
        (1, 1.0),
        (1, True),
        ([1.0, 2.0], [2.0, 1.0]),
        ([[1.0], [2.0]], [[1.0, 2.0]]),
        (np.zeros((2, 3)), np.zeros((3, 2))),
        (np.zeros(3), np.zeros(3, np.float32)),
        (np.nan, np.inf),
        ("kick", "impulse"),
        ({"a": 1.0}, {"b": 1.0}),
        (Near([1.0, np.nan]), Near([1.0, np.inf])),
        (Near(1.0), Near(1.0 + 1e-11)),
        (Near([1.0]), Near([1.0, 2.0])),
    ],
)  # fmt: skip
def test_a_difference_is_seen(before: object, now: object) -> None:
    assert differences(digest_of(before), digest_of(now))

"""The digests of pinned runs tell what must be told apart, and nothing else."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest

from support.digest import Near, differences, digest_of, nearly


class Pair(NamedTuple):
    first: float
    second: float


class Renamed(NamedTuple):
    one: float
    two: float


@dataclass
class Kept:
    one: float
    two: float


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


@pytest.mark.parametrize(
    ("before", "now"),
    [
        (Pair(1.0, 2.0), Renamed(1.0, 2.0)),
        (Pair(1.0, 2.0), Kept(1.0, 2.0)),
        (1.5, np.float64(1.5)),
        (np.array([0x7FF8000000000001], np.uint64).view(np.float64), np.array([np.nan])),
        (np.arange(6)[::2], np.array([0, 2, 4])),
        (Near([1.0, 1e-17]), Near([1.0 + 1e-14, 0.0])),
        (nearly({"a": [1.0, 2]}), nearly({"a": [1.0 + 1e-12, 2]})),
    ],
)
def test_what_is_the_same_has_the_same_digest(before: object, now: object) -> None:
    assert differences(digest_of(before), digest_of(now)) == []


def test_words_that_change_leave_the_numbers_as_they_are() -> None:
    (said,) = differences(digest_of({"kick": 1.0}), digest_of({"impulse": 1.0}))
    assert said.startswith("words differ")

"""Starts fill their window evenly, and more of them begin with the same ones."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.next_collision import spread_starts


@pytest.mark.parametrize("count", [1, 2, 10, 100, 1000])
def test_starts_lie_apart_within_their_window(count: int) -> None:
    starts = spread_starts(count, -5.0)
    square = np.array(
        [(s.forcing_phase / math.tau, -s.axial_impact_velocity / 5.0) for s in starts]
    )
    assert ((square >= 0.0) & (square < 1.0)).all()
    assert all(start.axial_impact_velocity < 0.0 for start in starts)
    # 1/√n is what a square grid has; the sequence keeps above half of it for every n
    apart = np.abs(square[:, None] - square[None])
    apart = np.hypot(*np.minimum(apart, 1.0 - apart).transpose(2, 0, 1))
    np.fill_diagonal(apart, math.inf)
    assert apart.min() > 0.5 / math.sqrt(count)


def test_more_starts_begin_with_the_same() -> None:
    assert spread_starts(50, -3.0)[:20] == spread_starts(20, -3.0)


def test_faults_are_said() -> None:
    with pytest.raises(InputError, match="starts: got 0"):
        spread_starts(0, -1.0)
    with pytest.raises(InputError, match=r"velocity_begin: got 0\.0.*The window is empty"):
        spread_starts(3, 0.0)

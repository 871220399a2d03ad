"""Measures of a boundary against cases with known values: lines, discs, a Cantor set."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.dynamics import row_blocks as label_strips
from bouncing_disk_ros.analysis.dynamics.basin_labels import shares, unresolved_fraction
from bouncing_disk_ros.analysis.dynamics.boundary import (
    FRACTAL,
    basin_entropy,
    box_dimension,
    uncertainty_exponent,
)
from bouncing_disk_ros.errors import InputError

CANTOR = math.log(2.0) / math.log(3.0)


def disc(n: int) -> NDArray[np.int64]:
    y, x = np.mgrid[0:n, 0:n] / n - 0.5
    return (x * x + y * y < 0.16).astype(np.int64)


def cantor_stripes(levels: int, rows: int) -> NDArray[np.int64]:
    """Stripes with borders at the middle-third Cantor set: gaps of odd level in another basin."""
    n = 3**levels
    label = np.zeros(n, np.int64)
    digits = np.arange(n)
    for level in range(levels, 0, -1):  # the coarsest digit 1 decides
        place = 3 ** (levels - level)
        label[(digits // place) % 3 == 1] = level
    return np.tile(label % 2, (rows, 1))


def test_one_basin_has_no_boundary() -> None:
    labels = np.zeros((64, 64), np.int64)
    entropy = basin_entropy(labels)
    assert entropy.basin == 0.0
    assert math.isnan(entropy.boundary)
    assert math.isnan(uncertainty_exponent(labels).exponent)
    assert math.isnan(box_dimension(labels).exponent)


def test_smooth_boundary() -> None:
    labels = disc(1024)
    law = uncertainty_exponent(labels)
    assert abs(law.exponent - 1.0) < 0.02
    assert law.uncertainty < 0.01
    assert abs(box_dimension(labels).exponent - 1.0) < 0.03
    assert basin_entropy(labels).boundary < FRACTAL


def test_straight_line_counts_exactly() -> None:
    """A vertical line at column 32: pixels within d on both sides see the other label."""
    labels = (np.arange(64)[None, :] >= 32).repeat(64, 0).astype(np.int64)
    law = uncertainty_exponent(labels, [1, 2, 4])
    for d, share in zip(law.sizes, law.counts, strict=True):
        assert share == 2 * d / (64 - 2 * 4)
    assert uncertainty_exponent(labels, [1, 2, 4], periodic=True).counts[0] == 4 / 64


def test_entropy_of_equal_shares() -> None:
    """A column of squares cut in the middle has ln 2, all others nothing."""
    labels = (np.arange(40)[None, :] >= 22).repeat(40, 0).astype(np.int64)
    entropy = basin_entropy(labels, 4)
    assert entropy.boundary == pytest.approx(math.log(2.0), abs=1e-15)
    assert entropy.basin == pytest.approx(math.log(2.0) / 10, abs=1e-15)
    assert entropy.boundary_squares == 10


def test_cantor_stripes_have_the_dimension_of_the_cantor_set() -> None:
    """The borders of the stripes: D = 1 + ln 2/ln 3, and α = 1 − ln 2/ln 3 (Grebogi et al.)."""
    labels = cantor_stripes(9, 3**6)
    sizes = [3**k for k in range(1, 6)]
    # boxes of 3^k pixels fit the construction: only the gaps that k levels leave over are missed
    assert abs(box_dimension(labels, sizes).exponent - (1.0 + CANTOR)) < 0.02
    law = uncertainty_exponent(labels, sizes)
    assert abs(law.exponent - (1.0 - CANTOR)) < 0.02


def test_random_labels_fill_the_plane() -> None:
    labels = np.random.default_rng(7).integers(0, 4, (512, 512))
    assert abs(uncertainty_exponent(labels).exponent) < 0.03
    assert abs(box_dimension(labels).exponent - 2.0) < 0.1
    entropy = basin_entropy(labels, 16)
    assert entropy.boundary > FRACTAL
    assert entropy.boundary == pytest.approx(math.log(4.0), abs=0.02)


@pytest.mark.parametrize("shape", [(0, 0), (5,), (8, 8)])
def test_maps_too_small_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="labels"):
        basin_entropy(np.zeros(shape, np.int64))


@given(st.integers(0, 2**32 - 1), st.integers(40, 90), st.integers(40, 90), st.booleans())
@settings(max_examples=30, deadline=None)
def test_strips_change_nothing(seed: int, rows: int, columns: int, periodic: bool) -> None:
    """Any cut of a map into strips, of a few rows or all, gives the same counts."""
    rng = np.random.default_rng(seed)
    rough = rng.integers(-1, 3, (12, 12)).repeat(8, 0).repeat(8, 1)[:rows, :columns]
    labels = np.where(rng.random((rows, columns)) < 0.02, 3, rough).astype(np.int32)

    def measured() -> list[object]:
        laws = [uncertainty_exponent(labels, periodic=periodic), box_dimension(labels)]
        entropy, parts = basin_entropy(labels), shares(labels, 4, periodic=periodic)
        counts = [float(count) for law in laws for count in law.counts]
        known = entropy.squares, entropy.boundary_squares, pytest.approx(entropy.basin, rel=1e-13)
        return [*counts, *known, *parts, unresolved_fraction(labels)]

    with pytest.MonkeyPatch.context() as patch:
        whole = measured()
        for pixels in (1, 7 * columns, rows * columns // 2):
            patch.setattr(label_strips, "PIXELS", pixels)
            assert measured() == whole
    assert unresolved_fraction(labels) == np.mean(labels == -1)

"""Measures of a boundary against cases with known values: a line and a Cantor set."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps import basin_measures
from bouncing_disk_ros.maps.basin_measures import (
    basin_entropy,
    box_dimension,
    shares,
    uncertainty_exponent,
    unresolved_fraction,
)
from support.checks import refused

CANTOR = math.log(2.0) / math.log(3.0)


def sampled_cantor_stripes(n: int) -> NDArray[np.int8]:
    """Stripes of a Cantor set with gaps of all levels, known at n points as in a basin."""
    place, label = (np.arange(n) + 0.5) / n, np.zeros(n, np.int8)
    inside = np.ones(n, bool)
    for level in range(1, 34):  # 3^-33 is the last digit of a float64
        place = 3.0 * place
        digit = np.floor(place)
        place -= digit
        label[inside & (digit == 1.0)] = level % 2
        inside &= digit != 1.0
    return np.tile(label, (n, 1))


def test_small_boxes_do_not_miss_more_of_a_fractal_than_large_ones() -> None:
    """Boxes of k × k labels gave 1.50 here: small ones have few labels to find the boundary by."""
    labels = sampled_cantor_stripes(4096)
    law = box_dimension(labels)
    assert abs(law.exponent - (1.0 + CANTOR)) < law.uncertainty < 0.03
    alpha = uncertainty_exponent(labels)
    assert abs(2.0 - alpha.exponent - (1.0 + CANTOR)) < alpha.uncertainty < 0.03


def test_straight_line_counts_exactly() -> None:
    """A vertical line at column 32: pixels within d on both sides see the other label."""
    labels = (np.arange(64)[None, :] >= 32).repeat(64, 0).astype(np.int64)
    law = uncertainty_exponent(labels, [1, 2, 4])
    for d, share in zip(law.sizes, law.counts, strict=True):
        assert share == 2 * d / (64 - 2 * 4)
    assert uncertainty_exponent(labels, [1, 2, 4], periodic=True).counts[0] == 4 / 64


@pytest.mark.parametrize("shape", [(0, 0), (5,), (8, 8)])
def test_maps_too_small_are_refused(shape: tuple[int, ...]) -> None:
    refused("labels", basin_entropy, np.zeros(shape, np.int64))


@given(st.integers(0, 2**32 - 1), st.integers(40, 90), st.integers(40, 90), st.booleans())
@settings(max_examples=10)
def test_strips_change_nothing(seed: int, rows: int, columns: int, periodic: bool) -> None:
    """Any cut of a map into strips, of a few rows or all, gives the same counts."""
    rng = np.random.default_rng(seed)
    rough = rng.integers(-1, 3, (12, 12)).repeat(8, 0).repeat(8, 1)[:rows, :columns]
    labels = np.where(rng.random((rows, columns)) < 0.02, 3, rough).astype(np.int32)

    def measured() -> list[object]:
        measures = (uncertainty_exponent, box_dimension)
        laws = [measure(labels, periodic=periodic) for measure in measures]
        entropy, parts = basin_entropy(labels), shares(labels, 4, periodic=periodic)
        counts = [float(count) for law in laws for count in law.counts]
        known = entropy.squares, entropy.boundary_squares, pytest.approx(entropy.basin, rel=1e-13)
        return [*counts, *known, *parts, unresolved_fraction(labels)]

    with pytest.MonkeyPatch.context() as patch:
        whole = measured()
        for pixels in (1, 7 * columns, rows * columns // 2):
            patch.setattr(basin_measures, "PIXELS", pixels)
            assert measured() == whole
            patch.setattr(basin_measures, "_NEAR", pixels)
            assert measured() == whole
    assert unresolved_fraction(labels) == np.mean(labels == -1)


def test_sizes_and_labels_of_other_kinds() -> None:
    """Arrays of sizes and lists were tracebacks; parts of labels and of pixels were cut off."""
    labels = (np.add.outer(np.arange(64), np.arange(64)) > 64).astype(np.int32)
    sizes = [1, 2, 4]
    for measure in (box_dimension, uncertainty_exponent):
        wanted = measure(labels, sizes).exponent
        given: list[Any] = [np.array(sizes), np.array(sizes, np.uint8), tuple(np.array(sizes))]
        assert [measure(labels, one).exponent for one in given] == [wanted] * 3
        assert measure(labels > 0, sizes).exponent == wanted
        for wrong in ([1.5, 3.0], [0, 1, 2], [-1, 2, 4], [True], 3):
            with pytest.raises(InputError, match=r"^(sizes|distances): got "):
                measure(labels, wrong)  # type: ignore[arg-type]
    assert basin_entropy(labels, np.uint8(5)) == basin_entropy(labels)  # type: ignore[arg-type]
    for size in (0, -5, 2.5):
        with pytest.raises(InputError, match=r"^size: got .*, allowed: a whole number >= 1"):
            basin_entropy(labels, size)  # type: ignore[arg-type]
    for other in (0.4 * labels, labels.tolist(), labels.astype(str), None):
        with pytest.raises(InputError, match=r"^labels: .* allowed: an array \(rows, columns\)"):
            basin_entropy(other)  # type: ignore[arg-type]

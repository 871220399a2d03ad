"""Ratios of columns with errors in both: exact where there is no error, intervals that cover."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from bouncing_disk_ros.report import estimate as ratio_estimate
from bouncing_disk_ros.report.estimate import (
    change_of,
    critical_count,
    lower_bound,
    ratio_of,
)
from reference.cases import covers, in_soak

Noise = Callable[[np.random.Generator, int], NDArray[np.float64]]
NOISES: dict[str, Noise] = {
    "normal": lambda rng, n: rng.normal(0.0, 1.0, n),
    "heavy tails": lambda rng, n: rng.standard_t(2.0, n),
    "sizes that differ": lambda rng, n: rng.normal(0.0, 1.0, n) * rng.uniform(0.1, 3.0, n),
    "one in ten is gross": lambda rng, n: (
        rng.normal(0.0, 1.0, n) * np.where(rng.uniform(size=n) < 0.1, 100.0, 1.0)
    ),
}


@pytest.mark.parametrize(
    ("n", "count"), [(5, -1), (6, 0), (8, 3), (10, 8), (15, 25), (20, 52), (25, 89), (30, 137)]
)
def test_counts_are_those_of_the_printed_tables(n: int, count: int) -> None:
    assert critical_count(n, 0.025) == count


def test_approximation_takes_over_without_a_jump(monkeypatch: pytest.MonkeyPatch) -> None:
    exact = [critical_count(n, chance) for n in (58, 59, 60) for chance in (0.025, 0.05)]
    monkeypatch.setattr(ratio_estimate, "_EXACT_UP_TO", 0)
    close = [critical_count(n, chance) for n in (58, 59, 60) for chance in (0.025, 0.05)]
    # counts are near 600 and one count is 0.03 % of chance there
    assert close == pytest.approx(exact, abs=1.0)


@pytest.mark.parametrize(
    ("n", "noise"),
    [(7, "one in ten is gross"), (80, "heavy tails"), *in_soak(*product((7, 20, 80), NOISES))],
)
def test_intervals_cover_with_errors_in_both(n: int, noise: str) -> None:
    """Errors of a tenth of x, in x and y: least squares and the mean of ratios would be biased."""

    def trial(rng: np.random.Generator) -> bool:
        x = rng.uniform(0.2, 2.0, n)
        draw = NOISES[noise]
        found = ratio_of(0.7 * x + 0.1 * draw(rng, n), x + 0.1 * draw(rng, n))
        return found.low <= 0.7 <= found.high

    covers(trial, 0.95, poor=0.8)


def test_no_bias_where_a_regression_has_one() -> None:
    """Errors in x of σ = 0.5 at x = 1 ± 0.3: least squares would give 0.7 · (1.09/1.34) = 0.57."""
    rng = np.random.default_rng(3)
    x = rng.normal(1.0, 0.3, 20_000)
    found = ratio_of(0.7 * x, x + rng.normal(0.0, 0.5, len(x)))
    assert found.low <= 0.7 <= found.high
    # σ of y − r x is 0.35, of its mean 0.0025: the interval is 2 · 1.96 of that, and 2 % for ranks
    assert found.high - found.low == pytest.approx(4.0 * 1.96 / 4.0 * 2.0 * 0.0025, rel=0.1)


@example(0.9999999999999999, [1.0, 1.0, 1.0, 1.0, 9.0, 65.0, 129.0])
@given(
    st.floats(0.0, 1.0),
    st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=40),
)
def test_without_errors_it_is_exact(value: float, x: list[float]) -> None:
    column = np.array(x)
    found = ratio_of(value * column, column)
    assert found.value == pytest.approx(value, rel=1e-15, abs=1e-300)
    if len(x) >= ratio_estimate.LEAST_ROWS:
        # the products y and r x are rounded: ε/2 each; an end is a float beside that: ε more. It is
        # an ε of the end: twice that of a value just below 1
        assert found.high - found.low <= 4.0 * np.finfo(float).eps * found.high + 1e-300
        assert found.low <= found.value <= found.high
    else:
        assert (found.low, found.high) == (-math.inf, math.inf)


def test_nothing_to_divide_by() -> None:
    assert all(math.isnan(v) for v in ratio_of(np.zeros(0), np.zeros(0)))
    assert all(math.isnan(v) for v in ratio_of(np.ones(3), np.zeros(3)))
    assert lower_bound(np.ones(3), np.ones(3)) == -math.inf


def test_a_fifth_of_wild_rows_hardly_moves_it() -> None:
    rng = np.random.default_rng(4)
    x = rng.uniform(1.0, 2.0, 200)
    y = 0.7 * x + rng.normal(0.0, 0.01, 200)
    y[:40] = 1e6
    # 20 % on one side shift the quantile of the pairs by less than one σ of a row
    assert ratio_of(y, x).value == pytest.approx(0.7, abs=0.01)


def test_lower_bound_is_one_sided() -> None:
    def trial(rng: np.random.Generator) -> bool:
        x = rng.uniform(0.5, 2.0, 20)
        return lower_bound(0.7 * x + rng.normal(0.0, 0.1, 20), x) <= 0.7

    covers(trial, 0.95, poor=0.8)


def test_changes_are_found_where_they_are() -> None:
    rng = np.random.default_rng(5)
    x = rng.uniform(0.5, 2.0, 300)
    y = np.where(np.arange(300) < 200, 0.5, 0.6) * x + rng.normal(0.0, 0.05, 300)
    at = change_of(y, x, ratio_of(y, x).value)
    assert at is not None
    assert abs(at - 200) <= 10  # a change of two σ is placed within a few rows
    assert change_of(y[:200], x[:200], ratio_of(y[:200], x[:200]).value) is None


def test_changes_are_rarely_seen_where_there_are_none() -> None:
    def trial(rng: np.random.Generator) -> bool:
        x = rng.uniform(0.5, 2.0, 60)
        y = 0.7 * x + 0.1 * rng.standard_t(3.0, 60)
        return change_of(y, x, ratio_of(y, x).value) is None

    covers(trial, 0.999, poor=0.945)

"""Distributions, the median eigenvalue and running maxima: as SciPy and NumPy have them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage, special

from bouncing_disk_ros.distributions import (
    chi_square_quantile,
    normal,
    normal_quantile,
    t_probability,
    t_quantile,
)
from bouncing_disk_ros.measured.filters import running_maximum
from bouncing_disk_ros.measured.kernels.likelihood import median_eigenvalue


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 11, 498, 19997])
def test_distributions_are_those_of_scipy(degrees: int) -> None:
    for x in (-30.0, -2.2, 0.0, 0.5, 4.0):
        assert t_probability(degrees, x) == pytest.approx(special.stdtr(degrees, x), abs=1e-12)
        assert normal(x) == pytest.approx(special.ndtr(x), rel=1e-12)
    assert t_quantile(degrees) == pytest.approx(special.stdtrit(degrees, 0.975), rel=1e-11)
    for above in (0.5, 0.05, 1e-9):
        expected = special.chdtri(degrees, above)
        assert chi_square_quantile(degrees, above) == pytest.approx(expected, rel=1e-12)
        assert normal_quantile(above) == pytest.approx(special.ndtri(above), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(("free", "wider"), [(1.5, 0.2), (2.9, 0.02), (3.5, 0.004), (40.5, 1e-4)])
def test_quantiles_between_whole_degrees_are_a_little_too_wide(free: float, wider: float) -> None:
    assert 1.0 < t_quantile(free) / special.stdtrit(free, 0.975) < 1.0 + wider


@pytest.mark.parametrize("void", [[], [3], [3, 7]])
@pytest.mark.parametrize("count", [12, 101])
def test_the_median_eigenvalue_is_that_of_numpy(count: int, void: list[int]) -> None:
    """Equations of nothing, whose rows are 0, do not count."""
    rng = np.random.default_rng(count)
    slopes, errors = rng.standard_normal((count, 3)), np.exp(rng.standard_normal(count + 2))
    slopes[void] = 0.0
    matrix = np.zeros((count, count + 2))
    for j in range(count):
        matrix[j, j : j + 3] = slopes[j]
    found = np.sort(np.linalg.eigvalsh(matrix @ np.diag(errors**2) @ matrix.T))[len(void) :]
    expected = float(np.median(found))
    assert median_eigenvalue(slopes, errors, len(void)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("size", [0, 1, 2, 7, 100])
def test_running_maxima_are_those_of_scipy(size: int) -> None:
    values = np.random.default_rng(1).standard_normal(500)
    expected = ndimage.maximum_filter1d(values, 2 * size + 1)
    assert running_maximum(values, size, size).tolist() == expected.tolist()
    later = [values[i : i + size + 1].max() for i in range(500)]
    assert running_maximum(values, 0, size).tolist() == later

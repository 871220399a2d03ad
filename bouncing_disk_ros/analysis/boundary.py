"""How tangled the boundary of basins is: basin entropy, uncertainty exponent, box dimension.

All three look at a map of labels (rows, columns) and count squares of k × k pixels, or pairs of
pixels k apart, for several k. Sources: A. Daza et al., "Basin entropy" (Sci. Rep. 6, 31416, 2016);
C. Grebogi, S. McDonald, E. Ott, J. Yorke, "Final state sensitivity" (Phys. Lett. A 99, 415, 1983).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError

Labels = NDArray[np.integer]
FRACTAL = math.log(2.0)
"""A boundary basin entropy above ln 2 means a fractal boundary (Daza et al., sufficient)."""
FEWEST_SIZES = 3


class BasinEntropy(NamedTuple):
    """Basin entropy of a map, in nats."""

    basin: float  # S_b, mean over all squares
    boundary: float  # S_bb, mean over the squares that hold more than one label; nan: there is none
    squares: int
    boundary_squares: int


class PowerLaw(NamedTuple):
    """A count that goes as size^exponent: what was counted, and the fit through it."""

    exponent: float
    uncertainty: float  # standard error of the exponent by the scatter about the line
    sizes: NDArray[np.int64]  # (n,) pixels
    counts: NDArray[np.float64]  # (n,)


def basin_entropy(labels: Labels, size: int = 5) -> BasinEntropy:
    """Entropy of the labels within squares of `size` pixels; what is left at the edges is cut."""
    squares = _squares(narrow(_checked(labels, size)), size)
    mixed = _by_square(np.minimum, squares) != _by_square(np.maximum, squares)
    part = squares.transpose(0, 2, 1, 3)[mixed].reshape(-1, size * size)
    sums = np.zeros(len(part))
    for label in np.unique(part):
        p = np.mean(part == label, axis=1)
        sums -= np.where(p > 0.0, p * np.log(np.where(p > 0.0, p, 1.0)), 0.0)
    boundary = float(sums.mean()) if len(sums) else math.nan
    return BasinEntropy(float(sums.sum()) / mixed.size, boundary, mixed.size, len(part))


def uncertainty_exponent(
    labels: Labels, distances: Sequence[int] = (), *, periodic: bool = False
) -> PowerLaw:
    """α of f(d) ~ d^α, the share f of pixels with another label at d pixels along an axis.

    A pixel (not nearer to an edge than the largest distance) counts when a neighbour at distance d
    to either side, along rows or columns, has another label: then an error of d can change the
    final state. The boundary has the dimension 2 − α: α = 1 for a smooth line.
    `periodic`: the columns close to a ring (the forcing phase). Exponent nan: no boundary.
    """
    sizes = np.array(distances or _sizes(_checked(labels, 1).shape), np.int64)
    _checked(labels, int(sizes.max()))
    edge = int(sizes.max())  # the same pixels for all distances, so that the shares compare
    ring = narrow(labels)
    if periodic:
        ring = np.pad(ring, ((0, 0), (edge, edge)), "wrap")
    height, width = ring.shape
    middle = ring[edge : height - edge, edge : width - edge]
    shares = []
    differs, apart = np.empty(middle.shape, bool), np.empty(middle.shape, bool)
    for d in (int(size) for size in sizes):
        differs[:] = False
        for shift in (-d, d):
            down = slice(edge + shift, height - edge + shift)
            along = slice(edge + shift, width - edge + shift)
            for other in (ring[down, edge : width - edge], ring[edge : height - edge, along]):
                np.not_equal(other, middle, out=apart)
                differs |= apart
        shares.append(np.count_nonzero(differs) / differs.size)
    return _power_law(sizes, np.array(shares))


def box_dimension(labels: Labels, sizes: Sequence[int] = ()) -> PowerLaw:
    """Box-counting dimension D of the boundary: N(k) ~ k^−D squares that the boundary meets.

    The boundary is taken as the corners at which four pixels with different labels meet. The
    exponent given is D itself: 1 for a smooth line. nan: no boundary.
    """
    labels = narrow(_checked(labels, 1))
    first = labels[:-1, :-1]
    met = labels[1:, :-1] != first
    for corner in (labels[:-1, 1:], labels[1:, 1:]):
        met |= corner != first
    chosen = np.array(sizes or _sizes(met.shape), np.int64)
    counts = []
    for size in (int(value) for value in chosen):
        share = np.mean(_by_square(np.logical_or, _squares(met, size)))
        counts.append(share * met.size / size**2)  # of the whole map, its cut edges included
    law = _power_law(chosen, np.array(counts))
    return law._replace(exponent=-law.exponent)


def _checked(labels: Labels, size: int) -> Labels:
    if labels.ndim != 2 or min(labels.shape) < 2 * size + 1:
        allowed = f"a map of at least {2 * size + 1} × {2 * size + 1} labels"
        raise InputError("labels", "an array of shape " + str(labels.shape), allowed)
    return labels


def _sizes(shape: tuple[int, ...]) -> list[int]:
    """Powers of two from 1 pixel to a sixteenth of the map."""
    largest = max(min(shape) // 16, 4)
    return [2**k for k in range(int(math.log2(largest)) + 1)]


def narrow(labels: Labels) -> Labels:
    """The labels in the smallest type that holds them: less memory to go through."""
    low, high = int(labels.min()), int(labels.max())
    return labels.astype(np.result_type(np.min_scalar_type(low), np.min_scalar_type(high)))


def _squares(labels: NDArray[Any], size: int) -> NDArray[Any]:
    """A map cut into squares: (rows of squares, size, columns of squares, size)."""
    rows, columns = (length // size for length in labels.shape)
    return labels[: rows * size, : columns * size].reshape(rows, size, columns, size)


def _by_square(function: np.ufunc, squares: NDArray[Any]) -> NDArray[Any]:
    """Reduce each square: rows, then columns, turned to lie in rows, for numpy is fast on these."""
    rows, size, columns, _ = squares.shape
    if size == 1:
        return squares.reshape(rows, columns)
    reduced = function.reduce(squares, axis=1).reshape(rows, columns * size)
    turned = np.ascontiguousarray(reduced.T).reshape(columns, size, rows)
    found: NDArray[Any] = function.reduce(turned, axis=1).T
    return found


def _power_law(sizes: NDArray[np.int64], counts: NDArray[np.float64]) -> PowerLaw:
    """Least squares through the logarithms."""
    known = counts > 0.0
    if known.sum() < FEWEST_SIZES:
        return PowerLaw(math.nan, math.nan, sizes, counts)
    x, y = np.log(sizes[known].astype(float)), np.log(counts[known])
    x0 = x - x.mean()
    slope = float(x0 @ y / (x0 @ x0))
    rest = y - y.mean() - slope * x0
    error = math.sqrt(float(rest @ rest) / max(1, len(x) - 2) / float(x0 @ x0))
    return PowerLaw(slope, error, sizes, counts)

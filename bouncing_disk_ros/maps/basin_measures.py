"""Maps of labels (rows, columns), and measures of the boundary of basins in them.

Maps too large for memory are read in blocks of rows, or downsampled. Basin entropy, uncertainty
exponent and box dimension look at squares of k × k pixels, or at pixels k apart, for several k. A
label is known at the centre of its pixel alone: so a square of any size is judged by the same
number of labels, its corners. (Judged by all its k² labels a small square misses more of the
boundary than a large one, and the dimension comes out too low.)
Sources: A. Daza et al., "Basin entropy" (Sci. Rep. 6, 31416, 2016); C. Grebogi, S. McDonald, E.
Ott, J. Yorke, "Final state sensitivity" (Phys. Lett. A 99, 415, 1983).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.distributions import t_quantile
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import items, plain, whole

PIXELS = 2**25
"""About so many pixels of a map are in memory at a time."""
_NEAR = 2**18
"""About so many pixels are compared at a time: they stay in the cache of a processor."""
UNRESOLVED = -1
"""Label of a start that has not been decided."""
FEWEST_SIZES = 3
LARGEST = 256
"""Largest square and distance (pixels): blocks of a huge map overlap by so much."""


def centres(begin: float, end: float, count: int) -> NDArray[np.float64]:
    """Centres (count,) of pixels from begin to end."""
    return begin + (end - begin) * (np.arange(count) + 0.5) / count


class LabelMap(Protocol):
    """Labels (rows, columns): an array, or what is read where it is sliced (xarray, Zarr)."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns."""
        ...

    @property
    def ndim(self) -> int:
        """2."""
        ...

    def __getitem__(self, key: slice, /) -> Any:
        """Some rows."""
        ...


def row_blocks(
    labels: LabelMap, begin: int, end: int, unit: int = 1, before: int = 0, after: int = 0
) -> Iterator[NDArray[Any]]:
    """Rows begin to end in blocks of whole units, the last one cut at `end`.

    Each comes with so many rows `before` and `after` it, those that the map has, in the smallest
    type that holds its labels: less memory to go through.
    """
    rows, columns = labels.shape
    length = unit * max(1, PIXELS // (columns * unit))
    for first in range(begin, end, length):
        last = min(first + length, end)
        yield narrow(np.asarray(labels[max(first - before, 0) : min(last + after, rows)]))


def narrow(labels: NDArray[np.integer]) -> NDArray[Any]:
    """The labels in the smallest type that holds them."""
    low, high = int(labels.min()), int(labels.max())
    kind = np.result_type(np.min_scalar_type(low), np.min_scalar_type(high))
    return labels.astype(kind, copy=False)


def downsample(field: Any, most: int) -> NDArray[Any]:
    """Every k-th pixel of a map (array or xarray), so that each side has less than twice `most`."""
    rows, columns = (max(1, length // most) for length in field.shape)
    return np.asarray(field[rows // 2 :: rows, columns // 2 :: columns])


class Share(NamedTuple):
    """Part of the starts that a label has."""

    fraction: float
    uncertainty: float  # standard error


def shares(labels: LabelMap, count: int, *, periodic: bool = True) -> list[Share]:
    """Share of each of `count` labels in a map (rows, columns) of starts, with its standard error.

    A grid errs only where a pixel is cut by a boundary: each pixel with another label beside it is
    taken as a toss of a coin, of variance 1/4 pixel². `periodic`: the columns are a whole period.
    """
    rows, columns = labels.shape
    mine_of, cut_of = np.zeros(count), np.zeros(count)
    for k, part in enumerate(row_blocks(labels, 0, rows, before=1)):
        own = slice(1 if k else 0, None)  # without the row of the strip before
        for i in range(count):
            mine = part == i
            cut_of[i] += np.count_nonzero(_cut(mine, periodic=periodic)[own])
            mine_of[i] += np.count_nonzero(mine[own])
    pixels = rows * columns
    return [
        Share(float(mine) / pixels, 0.5 * math.sqrt(cut) / pixels)
        for mine, cut in zip(mine_of, cut_of, strict=True)
    ]


def unresolved_fraction(labels: LabelMap) -> float:
    """Share of the starts that have no label."""
    rows, columns = labels.shape
    parts = row_blocks(labels, 0, rows)
    return sum(np.count_nonzero(part == UNRESOLVED) for part in parts) / (rows * columns)


def _cut(mine: NDArray[np.bool_], *, periodic: bool) -> NDArray[np.bool_]:
    """Pixels unlike that before them, in their row or column."""
    edge = np.zeros(mine.shape, bool)
    np.not_equal(mine[1:], mine[:-1], out=edge[1:])
    edge[:, 1:] |= mine[:, 1:] != mine[:, :-1]
    if periodic:
        edge[:, 0] |= mine[:, 0] != mine[:, -1]
    return edge


class BasinEntropy(NamedTuple):
    """Basin entropy of a map, in nats."""

    basin: float  # S_b, mean over all squares
    boundary: float  # S_bb, mean over the squares that hold more than one label; nan: there is none
    squares: int
    boundary_squares: int


class PowerLaw(NamedTuple):
    """A count that goes as size^exponent: what was counted, and the fit through it.

    The interval holds the scatter about the line (Student's t) and the change of the slope with
    size: half the difference of the slopes of the smaller and the larger half of the sizes. It is
    about these sizes: nothing is said of smaller ones.
    """

    exponent: float
    uncertainty: float  # half-width of the interval of 95 % of the exponent
    sizes: NDArray[np.int64]  # (n,) pixels
    counts: NDArray[np.float64]  # (n,)


def basin_entropy(labels: LabelMap, size: int = 5) -> BasinEntropy:
    """Basin entropy of a map, from squares of `size` pixels; pixels left at the edges are cut.

    >>> labels = (np.add.outer(np.arange(64), np.arange(64)) > 64).astype(np.int32)
    >>> basin_entropy(labels)
    """
    size = whole("size", plain(size), 1)
    rows, _ = _checked(labels, size).shape
    total, squares, boundary_squares = 0.0, 0, 0
    for part in row_blocks(labels, 0, rows // size * size, size):
        cut = _squares(part, size)
        mixed = _by_square(np.minimum, cut) != _by_square(np.maximum, cut)
        sums = _entropies(cut.transpose(0, 2, 1, 3)[mixed].reshape(-1, size * size))
        total += float(sums.sum())
        squares += mixed.size
        boundary_squares += len(sums)
    boundary = total / boundary_squares if boundary_squares else math.nan
    return BasinEntropy(total / squares, boundary, squares, boundary_squares)


def _entropies(squares: NDArray[Any]) -> NDArray[np.float64]:
    sums = np.zeros(len(squares))
    for label in np.unique(squares):
        p = np.mean(squares == label, axis=1)
        sums -= np.where(p > 0.0, p * np.log(np.where(p > 0.0, p, 1.0)), 0.0)
    return sums


def uncertainty_exponent(
    labels: LabelMap, distances: Sequence[int] = (), *, periodic: bool = False
) -> PowerLaw:
    """Uncertainty exponent α: f(d) ~ d^α pixels have another label at d pixels along an axis.

    A pixel (not nearer to an edge than the largest distance) counts when a neighbour at distance d
    to either side, along rows or columns, has another label: then an error of d can change the
    final state. The boundary has the dimension 2 − α: α = 1 for a smooth line.
    `periodic`: the columns close to a ring (the forcing phase). Exponent nan: no boundary.

    >>> labels = (np.add.outer(np.arange(64), np.arange(64)) > 64).astype(np.int32)
    >>> uncertainty_exponent(labels).exponent
    """
    sizes = _lengths("distances", distances, labels)
    edge = int(sizes.max())  # the same pixels for all distances, so that the shares compare
    return _power_law(sizes, _counted(labels, sizes, edge, periodic, _uncertain))


def _uncertain(strip: NDArray[Any], edge: int, d: int) -> int:
    """How many of the pixels `edge` away from all sides have another label at a distance."""
    height, width = (length - 2 * edge for length in strip.shape)
    columns = strip[edge - d : edge + height + d, edge : edge + width]
    rows = strip[edge : edge + height, edge - d : edge + width + d]
    down, along = columns[d:] != columns[:-d], rows[:, d:] != rows[:, :-d]
    differs = down[:height] | down[d:]
    differs |= along[:, :width]
    differs |= along[:, d:]
    return int(np.count_nonzero(differs))


def _counted(
    labels: LabelMap, sizes: NDArray[np.int64], edge: int, periodic: bool,
    count: Callable[[NDArray[Any], int, int], int],
) -> NDArray[np.float64]:  # fmt: skip
    """Share of the pixels `edge` away from all sides that `count` finds in strips, of each size."""
    rows, columns = labels.shape
    pixels = (rows - 2 * edge) * (columns if periodic else columns - 2 * edge)
    counts = np.zeros(len(sizes))
    for part in row_blocks(labels, edge, rows - edge, before=edge, after=edge):
        ring = np.pad(part, ((0, 0), (edge, edge)), "wrap") if periodic else part
        length = max(_NEAR // ring.shape[1], edge)  # strips overlap by up to twice `edge`
        for begin in range(0, len(ring) - 2 * edge, length):
            strip = ring[begin : begin + length + 2 * edge]
            counts += [count(strip, edge, int(size)) for size in sizes]
    return counts / pixels


def box_dimension(
    labels: LabelMap, sizes: Sequence[int] = (), *, periodic: bool = False
) -> PowerLaw:
    """Box-counting dimension D of the boundary: N(d) ~ d^−D squares of side d contain a part of it.

    A square holds a part when its four corners do not all have one label. N(d) is the share of such
    squares, of all positions of their centres where the largest fits, over d². `periodic`:
    the columns close to a ring. The exponent given is D itself: 1 for a smooth line. nan: none.

    >>> labels = (np.add.outer(np.arange(64), np.arange(64)) > 64).astype(np.int32)
    >>> box_dimension(labels).exponent
    """
    sides = _lengths("sizes", sizes, labels)
    found = _counted(labels, sides, (int(sides.max()) + 1) // 2, periodic, _mixed_squares)
    law = _power_law(sides, found / sides.astype(float) ** 2)
    return law._replace(exponent=-law.exponent)


def _mixed_squares(strip: NDArray[Any], edge: int, side: int) -> int:
    """How many squares about the pixels `edge` away from all sides have unlike corners."""
    height, width = (length - 2 * edge for length in strip.shape)
    first = edge - side // 2
    rows = strip[first : first + height + side, first : first + width + side]
    along = rows[:, side:] != rows[:, :-side]
    mixed = along[:height] | along[side:]
    mixed |= rows[side:, :width] != rows[:height, :width]
    return int(np.count_nonzero(mixed))


def _lengths(field: str, given: Sequence[int], labels: LabelMap) -> NDArray[np.int64]:
    """The given lengths in pixels, or usual ones; InputError for a map that is too small."""
    found = [whole(field, plain(one), 1) for one in items(field, plain(given))]
    lengths = np.array(found or _sizes(_checked(labels, 1).shape), np.int64)
    _checked(labels, int(lengths.max()))
    return lengths


def _checked(labels: LabelMap, size: int) -> LabelMap:
    kind = getattr(getattr(labels, "dtype", None), "kind", "")
    if kind not in ("b", "i", "u"):
        given = f"{type(labels).__name__} of {getattr(labels, 'dtype', 'no type')}"
        raise InputError("labels", given, "an array (rows, columns) of whole numbers")
    if labels.ndim != 2 or min(labels.shape) < 2 * size + 1:
        allowed = f"a map of at least {2 * size + 1} × {2 * size + 1} labels"
        raise InputError("labels", "an array of shape " + str(labels.shape), allowed)
    return labels


def _sizes(shape: tuple[int, ...]) -> list[int]:
    """Powers of two from 1 pixel to a sixteenth of the map, at most LARGEST."""
    largest = min(max(min(shape) // 16, 4), LARGEST)
    return [2**k for k in range(int(math.log2(largest)) + 1)]


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
    n = int(known.sum())
    if n < FEWEST_SIZES:
        return PowerLaw(math.nan, math.nan, sizes, counts)
    x, y = np.log(sizes[known].astype(float)), np.log(counts[known])
    slope = _slope(x, y)
    x0 = x - x.mean()
    rest = y - y.mean() - slope * x0
    scatter = math.sqrt(float(rest @ rest) / (n - 2) / float(x0 @ x0))
    half = n // 2 + 1
    bend = 0.5 * abs(_slope(x[-half:], y[-half:]) - _slope(x[:half], y[:half]))
    return PowerLaw(slope, math.hypot(t_quantile(n - 2) * scatter, bend), sizes, counts)


def _slope(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    x0 = x - x.mean()
    return float(x0 @ y / (x0 @ x0))

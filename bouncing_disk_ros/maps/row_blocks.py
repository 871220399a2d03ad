"""Maps too large for memory: read in blocks of rows, or downsampled."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

PIXELS = 2**25
"""About so many pixels of a map are in memory at a time."""


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
    return labels.astype(np.result_type(np.min_scalar_type(low), np.min_scalar_type(high)))


def downsample(field: Any, most: int) -> NDArray[Any]:
    """Every k-th pixel of a map (array or xarray), so that each side has less than twice `most`."""
    rows, columns = (max(1, length // most) for length in field.shape)
    return np.asarray(field[rows // 2 :: rows, columns // 2 :: columns])

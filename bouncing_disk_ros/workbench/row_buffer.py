"""The newest rows of a growing table, in order of time."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


class RowBuffer:
    """A table of rows of one dtype whose field `time` never falls; holds the newest `keep`.

    Appending costs the same however many rows are held: half of the space is moved at a time.
    """

    def __init__(self, dtype: Any, keep: int) -> None:
        self._rows = np.zeros(2 * keep, dtype)
        self._keep, self._first, self._end = keep, 0, 0

    def __len__(self) -> int:
        return self._end - self._first

    @property
    def rows(self) -> NDArray[np.void]:
        """All rows held, a view: copy what shall stay."""
        return self._rows[self._first : self._end]

    def append(self, rows: NDArray[np.void]) -> None:
        """Add rows at the end; the oldest fall out."""
        rows = rows[-self._keep :]
        if self._end + len(rows) > len(self._rows):
            kept = self.rows[-self._keep :].copy()
            self._first, self._end = 0, len(kept)
            self._rows[: len(kept)] = kept
            if self._end + len(rows) > len(self._rows):
                raise AssertionError("more rows than the space for them")
        self._rows[self._end : self._end + len(rows)] = rows
        self._end += len(rows)
        self._first = max(self._first, self._end - self._keep)

    def clear(self) -> None:
        """Forget all rows."""
        self._first = self._end = 0

    def between(self, after: float, until: float, most: int) -> NDArray[np.void]:
        """A copy of the rows with after < time <= until: the last `most` of them."""
        times = self.rows["time"]
        low, high = np.searchsorted(times, [after, until], side="right")
        return self.rows[max(low, high - most) : high].copy()

    def last(self, until: float) -> np.void | None:
        """The newest row with time <= until; None where there is none."""
        place = int(np.searchsorted(self.rows["time"], until, side="right"))
        return self.rows[place - 1].copy() if place else None

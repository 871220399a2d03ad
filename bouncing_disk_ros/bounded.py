"""Histories that stay within a size: the newest of what comes, or every so many of it."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T")
_FIRST = 1024
"""Rows for which there is space at first."""


class Downsampled(list[T]):
    """A list that keeps every first, second, fourth ... of what is appended, at most `most`."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self.step, self._most, self._seen = 1, most, 0

    def append(self, item: T) -> None:
        """Take one more, or leave it out."""
        if self._seen % self.step == 0:
            super().append(item)
            if len(self) >= self._most:
                del self[1::2]
                self.step *= 2
        self._seen += 1


class Newest(list[T]):
    """A list that keeps the newest of what is appended, at most twice `most`."""

    def __init__(self, most: int) -> None:
        super().__init__()
        self.dropped, self._most = 0, most

    def append(self, item: T) -> None:
        """Take one more; now and then the older half is dropped."""
        super().append(item)
        if len(self) >= 2 * self._most:
            self.dropped += self._most
            del self[: self._most]


class NewestRows:
    """A table of the newest `most` rows of one dtype with a field `time`.

    Its space grows with it, to twice as many rows: appending costs the same however many are held.
    `between` and `last` are for times that do not fall.
    """

    def __init__(self, dtype: Any, most: int) -> None:
        self._dtype = np.dtype(dtype)
        self._raw = np.dtype((np.void, self._dtype.itemsize))  # copied at once, with its padding
        self._rows = np.zeros(min(2 * most, _FIRST), self._raw)
        self._most, self._first, self._end = most, 0, 0
        self.dropped = 0  # rows that are no longer held

    def __len__(self) -> int:
        return self._end - self._first

    @property
    def rows(self) -> NDArray[np.void]:
        """All rows held, a view to read: copy what is changed, or stays while more are appended."""
        found = self._rows[self._first : self._end].view(self._dtype)
        found.flags.writeable = False
        return found

    def append(self, rows: NDArray[np.void]) -> None:
        """Add rows at the end; the oldest fall out."""
        held = len(self) + len(rows)
        rows = np.ascontiguousarray(rows[max(0, len(rows) - self._most) :], self._dtype)
        if self._end + len(rows) > len(self._rows):
            self._compact(len(rows))
        self._rows[self._end : self._end + len(rows)] = rows.view(self._raw)
        self._end += len(rows)
        self._first = max(self._first, self._end - self._most)
        self.dropped += held - len(self)

    def _compact(self, count: int) -> None:
        """Move the rows that stay to the start of the array, or of a larger one if need be."""
        first = max(self._first, self._end + count - self._most)
        kept = self._rows[first : self._end]
        if 2 * (len(kept) + count) > len(self._rows):
            size = min(2 * self._most, 4 * (len(kept) + count))
            self._rows = np.zeros(size, self._raw)
        self._rows[: len(kept)] = kept
        self._first, self._end = 0, len(kept)

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

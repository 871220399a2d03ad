"""What is kept of a run that may be longer than memory: the newest, or every so many."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import join_rows

T = TypeVar("T")
_JOIN, _JOIN_ROWS = 4096, 65536
"""So many small arrays of impacts, or arrays with so many rows, are joined into one."""


class EveryNth(list[T]):
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


class Bounded:
    """Keeps the last rows only, of the times wished for, in few arrays."""

    def __init__(self, chunks: list[NDArray[np.void]], begin: float, end: float, most: int) -> None:
        self.dropped = 0
        self.seen: list[float] = []  # first and last time of an impact, wished for or not
        self._chunks, self._times, self._most = chunks, (begin, end), most
        self._held = self._fresh_rows = self._fresh = 0

    def tidy(self) -> None:
        """After an array has been appended (or none, where a message was empty)."""
        chunks, (begin, end) = self._chunks, self._times
        if not chunks:
            return
        rows = chunks[-1]
        if len(rows):  # else nothing new: an empty message
            first = self.seen[0] if self.seen else float(rows["time"][0])
            self.seen = [first, float(rows["time"][-1])]
        inside = (rows["time"] >= begin) & (rows["time"] < end)
        if not np.all(inside):
            chunks[-1] = rows = rows[inside]
        self._held += len(rows)
        self._fresh_rows += len(rows)
        self._fresh += 1
        if self._fresh >= _JOIN or self._fresh_rows >= _JOIN_ROWS:
            chunks[-self._fresh :] = [join_rows(chunks[-self._fresh :])]
            self._fresh = self._fresh_rows = 0
            while self._held - len(chunks[0]) >= self._most:
                self._held -= len(chunks[0])
                self.dropped += len(chunks.pop(0))

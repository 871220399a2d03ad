"""A record of several runs, one after the other, split into its runs.

A simulator that was started again, or configured anew, begins with record 0 and row 0. Records and
rows come on two topics, in no order among each other; the times of sending show which belong
together.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.recorded_rows import checked_rows

Rows = NDArray[np.void]
REMEMBERED = 1000
"""So many records a latched topic delivers a second time to who subscribes anew."""


class Run(NamedTuple):
    """One run; both iterators are to be used before the next run is asked for."""

    records: Iterator[Record]
    rows: Iterator[Rows]


class Runs:
    """Iterates over the runs; `left_over` are rows that in the end belong to none."""

    def __init__(
        self, records: Iterable[tuple[int, Record]], rows: Iterable[tuple[int, Rows]]
    ) -> None:
        """Records and batches of rows, each with the time in ns at which it was sent.

        Iterating raises InputError at rows of another layout.
        """
        self.left_over = 0
        self._records = _unrepeated(records)
        self._rows = ((sent, checked_rows(batch)) for sent, batch in rows)
        self._record = next(self._records, None)
        self._batch = next(self._rows, None)
        self._end: int | None = None  # when the next run's first record was sent

    def __iter__(self) -> Iterator[Run]:
        """Give the runs, in the order of the record."""
        while self._record is not None:
            self._end = None
            run = Run(self._run_records(), self._run_rows())
            yield run
            for _ in run.records:  # what was not used
                pass
            for _ in run.rows:
                pass
        while self._batch is not None:
            self.left_over += len(self._batch[1])
            self._batch = next(self._rows, None)

    def _run_records(self) -> Iterator[Record]:
        while self._record is not None and self._end is None:
            _, record = self._record
            self._record = next(self._records, None)
            if self._record is not None and _begins_again(record, self._record[1]):
                self._end = self._record[0]
            yield record

    def _run_rows(self) -> Iterator[Rows]:
        last: tuple[float, float] = (-1.0, -1.0)
        while self._batch is not None:
            sent, rows = self._batch
            if self._end is not None and sent >= self._end:
                return
            if len(rows):
                if rows["index"][0] <= last[0] and rows["time"][0] < last[1]:
                    return
                last = (float(rows["index"][-1]), float(rows["time"][-1]))
            self._batch = next(self._rows, None)
            yield rows


def _begins_again(record: Record, following: Record) -> bool:
    falls = following["index"] <= record["index"] or following["time_ns"] < record["time_ns"]
    return bool(falls)


def _unrepeated(records: Iterable[tuple[int, Record]]) -> Iterator[tuple[int, Record]]:
    """Without those that a latched topic delivered again: of the same index, sent at that time."""
    seen: OrderedDict[tuple[int, int], None] = OrderedDict()
    for sent, record in records:
        key = (sent, int(record["index"]))
        if key in seen:
            continue
        seen[key] = None
        if len(seen) > REMEMBERED:
            seen.popitem(last=False)
        yield sent, record

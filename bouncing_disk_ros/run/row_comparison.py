"""Recorded rows of impacts compared with replayed ones as these come, to the bit."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import IMPACT_DTYPE, ImpactKind
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.time_map import FAR_NS
from bouncing_disk_ros.topics import IMPACT_REQUIRED
from bouncing_disk_ros.units import NS

Rows = NDArray[np.void]
_NAMES = IMPACT_DTYPE.names or ()
FIELDS = tuple(sorted(_NAMES, key=lambda name: name in ("x", "y", "z")))
"""Fields in the order in which a difference is named: what x, y, z are made of comes first."""
CUT_SECONDS = 10.0
"""A row of impacts cut off from a chatter is written at the next impact or input, not at its own
time; a replay that has no input left waits for it this long, in simulated time."""


class Difference(NamedTuple):
    """Where a replay first differs from the record."""

    where: str  # "row 17", "snapshot (record 12)"
    time: float  # simulated time of the recorded row or state, s
    field: str
    recorded: object
    replayed: object  # None: the replay has no such row
    others: int = 0  # further fields of the row that differ

    def __str__(self) -> str:
        more = f" (and {self.others} more fields)" if self.others else ""
        replayed = "nothing" if self.replayed is None else repr(self.replayed)
        return (
            f"{self.where} at t = {self.time:.9f} s: {self.field}{more}: "
            f"recorded {self.recorded!r}, replayed {replayed}"
        )


class RowCount(Protocol):
    """Where the comparison counts (see `replay.Replay`)."""

    impacts: int
    rows: int
    missing: int
    not_compared: int
    first_row: int | None
    other_fields: tuple[str, ...]
    difference: Difference | None


def row_difference(recorded: Rows, replayed: Rows) -> tuple[int, Difference] | None:
    """Where two arrays of equal length first differ, every field compared as bytes; its place."""
    if recorded.tobytes() == replayed.tobytes():
        return None
    common = [name for name in FIELDS if name not in other_fields(recorded)]
    unequal = [np.not_equal(_bytes(recorded, name), _bytes(replayed, name)) for name in common]
    differs: NDArray[np.bool_] = np.any(np.stack(unequal), axis=2)  # by field and row
    if not differs.any():  # padding only
        return None
    place = int(np.argmax(differs.any(axis=0)))
    name, *others = [name for name, one in zip(common, differs[:, place], strict=True) if one]
    old, new = recorded[place], replayed[place]
    where, time = f"row {int(new['index'])}", float(old["time"])
    return place, Difference(where, time, name, old[name].item(), new[name].item(), len(others))


def _bytes(rows: Rows, name: str) -> NDArray[np.uint8]:
    """The bytes of one field, (rows, 8); shorter fields are filled up with zeros."""
    column = np.ascontiguousarray(rows[name])
    width = column.dtype.itemsize
    padded = np.zeros((len(rows), 8), np.uint8)
    padded[:, :width] = column.view(np.uint8).reshape(len(rows), width)
    return padded


def end_ns(rows: Rows) -> int:
    """The instant, rounded up, by which a replay must have all of these rows."""
    time = float(rows["time"][-1])
    if not abs(time) < FAR_NS / NS:  # also nan: no replay has such a row
        return 0
    if rows["kind"][-1] == ImpactKind.CHATTER_CUT:
        time += CUT_SECONDS
    return min(math.ceil(math.nextafter(time, math.inf) * NS) + 1, FAR_NS)


def other_fields(rows: Rows) -> tuple[str, ...]:
    """Fields that these rows lack, or IMPACT_DTYPE does: of another version of the package."""
    if rows.dtype == IMPACT_DTYPE:
        return ()
    # by their texts: to numpy, None is a dtype equal to float64
    theirs = {name: rows.dtype[name].str for name in rows.dtype.names or ()}
    ours = {name: IMPACT_DTYPE[name].str for name in _NAMES}
    return tuple(name for name in {**ours, **theirs} if theirs.get(name) != ours.get(name))


def checked_rows(rows: Rows) -> Rows:
    """The same rows; InputError when they lack a field that comparing needs."""
    if missing := {*IMPACT_REQUIRED} & {*other_fields(rows)}:
        given = ", ".join(rows.dtype.names or ())
        allowed = f"rows of IMPACT_DTYPE with {', '.join(sorted(missing))}"
        raise InputError("rows of impacts", given, allowed)
    return rows


class RecordedRows:
    """Compares what is there with replayed rows; counts, and the first difference, in `tally`."""

    def __init__(self, batches: Iterable[Rows], tally: RowCount) -> None:
        """`batches`: arrays of IMPACT_DTYPE in the order of their index, as they were published."""
        self._batches = iter(batches)
        self._tally = tally
        self._batch: Rows | None = None
        self._begin = 0  # first index that can be compared

    def begin(self, index: int) -> None:
        """The replay begins, or begins again, with the row of this index."""
        self._begin = index

    def current(self) -> Rows | None:
        """What is left of the oldest batch that has not been compared; None: no more rows."""
        while self._batch is None or not len(self._batch):
            self._batch = next(self._batches, None)
            if self._batch is None:
                break
            checked_rows(self._batch)
            self._tally.other_fields = other_fields(self._batch) or self._tally.other_fields
        return self._batch

    def skip(self, count: int) -> None:
        """Leave rows of the current batch uncompared."""
        self._tally.not_compared += count
        self._drop(count)

    def skip_earlier(self) -> None:
        """Leave uncompared what is earlier than the replay begins."""
        while (rows := self.current()) is not None and _index(rows) < self._begin:
            self.skip(min(len(rows), self._begin - _index(rows)))

    def _drop(self, count: int) -> None:
        assert self._batch is not None
        self._batch = self._batch[count:]

    def compare(self, replayed: Rows) -> None:
        """Compare the next replayed rows with those of the same index."""
        while len(replayed) and self._tally.difference is None:
            self.skip_earlier()
            recorded = self.current()
            if recorded is None:
                return
            here, there = int(replayed["index"][0]), _index(recorded)
            if there < here or (there > here and recorded["time"][0] < replayed["time"][0]):
                time = float(recorded["time"][0])
                self._tally.difference = Difference(f"row {here}", time, "index", there, here)
            elif there > here:
                lacking = min(len(replayed), there - here)
                self._tally.missing += lacking if self._tally.first_row is not None else 0
                replayed = replayed[lacking:]
            else:
                replayed = replayed[self._take(recorded, replayed) :]

    def _take(self, recorded: Rows, replayed: Rows) -> int:
        """Compare rows from the same index on; how many."""
        count = min(len(recorded), len(replayed))
        some = recorded[:count]
        tally = self._tally
        if tally.first_row is None:
            tally.first_row = _index(recorded)
        found = row_difference(some, replayed[:count])
        if found is not None:
            count, tally.difference = found
            some = some[:count]
        tally.rows += count
        tally.impacts += int(some["count"].sum(dtype=np.int64))
        self._drop(count)
        return max(count, 1)

    def unmatched(self, rows_total: int) -> Difference:
        """The difference of a recorded row that the replay, with so many rows, lacks."""
        row = self._batch[0] if self._batch is not None else None
        assert row is not None
        index = float(row["index"])
        replayed = rows_total if index < rows_total else None
        return Difference(f"row {index:.0f}", float(row["time"]), "index", index, replayed)


def _index(rows: Rows) -> int:
    """Index of the first row; one that is no index at all counts as beyond all."""
    index = float(rows["index"][0])
    return int(index) if 0.0 <= index < FAR_NS else FAR_NS


def last_index(rows: Rows) -> int:
    """Index of the last row."""
    return _index(rows[-1:])

"""Replay: the impacts of a run from its record of inputs, compared bit by bit with those recorded.

Pure: records and rows come as iterables (of a bag, a list, a live topic), and memory holds no more
than a slice of either.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import bouncing_disk_ros
from bouncing_disk_ros.core.model import IMPACT_DTYPE, ImpactKind
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.input_replay import (
    Gap,
    Step,
    Watch,
    advance_slice,
    apply,
    restored,
    steps,
)
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


# --- rows -----------------------------------------------------------------------------------------
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


def comparable_rows(rows: Rows) -> Rows:
    """The same rows; InputError when they lack a field that comparing needs."""
    if missing := {*IMPACT_REQUIRED} & {*other_fields(rows)}:
        given = ", ".join(rows.dtype.names or ())
        allowed = f"rows of IMPACT_DTYPE with {', '.join(sorted(missing))}"
        raise InputError("rows of impacts", given, allowed)
    return rows


# --- what a replay finds --------------------------------------------------------------------------
@dataclass
class Replay:
    """What a replay of one run found; `identical`: all was compared, and nothing differs."""

    impacts: int = 0  # compared and equal; those counted in one row are counted here
    rows: int = 0  # compared and equal
    missing: int = 0  # rows replayed between those recorded, which the record lacks
    not_compared: int = 0  # rows recorded before the first snapshot, or after a lost record
    records: int = 0
    snapshots: int = 0  # of the state in mid-run, replayed and found equal
    first_row: int | None = None  # index of the first row compared
    start_ns: int | None = None  # simulated time of the first snapshot; None: there is none
    end_ns: int = 0  # simulated time replayed to
    version: str = ""  # of the package that recorded
    other_fields: tuple[str, ...] = ()  # of rows, that only the record or only this version has
    gaps: list[Gap] = field(default_factory=list)
    difference: Difference | None = None

    @property
    def identical(self) -> bool:
        """Whether all fields of the rows were compared, and nothing differs."""
        return self.difference is None and not self.other_fields

    @property
    def is_other_build(self) -> bool:
        """Whether another version of the package recorded: it may differ, the physics does not."""
        return self.version not in ("", bouncing_disk_ros.__version__)


class RecordedRows:
    """Compares what is there with replayed rows; counts, and the first difference, in `tally`."""

    def __init__(self, batches: Iterable[Rows], tally: Replay) -> None:
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
            comparable_rows(self._batch)
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


# --- the replay -----------------------------------------------------------------------------------
def replay(
    records: Iterable[Record],
    rows: Iterable[NDArray[np.void]] = (),
    watch: Watch | None = None,
    until_ns: int = 0,
) -> Replay:
    """Replay one run from its records and compare with its rows, up to the first difference.

    `records`: those of disk/inputs in the order of their index; the replay begins at the first
    snapshot among them. `rows`: arrays of IMPACT_DTYPE as they were published, in the order of
    their index. Missing rows are counted; after missing records the replay goes on at the next
    snapshot. It ends at the newest of both, or at `until_ns`, which the run has reached. Snapshots
    in mid-run are compared too.

    Raises InputError for records or rows that cannot be of one run of this package.
    """
    run = _Run(rows, watch or (lambda _: None))
    for step in steps(records):
        run.take(step)
        if run.found.difference is not None:
            return run.found
    run.finish(until_ns)
    return run.found


class _Run:
    """The replay of one run, record by record."""

    def __init__(self, rows: Iterable[NDArray[np.void]], watch: Watch) -> None:
        self.found = Replay()
        self._recorded = RecordedRows(rows, self.found)
        self._watch = watch
        self._simulation: Simulation | None = None

    def take(self, step: Step) -> None:
        """Replay up to a record, and apply it; ends early at a difference."""
        record, self._simulation, is_start, gap = step
        if gap is not None:
            self.found.gaps.append(gap)
        if self._simulation is not None and is_start:
            self._start(self._simulation, record)
        elif self._simulation is not None:
            self._advance(self._simulation, record["time_ns"])
            if self.found.difference is None and record["kind"] == "snapshot":
                self._compare_state(self._simulation, record)
            if self.found.difference is None:
                apply(self._simulation, record)
        self.found.records += 1

    def finish(self, until_ns: int) -> None:
        """Replay up to the newest recorded row, and to an instant (where it lies behind)."""
        self._recorded.skip_earlier()
        while (rows := self._recorded.current()) is not None and self.found.difference is None:
            if self._simulation is None:
                self._recorded.skip(len(rows))
                continue
            self._advance(self._simulation, end_ns(rows), until_row=last_index(rows))
            if self._recorded.current() is rows and self.found.difference is None:
                self.found.difference = self._recorded.unmatched(self._simulation.rows_total)
        if self._simulation is not None and self.found.difference is None:
            self._advance(self._simulation, until_ns)

    def _start(self, simulation: Simulation, record: Record) -> None:
        """Begin, or begin again, at a snapshot."""
        if self.found.start_ns is None:
            self.found.start_ns = simulation.time_ns
            self.found.version = str(record.get("version", ""))
        elif self.found.gaps:
            self.found.gaps[-1] = self.found.gaps[-1]._replace(until_ns=simulation.time_ns)
        self.found.end_ns = simulation.time_ns
        unreported = record["state"]["held"]  # so named in snapshots
        self._recorded.begin(int(unreported[0]["index"]) if unreported else simulation.rows_total)

    def _advance(self, simulation: Simulation, until_ns: int, until_row: int | None = None) -> None:
        """Replay up to an instant (or until a row is there) and compare."""
        behind = True
        while behind and self.found.difference is None:
            rows, behind = advance_slice(simulation, until_ns)
            self._recorded.compare(rows)
            self.found.end_ns = max(self.found.end_ns, simulation.time_ns)
            self._watch(simulation.time_ns)
            if until_row is not None and simulation.rows_total > until_row:
                break

    def _compare_state(self, simulation: Simulation, record: Record) -> None:
        differing = state_difference(restored(record), simulation)
        if differing is None:
            self.found.snapshots += 1
        else:
            where = f"snapshot (record {record['index']})"
            self.found.difference = Difference(where, simulation.time_ns / NS, *differing)


def state_difference(
    recorded: Simulation, replayed: Simulation
) -> tuple[str, object, object] | None:
    """The first (name, recorded, replayed) in which two states differ; None when they are equal.

    A snapshot taken between two slices of work may have resolved an event of the nanosecond that
    comes next, so copies of both are looked at one nanosecond later. Changes neither.
    """
    copies = [Simulation.restore(run.snapshot()) for run in (recorded, replayed)]
    for copy in copies:
        while advance_slice(copy, replayed.time_ns + 1)[1]:
            pass
    for (name, first), (_, second) in zip(*(state_values(copy) for copy in copies), strict=True):
        if repr(first) != repr(second):  # distinguishes −0.0 from 0.0, unlike ==
            return name, first, second
    return None


def state_values(run: Simulation) -> Iterator[tuple[str, Any]]:
    """All that the future of a run depends on, by name."""
    yield from run.sample()._asdict().items()
    yield "next row", run.rows_total
    yield "pending motions", run.pending
    yield "motion in force", run.motion_in_force
    yield from run.disk._asdict().items()
    yield "chatter_report_speed", run.chatter_report_speed
    snapshot = run.snapshot()
    yield "kicks", snapshot["kicks"]
    yield "initial", snapshot["initial"]

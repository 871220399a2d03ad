"""Replay: the impacts of a run from its record of inputs, compared bit by bit with those recorded.

Pure: records and rows come as iterables (of a bag, a list, a live topic), and memory holds no more
than a slice of either.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import bouncing_disk_ros
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.input_replay import advance_slice, apply, restored
from bouncing_disk_ros.run.row_comparison import Difference, RecordedRows, end_ns, last_index
from bouncing_disk_ros.units import NS

Watch = Callable[[int], object]
"""Called with the simulated time reached, in ns; may raise to end a replay."""


class Gap(NamedTuple):
    """Records that are missing: from there on nothing is known up to the next snapshot."""

    first: int  # index of the first missing record
    last: int  # of the last
    from_ns: int  # simulated time of the last record before
    until_ns: int | None  # of the snapshot from which the replay goes on; None: there is none


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
    for record in records:
        run.take(record)
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
        self._index: int | None = None  # of the newest record
        self._time_ns = 0  # of the newest record

    def take(self, record: Record) -> None:
        """Replay up to a record, and apply it; ends early at a difference."""
        self._check_order(record)
        is_snapshot = record["kind"] == "snapshot"
        simulation = self._simulation
        if simulation is not None:
            self._advance(simulation, record["time_ns"])
            if self.found.difference is None and is_snapshot:
                self._compare_state(simulation, record)
            if self.found.difference is None:
                apply(simulation, record)
        elif is_snapshot:
            self._start(record)
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

    def _check_order(self, record: Record) -> None:
        """Leave the run at a gap of the index; refuse a record that is out of order."""
        index, time_ns = int(record["index"]), int(record["time_ns"])
        if self._index is not None:
            if index <= self._index or time_ns < self._time_ns:
                given = f"index {index} at {time_ns} ns after {self._index} at {self._time_ns} ns"
                hint = "Replay each run on its own."
                raise InputError("input records", given, "rising index and time", hint)
            if index > self._index + 1:
                self.found.gaps.append(Gap(self._index + 1, index - 1, self._time_ns, None))
                self._simulation = None
        self._index, self._time_ns = index, time_ns

    def _start(self, record: Record) -> None:
        """Begin, or begin again, at a snapshot."""
        self._simulation = simulation = restored(record)
        if self.found.start_ns is None:
            self.found.start_ns = simulation.time_ns
            self.found.version = str(record.get("version", ""))
        elif self.found.gaps:
            self.found.gaps[-1] = self.found.gaps[-1]._replace(until_ns=simulation.time_ns)
        self.found.end_ns = simulation.time_ns
        held = record["state"]["held"]
        self._recorded.begin(int(held[0]["index"]) if held else simulation.rows_total)

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

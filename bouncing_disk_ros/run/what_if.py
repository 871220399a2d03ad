"""A what-if: a run beside the same run with changes, and the first instant at which they differ.

First `Pair`, two simulations side by side and what is kept of both; then `what_if`, which replays a
record in one of them and with changes in the other.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.bounded import NewestRows
from bouncing_disk_ros.core.model import (
    IMPACT_DTYPE,
    SAMPLE_DTYPE,
    Disk,
    InitialState,
    Motion,
    Sample,
    join_rows,
)
from bouncing_disk_ros.core.schedule import crossfade_duration_ns
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.input_replay import advance_to, apply, restored, steps
from bouncing_disk_ros.run.replay import Difference, row_difference
from bouncing_disk_ros.run.time_map import nanoseconds
from bouncing_disk_ros.units import NS

Rows = NDArray[np.void]
KEPT_ROWS = 20_000
"""Newest rows of each run that are kept."""
SAMPLES = 2000
"""Samples of each run, evenly over its whole time."""
DETAIL_PERIODS = 8
DETAIL_STEPS = 40
"""After the two part: samples over so many periods of the platform, so many in each."""
SPEED_SECONDS = 2.0
"""The rotor speed is the mean over this long at the end."""


class Trace(NamedTuple):
    """What is kept of one run."""

    impacts: int  # single ones, those counted in a row included
    rows: Rows  # the newest KEPT_ROWS, IMPACT_DTYPE
    samples: NDArray[np.void]  # SAMPLE_DTYPE, evenly over the run
    detail: NDArray[np.void]  # SAMPLE_DTYPE, finer where the two part
    rotor_speed: float  # mean over the last SPEED_SECONDS, rad/s; nan: no time has passed
    steady_since: float  # s; inf: the platform's motion is changing

    @property
    def steady_rows(self) -> Rows:
        """The rows since the platform's motion is steady."""
        return self.rows[self.rows["time"] >= self.steady_since]


class TwoRuns(NamedTuple):
    """Two runs from the same inputs."""

    first: Trace
    second: Trace
    start_ns: int
    end_ns: int
    divergence_time_ns: int | None  # simulated, of the first row that differs; None: there is none
    divergence: Difference | None  # "recorded" is the first run, "replayed" the second


class _Track:
    """Gathers what is kept of one simulation."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.impacts = 0
        self.samples: list[Sample] = []
        self.detail: list[Sample] = []
        self._rows = NewestRows(IMPACT_DTYPE, KEPT_ROWS)
        self.speed_from = simulation.sample()

    def keep(self, rows: Rows) -> None:
        """Take the next rows; forget the oldest."""
        self.impacts += int(rows["count"].sum(dtype=np.int64))
        self._rows.append(rows)

    def trace(self) -> Trace:
        motion, end = self.simulation.motion_in_force, self.simulation.sample()
        begin, steady = self.speed_from, motion.begin_ns == motion.end_ns
        return Trace(
            self.impacts,
            self._rows.rows,
            np.array([tuple(sample) for sample in self.samples], SAMPLE_DTYPE),
            np.array([tuple(sample) for sample in self.detail], SAMPLE_DTYPE),
            begin.mean_speeds(end)[1] if end.time_ns > begin.time_ns else math.nan,
            motion.begin_ns / NS if steady else math.inf,
        )


class Pair:
    """Drives two simulations that stand at the same instant; the caller applies the inputs."""

    def __init__(self, first: Simulation, second: Simulation, end_ns: int) -> None:
        """They will go to end_ns."""
        self.first, self.second = first, second
        self.start_ns = self.time_ns = first.time_ns
        self._tracks = (_Track(first), _Track(second))
        self._step = max(1, (end_ns - self.start_ns) // SAMPLES)
        self._next = self.start_ns
        self._close_next = self._close_end = self._close_step = 0
        self._speed_ns = end_ns - nanoseconds(SPEED_SECONDS)
        self._parted_ns: int | None = None
        self._parting: Difference | None = None
        self._go(self.start_ns)  # what is due at the very start

    def advance(self, until_ns: int) -> None:
        """Bring both to an instant."""
        while self.time_ns < until_ns:
            ahead = (self._next, self._speed_ns, self._close_next)
            self._go(min((until_ns, *(at for at in ahead if at > self.time_ns))))

    def _go(self, goal: int) -> None:
        """Bring both to an instant with no sample due before it."""
        before = [] if self._parting else [run.snapshot() for run in (self.first, self.second)]
        rows = [join_rows(advance_to(run, goal)) for run in (self.first, self.second)]
        for track, some in zip(self._tracks, rows, strict=True):
            track.keep(some)
        if self._parting is None:
            self._compare(*rows)
            if self._parted_ns is not None:
                self._look_closely(before, goal)
        self.time_ns = goal
        self._sample()

    def _sample(self) -> None:
        """Take the samples that are due."""
        now = self.time_ns
        for track in self._tracks:
            if now == self._next:
                track.samples.append(track.simulation.sample())
            if now == self._close_next and self._parting:
                track.detail.append(track.simulation.sample())
            if now == self._speed_ns:
                track.speed_from = track.simulation.sample()
        if now == self._next:
            self._next += self._step
        if now == self._close_next:
            ahead = now + self._close_step
            self._close_next = ahead if ahead <= self._close_end else 0

    def restart_speed(self) -> None:
        """Begin the mean speed anew: a reset is not rotation."""
        for track in self._tracks:
            if self.time_ns >= track.speed_from.time_ns:
                track.speed_from = track.simulation.sample()

    # --- where they part --------------------------------------------------------------------------
    def _compare(self, first: Rows, second: Rows) -> None:
        """Rows of the same interval: the same in both, until they part."""
        count = min(len(first), len(second))
        found = row_difference(first[:count], second[:count])
        if found is not None:
            place, self._parting = found
            times = float(first["time"][place]), float(second["time"][place])
        elif len(first) != len(second):
            row = (first if len(first) > count else second)[count]
            index = float(row["index"])
            values: tuple[Any, Any] = (index, None) if len(first) > count else (None, index)
            times = float(row["time"]), math.inf
            self._parting = Difference(f"row {index:.0f}", times[0], "index", *values)
        else:
            return
        self._parted_ns = nanoseconds(min(times))

    def _look_closely(self, before: list[dict[str, Any]], now_ns: int) -> None:
        """Take finer samples from the parting on; what has passed of it is simulated again."""
        assert self._parted_ns is not None
        period = NS / self.first.motion_in_force.target.frequency
        self._close_step = max(1, round(period / DETAIL_STEPS))
        self._close_end = self._parted_ns + round(DETAIL_PERIODS * period)
        at = self._close_next = max(self.time_ns, self._parted_ns - round(period))
        for track, state in zip(self._tracks, before, strict=True):
            run, at = Simulation.restore(state), self._close_next
            while at < min(now_ns, self._close_end):
                advance_to(run, at)
                track.detail.append(run.sample())
                at += self._close_step
        self._close_next = at if at <= self._close_end else 0

    def result(self) -> TwoRuns:
        """What has been gathered."""
        first, second = (track.trace() for track in self._tracks)
        return TwoRuns(first, second, self.start_ns, self.time_ns, self._parted_ns, self._parting)


# ------------------------------------------------------------------------------------------------
# What if the disk or the motion had been another? A run and a changed one, from one record.
#
# Both are simulated side by side from the first snapshot; every input comes at its recorded
# instant.


CHANGEABLE = (*Disk._fields, *Motion._fields)
"""What can be changed: parameters of disk and contact, and values of the platform's motion."""


class Changes(NamedTuple):
    """Values that hold for the whole changed run, whatever the record says."""

    disk: Mapping[str, float]
    motion: Mapping[str, float]

    @property
    def label(self) -> str:
        """As it would be typed: restitution:=0.4."""
        return " ".join(
            f"{name}:={value:g}" for name, value in {**self.disk, **self.motion}.items()
        )

    def of_disk(self, disk: Disk) -> Disk:
        """A disk with the changed values."""
        return disk._replace(**self.disk)

    def of_motion(self, motion: Motion) -> Motion:
        """A motion with the changed values."""
        return motion._replace(**self.motion)

    def of_record(self, record: Record) -> Record:
        """A record with the changed values wherever it sets them."""
        match record["kind"]:
            case "motion":
                points = [(at, list(self.of_motion(Motion(*v)))) for at, v in record["points"]]
                return {**record, "points": points}
            case "parameters":
                disk = self.of_disk(Disk(**record["disk"]))._asdict()
                _check(disk)
                return {**record, "disk": disk}
            case "reset":
                motion = self.of_motion(Motion(**record["motion"]))
                return {**record, "motion": motion._asdict()}
            case _:
                return record


def changes_of(values: Mapping[str, object]) -> Changes:
    """Checked changes by name; InputError: no such parameter, or not allowed."""
    for name in values:
        if name not in CHANGEABLE:
            raise InputError("what-if", name, ", ".join(CHANGEABLE), closest(name, CHANGEABLE))
    known = {name: float(value) for name, value in parameters.checked(values).items()}
    if "phase_lag" in known:
        known["phase_lag"] = math.remainder(known["phase_lag"], math.tau)
    return Changes(
        {name: value for name, value in known.items() if name in Disk._fields},
        {name: value for name, value in known.items() if name in Motion._fields},
    )


def _check(disk: Mapping[str, float]) -> None:
    parameters.check_together({**parameters.DEFAULTS, **disk})


def changed_start(record: Record, changes: Changes) -> Simulation:
    """The simulation of a snapshot with the changes.

    At the very start of a run they hold from there on; in mid-run the disk changes at once and the
    platform by a cross-fade: of one period, or as long as those that are pending. Values that are
    in force already change nothing.
    """
    run = restored(record)
    disk = changes.of_disk(run.disk)
    _check(disk._asdict())
    if record["index"] == 0 and run.time_ns == 0:
        state = record["state"]
        motion = changes.of_motion(Motion(*state["initial_motion"]))
        initial = InitialState(*state["initial"])
        return Simulation(motion, disk, initial, chatter_report_speed=run.chatter_report_speed)
    if disk != run.disk:
        run.set_disk(disk)
    now, *later = (run.motion_in_force.target, *(fade.target for fade in run.pending))
    if any(changes.of_motion(one) != one for one in (now, *later)):
        points = [(fade.end_ns, changes.of_motion(fade.target)) for fade in run.pending]
        if changes.of_motion(now) != now:
            points.insert(0, (run.time_ns + 1, changes.of_motion(now)))
        run.command(points, _crossfade_ns(run))
    return run


def _crossfade_ns(run: Simulation) -> int:
    """The duration that the pending cross-fades were given, ns; 0: none, each has its default."""
    start = run.motion_in_force.target
    for fade in run.pending:
        if fade.end_ns - fade.begin_ns != crossfade_duration_ns(start, fade.target):
            return fade.end_ns - fade.begin_ns
        start = fade.target
    return 0


def what_if(records: Iterable[Record], changes: Changes, until_ns: int) -> TwoRuns:
    """A run from its records, and the same with changes, up to an instant of simulated time.

    `records`: those of one run; it begins at the first snapshot, and ends early where a record is
    missing: what was lost is not known. Raises InputError without a snapshot, and for changes
    that are not allowed together.
    """
    pair: Pair | None = None
    for record, simulation, _, gap in steps(records):
        if pair is None:
            if simulation is not None:
                pair = Pair(simulation, changed_start(record, changes), until_ns)
        elif gap is not None:
            until_ns = pair.time_ns
            break
        else:
            pair.advance(min(record["time_ns"], until_ns))
            if record["time_ns"] > until_ns:
                break
            apply(pair.first, record)
            apply(pair.second, changes.of_record(record))
            if record["kind"] == "reset":
                pair.restart_speed()
    if pair is None:
        raise InputError("input records", "no snapshot", "records with at least one snapshot")
    pair.advance(until_ns)
    return pair.result()

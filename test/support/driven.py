"""Seeded runs of a session, as a recorder would hear them; runs again from a record of inputs."""

from __future__ import annotations

import random
from collections.abc import Iterable
from itertools import dropwhile
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Motion, join_rows
from bouncing_disk_ros.core.offset import DEGREES, Knot, OffsetState
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.run import input_records as records_of
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.input_replay import advance_to, apply, restored
from bouncing_disk_ros.run.session import Session
from bouncing_disk_ros.run.trajectory_validation import Splice
from bouncing_disk_ros.units import NS


def replayed(records: Iterable[Record], until_ns: int = 0) -> tuple[NDArray[np.void], Simulation]:
    """Rows of IMPACT_DTYPE from the first snapshot on, and the simulation at the end."""
    first, *others = dropwhile(lambda record: record["kind"] != "snapshot", records)
    simulation, rows = restored(first), []
    for record in others:
        rows += advance_to(simulation, record["time_ns"])
        apply(simulation, record)
    rows += advance_to(simulation, until_ns)
    return join_rows(rows), simulation


Rows = NDArray[np.void]


def wild_input(session: Session, rng: random.Random) -> None:
    """One input of any kind."""
    match rng.randrange(7):
        case 0 | 1:
            first = session.input_ns + rng.randrange(2 * 10**8)
            target = Motion(rng.uniform(0, 0.06), rng.uniform(0, 1), rng.uniform(2, 6), 0.3)
            session.command([(first, target), (first + 10**8, target._replace(phase_lag=-1.0))])
        case 2:
            later = session.input_ns + rng.choice([0, rng.randrange(10**9)])
            session.apply_impulse(later, rng.uniform(-0.1, 0.1), rng.uniform(-0.01, 0.01))
        case 3:
            session.set_parameters({"restitution": rng.uniform(0.0, 0.9)})
        case 4:
            session.set_parameters({"preload": rng.uniform(-0.5, 2.0), "load_torque": 0.001})
            session.set_parameters({"chatter_report_speed": rng.choice([0.0, 1e-3, 0.3])})
        case 5:
            session.set_paused(not session.paused)
        case 6:
            session.reset() if rng.random() < 0.3 else session.snapshot()


def wild_splice(session: Session, rng: random.Random) -> Splice:
    """An offset trajectory of one joint or both, now or later; now and then a cancellation."""
    begin = session.input_ns + rng.choice([0, rng.randrange(10**9)])
    lanes: list[tuple[Knot, ...] | None] = []
    for scale in (0.02, 0.3):
        at, knots = begin, []
        for _ in range(rng.randrange(4)):
            at += rng.randrange(10**7, 3 * 10**8)
            state = OffsetState(rng.gauss(0, scale), rng.gauss(0, scale))
            knots.append(Knot(at, state, rng.choice(DEGREES)))
        lanes.append(None if rng.random() < 0.3 else tuple(knots))
    return Splice(begin, lanes[0], lanes[1])


class Driven:
    """A session with all that it publishes; `sent` counts messages and stands for their times."""

    def __init__(self, paused: bool = False, sent: int = 0, **values: Any) -> None:
        self.sent = sent
        self.records: list[tuple[int, Record]] = []
        self.rows: list[tuple[int, Rows]] = []
        self.session = Session(parameters.complete(values), self._record, paused=paused)

    def _record(self, record: Record) -> None:
        self.sent += 1
        self.records.append((self.sent, records_of.from_json(records_of.to_json(record))))

    def advance(self, seconds: float) -> None:
        """Simulate, and publish the rows in batches of at most three."""
        self.session.advance(self.session.time_ns + round(seconds * NS))
        self.flush()

    def flush(self) -> None:
        gathered = self.session.take_rows()
        if gathered:
            rows = join_rows(gathered)
            for first in range(0, len(rows), 3):
                self.sent += 1
                self.rows.append((self.sent, rows[first : first + 3]))

    def drive(self, seed: int, inputs_: int = 40, trajectories: float = 0.0) -> Driven:
        """A wild but seeded sequence of inputs of every kind, with uneven advances between them.

        `trajectories`: in which part of the turns an offset trajectory comes besides.
        """
        rng = random.Random(seed)
        for _ in range(inputs_):
            self.advance(rng.choice([0.0, 1e-9, 0.001, rng.uniform(0.0, 0.3)]))
            wild_input(self.session, rng)
            if trajectories and rng.random() < trajectories:
                self.session.trajectory(wild_splice(self.session, rng))
            self.flush()
        self.session.set_paused(False)
        self.advance(1.0)
        return self

    @property
    def record_list(self) -> list[Record]:
        return [record for _, record in self.records]

    @property
    def batches(self) -> list[Rows]:
        return [rows for _, rows in self.rows]

    @property
    def impacts(self) -> int:
        """Single impacts in all rows."""
        return sum(int(rows["count"].sum()) for rows in self.batches)


def flipped(rows: Rows, place: int, field: str, bit: int = 0) -> Rows:
    """A copy with one bit of one field of one row changed."""
    copy = np.frombuffer(bytearray(rows.tobytes()), rows.dtype)
    assert rows.dtype.fields is not None
    dtype, offset = rows.dtype.fields[field][:2]
    assert bit < 8 * dtype.itemsize
    copy.view(np.uint8).reshape(len(rows), -1)[place, offset + bit // 8] ^= 1 << bit % 8
    return copy

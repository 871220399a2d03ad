"""The record of a run as seen from outside: impacts, samples, motions, inputs; its source."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.bounded import NewestRows
from bouncing_disk_ros.core.model import IMPACT_DTYPE, Disk, Energy, Motion, MotionInForce
from bouncing_disk_ros.core.offset import Offset

SETTLED_SECONDS = 2.0
"""The rotor speed of the summary is the mean over this long at the end."""
MOST_ROWS = 1_000_000
"""Rows of impacts that are held, the newest."""
UNKNOWN_DISK = Disk(*[math.nan] * len(Disk._fields))
"""Stands for a disk whose parameters are unknown: what follows from them is nan."""


class State(NamedTuple):
    """One sample of joint_states."""

    time: float  # simulated, s
    disk_position: float  # m
    platform_position: float  # m
    angular_velocity: float  # of the disk, rad/s
    angle: float = math.nan  # of the disk, unwrapped, rad


class HealthReport(NamedTuple):
    """One report of /diagnostics."""

    stamp: float  # s of the wall clock
    simulated: float  # s
    lateness_p50: float  # of the ticks, s
    lateness_p99: float
    lateness_max: float
    residual: float  # of the energy balance, per throughput
    running: bool = True  # not paused or inactive
    behind: float = math.nan  # of simulated time behind its due time, s of the wall clock
    skipped: int = 0  # samples of joint_states left out, since the start
    refused: int = 0  # inputs, since the start
    asked: str = ""  # real-time factor, in words
    energy: Energy | None = None  # ledger since the start or the last reset, J
    rows: int = -1  # of impacts, in all, when it was sent: those before it; -1: not known


class Change(NamedTuple):
    """An input that drives the disk on otherwise than before; motions are kept by themselves."""

    time: float  # simulated, s
    what: str  # "impulse", "reset" or "parameters"
    detail: str = ""  # in words


@dataclass
class RunRecord:
    """Record of a run: everything received, in order; times are simulated seconds."""

    disk: Disk
    states: list[State] = field(default_factory=list)
    speeds: list[tuple[float, float]] = field(default_factory=list)  # time, mean rad/s before it
    motions: list[MotionInForce] = field(default_factory=list)
    health: list[HealthReport] = field(default_factory=list)
    impacts: NewestRows = field(default_factory=lambda: NewestRows(IMPACT_DTYPE, MOST_ROWS))
    lost: int = 0  # rows of impacts
    lacking: tuple[str, ...] = ()  # fields of impacts that messages of another version lack: nan
    inputs: int = 0  # motions, impulses, parameter changes and resets that the simulator accepted
    changes: list[Change] = field(default_factory=list)
    disks: list[tuple[float, Disk]] = field(default_factory=list)  # time from which it is known
    offsets: list[tuple[int, Offset | None]] = field(default_factory=list)
    """Simulated ns of each acceptance of an offset trajectory, and all accepted then (None: not
    known); before the first entry it is not known either, without any there was none."""
    known: list[tuple[float, float]] = field(default_factory=list)
    """From when to when all inputs are known, by a snapshot and the gapless records after it."""
    clock_set: list[float] = field(default_factory=list)  # when it was paused, or its factor set
    rounding: float = 1e-9  # of the simulated times of samples, s: their stamps are whole ns
    untimed: int = 0  # samples and speeds that no stamp puts at a simulated time

    def __repr__(self) -> str:
        """What there is, in numbers."""
        counts = f"{len(self.impacts)} rows of impacts, {len(self.states)} states"
        return f"<record of a run: {counts}, {len(self.motions)} motions, {self.lost} rows lost>"

    @property
    def rows(self) -> NDArray[np.void]:
        """All impacts that are held, IMPACT_DTYPE, to read: copy them to change them."""
        return self.impacts.rows

    @property
    def motion(self) -> Motion | None:
        """The steady motion at the end; None while it changes."""
        if not self.motions or self.motions[-1].begin_ns != self.motions[-1].end_ns:
            return None
        return self.motions[-1].target


ABSENT = "not in this bag"


class TopicCount(NamedTuple):
    """One topic as recorded; `lost` in words, from the publisher's numbering."""

    topic: str
    messages: int
    lost: str


@dataclass(frozen=True)
class RecordSource:
    """Where a record comes from, and what is known of the recording."""

    name: str
    namespace: str = "/"
    run: int = 1  # of `runs`
    runs: int = 1
    version: str = ""  # of the package that simulated
    topics: tuple[TopicCount, ...] = ()
    missing: tuple[str, ...] = ()  # topics of a simulator that are not in the bag
    empty: tuple[str, ...] = ()  # that are, without any message
    notes: Mapping[str, str] | None = None  # of the recorder
    remarks: tuple[str, ...] = ()  # damage
    limits: tuple[str, ...] = ()  # what was left out or downsampled on reading
    is_cut: bool = False  # only the times asked for were read
    is_cut_off: bool = False  # of these, the run goes on after the last one

    def absence(self, *topics: str) -> str:
        """Why nothing of these topics (if named) is there, in words that follow "is"."""
        asked = {*topics}
        if asked and asked <= {*self.missing}:
            return ABSENT
        if asked and asked <= {*self.missing, *self.empty}:
            return "in this bag without messages"
        return f"without messages {'within these times' if self.is_cut else 'of this run'}"

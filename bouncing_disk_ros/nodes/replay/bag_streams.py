"""Replay a bag: its records of inputs and rows of impacts as streams for `run.replay`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bouncing_disk_ros import bag
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.report.recorded_runs import (
    IMPACTS,
    INPUTS,
    Heard,
    RecordedRuns,
    Run,
)
from bouncing_disk_ros.run.input_replay import Watch
from bouncing_disk_ros.run.replay import Replay, replay
from bouncing_disk_ros.topics import TOPICS


def _ignore(_: int) -> None:
    pass


@dataclass
class Recorded:
    """What one simulator published into a bag: its record of inputs and its impacts.

    `namespace` chooses among several simulators; `inputs` and `impacts` name topics that were
    remapped. Raises InputError when that does not lead to one topic of each kind, or
    one has other fields than its type here; BagError when its messages cannot be decoded.
    """

    bag: bag.Bag
    namespace: str | None = None
    inputs: str = ""
    impacts: str = ""

    def __post_init__(self) -> None:
        namespace = None if self.namespace is None else "/" + self.namespace.strip("/")
        self.inputs = self._found(INPUTS, "--inputs", self.inputs, namespace)
        beside = self.inputs.removesuffix(INPUTS) + IMPACTS
        if not self.impacts and self.inputs.endswith("/" + INPUTS) and beside in self.bag.topics:
            self.impacts = beside
        self.impacts = self._found(IMPACTS, "--impacts", self.impacts, namespace)
        if not self.bag.topics[self.inputs].count:
            hint = "Record with the simulator running: its record of inputs is latched."
            raise InputError(self.inputs, "no messages", "a bag that holds some", hint)
        for name in (self.inputs, self.impacts):
            self.bag.check_installed(name)

    def _found(self, name: str, option: str, given: str, namespace: str | None) -> str:
        """The one topic meant by a relative name."""
        of_type = [n for n, t in sorted(self.bag.topics.items()) if t.type == TOPICS[name].type]
        if given:
            if given not in of_type:
                allowed = ", ".join(of_type) or f"none: the bag has no {TOPICS[name].type}"
                raise InputError(option, given, allowed)
            return given
        candidates = [topic for topic in of_type if topic.endswith("/" + name)]
        if namespace is not None:
            wanted = f"{namespace.rstrip('/')}/{name}"
            if wanted not in candidates:
                allowed = ", ".join(_namespace_of(topic, name) for topic in candidates) or "none"
                raise InputError("--namespace", namespace, allowed)
            return wanted
        if not candidates:
            others = f"{option} with one of {', '.join(of_type)}" if of_type else "another bag"
            raise InputError(f"topics of {self.bag.path}", f"no {name}", f"a bag with {name}",
                             f"If it was remapped, give {others}." if of_type else "")  # fmt: skip
        if len(candidates) > 1:
            allowed = "one of " + ", ".join(_namespace_of(topic, name) for topic in candidates)
            raise InputError("--namespace", "none, but several simulators are in the bag", allowed)
        return candidates[0]

    def runs(self, heard: Heard = _ignore) -> RecordedRuns:
        """The runs in the bag, one after the other."""
        return RecordedRuns(self.bag, self.inputs, self.impacts, heard)

    def run(self, number: int) -> Run:
        """The run of this number, from 1; InputError when there is none."""
        runs = self.runs()
        for count, run in enumerate(runs, start=1):
            if count == number:
                return run
        raise InputError("--run", number, f"1 to {len(runs)}")


def _namespace_of(topic: str, name: str) -> str:
    return topic.removesuffix("/" + name) or "/"


class ReplayedBag:
    """The replays of all runs of a bag; `left_over` are rows that may belong to either of two."""

    def __init__(self, runs: Sequence[Replay], left_over: int) -> None:
        self.runs, self.left_over = list(runs), left_over

    @property
    def identical(self) -> bool:
        """Whether all fields of the rows were compared, and nothing differs."""
        return all(run.identical for run in self.runs)

    @property
    def impacts(self) -> int:
        """Impacts compared and equal."""
        return sum(run.impacts for run in self.runs)

    @property
    def rows(self) -> int:
        """Rows compared and equal."""
        return sum(run.rows for run in self.runs)

    @property
    def not_compared(self) -> int:
        """Rows in the bag that could not be compared."""
        return self.left_over + sum(run.not_compared for run in self.runs)


def replay_bag(
    recorded: Recorded, heard: Heard = _ignore, watch: Watch | None = None
) -> ReplayedBag:
    """Replay every run of a simulator in a bag; InputError without a snapshot to begin at."""
    runs = recorded.runs(heard)
    found = [replay(run.records, run.rows, watch, run.end_ns) for run in runs]
    if not any(run.start_ns is not None for run in found):
        records = sum(run.records for run in found)
        hint = "Record for longer than the simulator's snapshot_period."
        given = f"{records} records without a snapshot"
        raise InputError(recorded.inputs, given, "records with at least one snapshot", hint)
    return ReplayedBag(found, runs.left_over)

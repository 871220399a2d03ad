"""What if the disk or the motion had been another? A run and a changed one, from one record.

Both are simulated side by side from the first snapshot; every input comes at its recorded instant.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from bouncing_disk_ros import parameters
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.run.input_records import Record
from bouncing_disk_ros.run.input_replay import apply, restored
from bouncing_disk_ros.run.replay_check import Watch
from bouncing_disk_ros.run.run_pair import Pair, TwoRuns

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
    platform by a cross-fade of one period.
    """
    run = restored(record)
    disk = changes.of_disk(run.disk)
    _check(disk._asdict())
    if record["index"] == 0 and run.time_ns == 0:
        state = record["state"]
        motion = changes.of_motion(Motion(*state["initial_motion"]))
        initial = InitialState(*state["initial"])
        return Simulation(motion, disk, initial, chatter_report_speed=run.chatter_report_speed)
    if changes.disk:
        run.set_disk(disk)
    if changes.motion:
        now = changes.of_motion(run.motion_in_force.target)
        later = [(fade.end_ns, changes.of_motion(fade.target)) for fade in run.pending]
        run.command([(run.time_ns + 1, now), *later])
    return run


def what_if(
    records: Iterable[Record], changes: Changes, until_ns: int, watch: Watch | None = None
) -> TwoRuns:
    """A run from its records, and the same with changes, up to an instant of simulated time.

    `records`: those of one run; it begins at the first snapshot, and ends early where a record is
    missing: what was lost is not known. Raises InputError without a snapshot, and for changes
    that are not allowed together.
    """
    pair: Pair | None = None
    index = 0
    for record in records:
        if pair is None:
            if record["kind"] == "snapshot":
                start = restored(record), changed_start(record, changes)
                pair = Pair(*start, until_ns, watch or (lambda _: None))
        elif record["index"] != index + 1:
            until_ns = pair.time_ns
            break
        else:
            pair.advance(min(record["time_ns"], until_ns))
            if record["time_ns"] > until_ns:
                break
            _apply(pair, record, changes)
        index = record["index"]
    if pair is None:
        raise InputError("input records", "no snapshot", "records with at least one snapshot")
    pair.advance(until_ns)
    return pair.result()


def _apply(pair: Pair, record: dict[str, Any], changes: Changes) -> None:
    apply(pair.first, record)
    apply(pair.second, changes.of_record(record))
    if record["kind"] == "reset":
        pair.restart_speed()

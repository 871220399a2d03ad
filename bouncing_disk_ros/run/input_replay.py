"""The record of inputs applied to a simulation: every impact again, bit for bit."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import bouncing_disk_ros
from bouncing_disk_ros.core.model import Disk, InitialState, Motion, SimulationError
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.input_records import KINDS, Record
from bouncing_disk_ros.run.trajectory_validation import splice_of
from bouncing_disk_ros.units import NS

Watch = Callable[[int], object]
"""Called with the simulated time reached, in ns; may raise to end a replay."""
EVENTS_PER_SLICE = 2000
"""Event budget of one slice of work: between two of them, a few milliseconds apart, Ctrl-C and a
watch are handled."""

EVENTS_BEHIND = 100_000
"""Events that may lie between the state of a snapshot and its time: some tenths of a second."""


def restored(record: Record) -> Simulation:
    """The simulation of a snapshot record; InputError when it is none that this build can read."""
    try:
        _check_reached(Simulation.restore(record["state"]))
        return Simulation.restore(record["state"])
    except (ValueError, KeyError, TypeError) as error:
        given = f"of version {record.get('version', 'unknown')} ({error})"
        allowed = f"snapshots that version {bouncing_disk_ros.__version__} can read"
        hint = "It is damaged, or of another build: replay it with the version that recorded it."
        raise InputError("snapshot", given, allowed, hint) from None


def _check_reached(simulation: Simulation) -> None:
    """Raise ValueError when the state of a snapshot lies far before the snapshot's own time.

    A simulation has resolved what is due at its time. Without this check a false time is reached by
    simulating years.
    """
    with contextlib.suppress(SimulationError):  # raised again when the run goes on
        _, is_behind = simulation.advance(simulation.time_ns, EVENTS_BEHIND)
        if is_behind:
            raise ValueError(f"its state lies more than {EVENTS_BEHIND} events before its time")


class Gap(NamedTuple):
    """Records that are missing: from there on nothing is known up to the next snapshot."""

    first: int  # index of the first missing record
    last: int  # of the last
    from_ns: int  # simulated time of the last record before
    until_ns: int | None  # of the snapshot from which the replay goes on; None: there is none


class Step(NamedTuple):
    """One record of a run, and the simulation to which it is to be applied at its time."""

    record: Record
    simulation: Simulation | None  # None: no snapshot yet, or none since a gap
    is_start: bool  # the record is the snapshot from which the simulation begins
    gap: Gap | None  # before the record


def steps(records: Iterable[Record]) -> Iterator[Step]:
    """The steps of a replay of one run; the caller advances the simulation and applies the record.

    A simulation begins at the first snapshot, and another one at the first snapshot after a gap.
    Raises InputError for records out of order and for snapshots that cannot be read.
    """
    simulation: Simulation | None = None
    before: Record | None = None
    for record in records:
        gap = None if before is None else _gap(before, record)
        if gap is not None:
            simulation = None
        is_start = simulation is None and record["kind"] == "snapshot"
        if is_start:
            simulation = restored(record)
        yield Step(record, simulation, is_start, gap)
        before = record


def _gap(before: Record, record: Record) -> Gap | None:
    """The gap between two records; InputError where they are out of order."""
    index, next_index, time_ns = before["index"], record["index"], before["time_ns"]
    if next_index <= index or record["time_ns"] < time_ns:
        given = f"index {next_index} at {record['time_ns']} ns after {index} at {time_ns} ns"
        hint = "Replay each run on its own."
        raise InputError("input records", given, "rising index and time", hint)
    return None if next_index == index + 1 else Gap(index + 1, next_index - 1, time_ns, None)


def apply(simulation: Simulation, record: Record) -> None:
    """Apply one record at the instant reached; snapshots and pauses do nothing.

    Raises InputError for an input that the simulation does not take.
    """
    try:
        _apply(simulation, record)
    except InputError:
        raise
    except ValueError as error:
        field = f"input record {record['index']} ({record['kind']})"
        raise InputError(field, str(error), "an input that the run can take") from None


def _apply(simulation: Simulation, record: Record) -> None:
    match record["kind"]:
        case "motion":
            points = [(int(at), Motion(*values)) for at, values in record["points"]]
            simulation.command(points, record["crossfade_ns"])
        case "trajectory":
            simulation.splice(*splice_of(record["begin_ns"], record["joints"]))
        case "impulse":
            simulation.apply_impulse(
                record["at_ns"], record["axial_impulse"], record["angular_impulse"]
            )
        case "parameters":
            simulation.set_parameters(record["values"], Disk(**record["disk"]))
        case "reset":
            simulation.reset(InitialState(**record["initial"]), Motion(**record["motion"]))
        case "snapshot" | "pause":
            pass
        case kind:
            raise InputError("input record kind", kind, "any of " + ", ".join(KINDS))


def advance_slice(simulation: Simulation, until_ns: int) -> tuple[NDArray[np.void], bool]:
    """`Simulation.advance` with the budget of one slice; InputError for a run that cannot go on."""
    try:
        return simulation.advance(until_ns, EVENTS_PER_SLICE)
    except SimulationError as error:
        given = f"{error} (at {simulation.time_ns / NS:.9f} s)"
        raise InputError("the recorded run", given, "a run that can be simulated") from None


def advance_to(simulation: Simulation, until_ns: int) -> list[NDArray[np.void]]:
    """Advance all the way, whatever the number of events; the rows in the order of `index`."""
    rows, behind = [], True
    while behind:
        some, behind = advance_slice(simulation, until_ns)
        if len(some):
            rows.append(some)
    return rows

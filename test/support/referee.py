"""Random runs, lane flights and tosses before the referee, in a process that may be given up.

A run that takes too long (one call of the core, or its proof) is ended with its process and counted
as given up; the next process goes on with the run after it.
"""

from __future__ import annotations

import itertools
import multiprocessing
from collections import Counter
from collections.abc import Iterable, Iterator
from multiprocessing.connection import Connection
from typing import NamedTuple

from bouncing_disk_ros.core.model import Phase, SimulationError
from bouncing_disk_ros.proof.event_proof import prove
from bouncing_disk_ros.proof.event_trace import trace
from bouncing_disk_ros.proof.verdicts import Outcome, described
from support.random_runs import FAR_NS, RandomRun, random_fade, random_run

FLIGHTS, GIVEN_UP = "flights", "given up"
EVENTS = 20
"""Events of one run that are proved."""


class Found(NamedTuple):
    """What the referee says of one run: counts by kind and outcome, and what is not proved."""

    seed: int
    counts: dict[str, int]
    refuted: list[str]
    undecided: list[str]


def prove_run(seed: int, events: int = EVENTS) -> Found:
    """Prove the first events of the run of a seed; every second seed has a cross-fade."""
    run = random_fade(seed) if seed % 2 else random_run(seed)
    found = Found(seed, Counter(), [], [])
    try:
        _prove_events(run, events, found)
    except SimulationError as error:
        found.refuted.append(f"seed {seed}: {error}\n  {run!r}")
    return found


def _prove_events(run: RandomRun, events: int, found: Found) -> None:
    seed = found.seed
    for number, event in enumerate(itertools.islice(trace(run.start(), FAR_NS), events)):
        verdict = prove(event)
        found.counts[f"{event.kind.value} {verdict.outcome.value}"] += 1
        found.counts[FLIGHTS] += event.before.phase is Phase.FLIGHT
        said = f"seed {seed}, event {number}: {described(event, verdict)}\n  {run!r}\n  {event!r}"
        if verdict.outcome is Outcome.REFUTED:
            found.refuted.append(said)
            break  # what follows comes of it
        if verdict.outcome is Outcome.UNDECIDED:
            found.undecided.append(said)


def _serve(connection: Connection) -> None:
    while True:
        connection.send(tuple(prove_run(connection.recv())))


class _Child:
    """The process that proves runs."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, there = context.Pipe()
        self._process = context.Process(target=_serve, args=(there,), daemon=True)
        self._process.start()
        there.close()
        self.grace = 60.0  # s, for the process to begin

    def prove(self, seed: int, patience: float) -> Found | None:
        """Prove one run; None when that takes too long."""
        self.connection.send(seed)
        if not self.connection.poll(patience + self.grace):
            return None
        self.grace = 0.0
        return Found(*self.connection.recv())

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.join()
        self.connection.close()


def prove_runs(seeds: Iterable[int], patience: float) -> Iterator[Found]:
    """Prove the runs of some seeds; one that takes longer than `patience` seconds is given up."""
    child = _Child()
    try:
        for seed in seeds:
            found = child.prove(seed, patience)
            if found is None:
                child.close()
                child = _Child()
                found = Found(seed, {GIVEN_UP: 1}, [], [])
            yield found
    finally:
        child.close()

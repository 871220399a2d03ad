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

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.proof.prove import prove
from bouncing_disk_ros.proof.tally import described
from bouncing_disk_ros.proof.trace import trace
from bouncing_disk_ros.proof.verdict import Outcome
from support.random_runs import FAR_NS, random_fade, random_run

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
    return found


def _serve(connection: Connection, seeds: list[int]) -> None:
    for seed in seeds:
        connection.send(tuple(prove_run(seed)))


def prove_runs(seeds: Iterable[int], patience: float) -> Iterator[Found]:
    """Prove the runs of some seeds; one that takes longer than `patience` seconds is given up."""
    todo = list(seeds)
    context = multiprocessing.get_context("spawn")
    while todo:
        here, there = context.Pipe(duplex=False)
        process = context.Process(target=_serve, args=(there, todo), daemon=True)
        process.start()
        there.close()
        limit = patience + 60.0  # for the process to begin
        try:
            while todo and here.poll(limit):
                yield Found(*here.recv())
                todo.pop(0)
                limit = patience
        except EOFError:
            process.join()
            raise RuntimeError(f"the process ended at seed {todo[0]}") from None
        finally:
            process.kill()
            process.join()
            here.close()
        if todo:
            yield Found(todo.pop(0), {GIVEN_UP: 1}, [], [])

"""The core against the referee (bouncing_disk_ros.proof): random runs and maps.

Each event is proved in interval arithmetic from the numbers before it. None may be refuted; that
rounding decides (a graze) is rare. `make soak` has a million flights and a million steps of lanes.
"""

from __future__ import annotations

import itertools
from collections import Counter

from bouncing_disk_ros.proof.exact_records import Outcome
from reference.cases import FIRST, examples
from support.map_proof import prove_collision
from support.random_maps import random_collisions
from support.referee import FLIGHTS, GIVEN_UP, prove_runs

MANY_FLIGHTS, COLLISIONS = examples(1_000, 1_000_000), examples(1_000, 1_000_000)
PINNED = (639,)
"""Runs that were refuted once: a short flight in a cross-fade to a far higher frequency."""
PATIENCE = 60.0
"""s for one run, on a machine that does much else."""
GIVEN_UP_PART, UNDECIDED_PART = 1e-3, 3e-3
"""Of all runs, and of all flights or steps."""


def test_events_of_random_runs_are_proved() -> None:
    """Steady motions and cross-fades, flights and contact."""
    counts: Counter[str] = Counter()
    undecided: list[str] = []
    for found in prove_runs(itertools.chain(PINNED, itertools.count(FIRST)), PATIENCE):
        assert found.refuted == []
        counts.update(found.counts, runs=1)
        undecided += found.undecided
        if counts[FLIGHTS] >= MANY_FLIGHTS:
            break
    assert counts[GIVEN_UP] <= GIVEN_UP_PART * counts["runs"]
    assert len(undecided) <= UNDECIDED_PART * MANY_FLIGHTS, undecided


def test_steps_of_the_lanes_are_proved() -> None:
    counts: Counter[Outcome] = Counter()
    for collision in random_collisions(FIRST + 1, COLLISIONS):
        verdict = prove_collision(collision)
        counts[verdict.outcome] += 1
        assert verdict.outcome is not Outcome.REFUTED, (collision, verdict)
    assert counts[Outcome.UNDECIDED] <= UNDECIDED_PART * COLLISIONS

"""The core against the referee (bouncing_disk_ros.proof): random runs.

Each event is proved in interval arithmetic from the numbers before it. None may be refuted; that
rounding decides (a graze) is rare. `make soak` has a million flights. Maps: test_map_proof.py.
"""

from __future__ import annotations

import itertools
from collections import Counter

from reference.cases import FIRST, examples, in_soak
from support.referee import FLIGHTS, GIVEN_UP, prove_run, prove_runs

MANY_FLIGHTS = examples(1_000, 1_000_000)
PINNED = (639,)
"""Runs that were refuted once: a short flight in a cross-fade to a far higher frequency."""
PATIENCE = 60.0
"""s for one run of `make soak`, on a machine that does much else."""
GIVEN_UP_PART, UNDECIDED_PART = 1e-3, 3e-3
"""Of all runs, and of all flights."""


def test_events_of_random_runs_are_proved() -> None:
    """Steady motions and cross-fades, flights and contact."""
    counts: Counter[str] = Counter()
    undecided: list[str] = []
    seeds = itertools.chain(PINNED, itertools.count(FIRST))
    for found in prove_runs(seeds, PATIENCE) if in_soak("all") else map(prove_run, seeds):
        assert found.refuted == []
        counts.update(found.counts, runs=1)
        undecided += found.undecided
        if counts[FLIGHTS] >= MANY_FLIGHTS:
            break
    assert counts[GIVEN_UP] <= GIVEN_UP_PART * counts["runs"]
    assert len(undecided) <= UNDECIDED_PART * MANY_FLIGHTS, undecided

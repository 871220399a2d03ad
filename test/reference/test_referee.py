"""The core against the referee (bouncing_disk_ros.proof): random runs, event by event.

Each event of the runs is proved in interval arithmetic from the state before it; none may be
refuted, and none of these is so near a graze that rounding decides.
"""

from __future__ import annotations

import itertools
from collections import Counter

from bouncing_disk_ros.core.model import Phase
from bouncing_disk_ros.proof.prove import prove
from bouncing_disk_ros.proof.trace import trace
from bouncing_disk_ros.proof.verdict import Outcome
from support.random_runs import FAR_NS, random_run

FLIGHTS = 10_000
EVENTS = 20  # of a run


def test_flights_of_random_runs_are_proved() -> None:
    counts: Counter[Outcome] = Counter()
    for seed in itertools.count():
        if counts.total() >= FLIGHTS:
            break
        run = random_run(seed)
        for event in itertools.islice(trace(run.start(), FAR_NS), EVENTS):
            if event.before.phase is not Phase.FLIGHT:
                continue
            verdict = prove(event)
            counts[verdict.outcome] += 1
            assert verdict.outcome is not Outcome.REFUTED, (seed, run, event, verdict)
    assert counts[Outcome.UNDECIDED] <= FLIGHTS // 1000

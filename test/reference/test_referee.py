"""The core against the referee (bouncing_disk_ros.proof): random runs.

Each event is proved in interval arithmetic from the numbers before it. None may be refuted; that
rounding decides (a graze) is rare. `make soak` has a million flights. Maps: test_map_proof.py.
"""

from __future__ import annotations

import itertools

from bouncing_disk_ros.core.model import Phase, SimulationError
from bouncing_disk_ros.proof.event_proof import prove
from bouncing_disk_ros.proof.event_trace import trace
from bouncing_disk_ros.proof.verdicts import Outcome, described
from reference.cases import FIRST, examples
from support.random_runs import FAR_NS, random_fade, random_run

MANY_FLIGHTS = examples(1_000, 1_000_000)
PINNED = (639,)
"""Runs that were refuted once: a short flight in a cross-fade to a far higher frequency."""
EVENTS = 20
"""Events of one run that are proved."""
UNDECIDED_PART = 3e-3
"""Of all flights."""


def test_events_of_random_runs_are_proved() -> None:
    """Steady motions and cross-fades, flights and contact."""
    flights, undecided = 0, list[str]()
    for seed in itertools.chain(PINNED, itertools.count(FIRST)):
        run = random_fade(seed) if seed % 2 else random_run(seed)
        try:
            for event in itertools.islice(trace(run.start(), FAR_NS), EVENTS):
                verdict = prove(event)
                said = f"seed {seed}: {described(event, verdict)}\n  {event!r}"
                assert verdict.outcome is not Outcome.REFUTED, said
                flights += event.before.phase is Phase.FLIGHT
                if verdict.outcome is Outcome.UNDECIDED:
                    undecided.append(said)
        except SimulationError as error:
            error.add_note(f"seed {seed}: {run!r}")
            raise
        if flights >= MANY_FLIGHTS:
            break
    assert len(undecided) <= UNDECIDED_PART * MANY_FLIGHTS, undecided

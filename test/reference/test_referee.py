"""The core against the referee (bouncing_disk_ros.proof): random runs and maps.

Each event is proved in interval arithmetic from the numbers before it. None may be refuted; that
rounding decides (a graze) is rare. `make soak` has a million flights and a million steps of lanes.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.lanes.axial_lanes import COUNT_CONTACTS, COUNT_RESTS, iterate_axial
from bouncing_disk_ros.proof.verdicts import Outcome
from reference.cases import FIRST, examples
from support.coverage import in_soak
from support.map_proof import Collision, MapKind, prove_collision
from support.referee import FLIGHTS, GIVEN_UP, prove_run, prove_runs

MANY_FLIGHTS, COLLISIONS = examples(1_000, 1_000_000), examples(1_000, 1_000_000)
PINNED = (639,)
"""Runs that were refuted once: a short flight in a cross-fade to a far higher frequency."""
PATIENCE = 60.0
"""s for one run of `make soak`, on a machine that does much else."""
GIVEN_UP_PART, UNDECIDED_PART = 1e-3, 3e-3
"""Of all runs, and of all flights or steps."""


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


def log_uniforms(rng: np.random.Generator, low: float, high: float, n: int) -> NDArray[np.float64]:
    """Numbers between low and high whose logarithms are uniform."""
    found: NDArray[np.float64] = np.exp(rng.uniform(math.log(low), math.log(high), n))
    return found


def random_collisions(seed: int, n: int) -> list[Collision]:
    """Steps from random impacts: Γ 0 to 1.5, some 1e-9 to 1e6; ε in [0, 1], often near its ends;
    |w| from 1e-12 to 1e4."""
    rng, k = np.random.default_rng(seed), np.arange(n)
    tau = rng.uniform(0.0, math.tau, n)
    axial_forcing = np.choose(
        k % 5, [rng.uniform(0.0, 0.33, n), log_uniforms(rng, 1e-9, 1e6, n)]
        + [rng.uniform(0.3, 1.5, n)] * 3,
    )  # fmt: skip
    restitution = np.choose(
        k % 7, [rng.integers(0, 2, n), 1.0 - log_uniforms(rng, 1e-6, 1.0, n)]
        + [rng.uniform(0.0, 1.0, n)] * 5,
    )  # fmt: skip
    speed = np.choose(
        k % 3,
        [log_uniforms(rng, 1e-12, 1.0, n), rng.uniform(0.0, 5.0, n),
         log_uniforms(rng, 1e-3, 1e4, n)],
    )  # fmt: skip
    next_tau, next_w, counts = tau.copy(), -speed, np.zeros((n, 2), np.int64)
    iterate_axial(next_tau, next_w, axial_forcing, restitution, 1, counts)
    kinds = np.where(counts[:, COUNT_RESTS] > 0, 2, np.where(counts[:, COUNT_CONTACTS] > 0, 1, 0))
    table = np.stack([tau, -speed, axial_forcing, restitution, next_tau, next_w], axis=1)
    return [
        Collision(*row)._replace(kind=MapKind(kind))
        for row, kind in zip(table.tolist(), kinds.tolist(), strict=True)
    ]


def test_steps_of_the_lanes_are_proved() -> None:
    counts: Counter[Outcome] = Counter()
    for collision in random_collisions(FIRST + 1, COLLISIONS):
        verdict = prove_collision(collision)
        counts[verdict.outcome] += 1
        assert verdict.outcome is not Outcome.REFUTED, (collision, verdict)
    assert counts[Outcome.UNDECIDED] <= UNDECIDED_PART * COLLISIONS

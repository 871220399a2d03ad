"""The referee of the next-collision map: right steps are proved, others refuted."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bouncing_disk_ros.maps.lanes.axial_lanes import (
    COUNT_CONTACTS,
    COUNT_RESTS,
    iterate_axial,
)
from bouncing_disk_ros.proof.verdicts import Outcome
from support.map_proof import Collision, MapKind, prove_collision


def steps(n: int, seed: int = 1) -> list[Collision]:
    """One step each from random impacts."""
    rng = np.random.default_rng(seed)
    tau = rng.uniform(0.0, math.tau, n)
    w = -np.where(np.arange(n) % 3 == 0, 10.0 ** rng.uniform(-12, -6, n), rng.uniform(0, 4, n))
    axial_forcing, restitution = rng.uniform(0.0, 1.2, n), rng.uniform(0.0, 0.9, n)
    next_tau, next_w, counts = tau.copy(), w.copy(), np.zeros((n, 2), np.int64)
    iterate_axial(next_tau, next_w, axial_forcing, restitution, 1, counts)
    kinds = np.where(counts[:, COUNT_RESTS] > 0, 2, np.where(counts[:, COUNT_CONTACTS] > 0, 1, 0))
    table = np.stack([tau, w, axial_forcing, restitution, next_tau, next_w], axis=1)
    return [
        Collision(*row)._replace(kind=MapKind(kind))
        for row, kind in zip(table.tolist(), kinds.tolist(), strict=True)
    ]


@pytest.mark.parametrize("field", ["next_tau", "next_w"])
@pytest.mark.parametrize("change", [1e-9, -1e-9, 0.1])
def test_other_impacts_are_refuted(field: str, change: float) -> None:
    for step in steps(100):
        if step.kind is MapKind.REST:
            continue
        other = step._replace(**{field: getattr(step, field) + change})
        assert prove_collision(other).outcome is Outcome.REFUTED, other


def test_another_kind_is_not_proved() -> None:
    """A chatter that is far from complete is not shown to end; a flight in its place is none."""
    for step in steps(100):
        for kind in set(MapKind) - {step.kind}:
            outcome = prove_collision(step._replace(kind=kind)).outcome
            assert outcome is not Outcome.PROVED
            if kind is MapKind.IMPACT:
                assert outcome is Outcome.REFUTED


@pytest.mark.parametrize("w", [math.nan, 0.0, 1.0, -math.inf])
def test_an_impact_that_is_none_is_refuted(w: float) -> None:
    step = steps(1)[0]._replace(next_w=w, kind=MapKind.IMPACT)
    assert prove_collision(step).outcome is Outcome.REFUTED

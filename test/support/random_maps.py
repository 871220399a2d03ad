"""Random steps of the next-collision map, as the lanes compute them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.lanes.axial_lanes import (
    COUNT_CONTACTS,
    COUNT_RESTS,
    iterate_axial,
)
from support.map_proof import Collision, MapKind

Floats = NDArray[np.float64]


def log_uniforms(rng: np.random.Generator, low: float, high: float, n: int) -> Floats:
    """Numbers between low and high whose logarithms are uniform."""
    found: Floats = np.exp(rng.uniform(math.log(low), math.log(high), n))
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

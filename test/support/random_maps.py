"""Random steps of the next-collision map and random single tosses, as the lanes compute them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.layout import disk_record
from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.maps.lanes.axial_lanes import (
    COUNT_CONTACTS,
    COUNT_RESTS,
    iterate_axial,
)
from bouncing_disk_ros.maps.lanes.toss_lanes import tosses
from bouncing_disk_ros.proof.event_trace import disk_of
from bouncing_disk_ros.proof.exact_records import MotionRecord
from support.map_proof import Collision, MapKind
from support.random_runs import GRAVITY, log_uniform
from support.toss_proof import Toss

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


def random_disk(rng: np.random.Generator) -> Disk:
    """A disk with friction, some with a preload or a load torque that is less than friction."""
    mass, friction, radius = (
        log_uniform(rng, 1e-3, 10.0),
        log_uniform(rng, 1e-3, 2.0),
        log_uniform(rng, 0.01, 0.3),
    )
    weight = mass * GRAVITY
    preload = weight * (0.0, log_uniform(rng, 1e-3, 1e3), -0.5)[rng.integers(3)]
    load = 0.0
    if rng.random() < 0.3:
        load = float(rng.uniform(-0.9, 0.9)) * friction * radius * (weight + preload)
    gyration = log_uniform(rng, 0.01, 0.3)
    return Disk(mass, 0.5, friction, radius, gyration, GRAVITY, preload, load)


def random_tosses(seed: int, n: int) -> list[Toss]:
    """Tosses with one disk and frequency: Aω²/g 0.5 to 1000, platforms that turn by next to nothing
    or very much, starts at the lowest point or anywhere, at rest or turning."""
    rng, k = np.random.default_rng(seed), np.arange(n)
    disk, frequency = random_disk(rng), log_uniform(rng, 1e-3, 1e6)
    record = disk_record(disk, 0.0)
    numbers, inertia = disk_of(record), float(record["inertia"][0])
    omega = math.tau * frequency
    ratio = np.where(k % 4 == 0, log_uniforms(rng, 0.5, 1e3, n), rng.uniform(0.9, 6.0, n))
    amplitude = numbers.g / omega**2 * ratio
    scale = amplitude * numbers.grip
    turning = np.where(k % 5 == 0, 0.0, scale * log_uniforms(rng, 1e-3, 1e3, n))
    lag = rng.uniform(-math.pi, math.pi, n)
    leave = np.arcsin(np.minimum(1.0 / ratio, 1.0))
    lag = np.where(k % 11 == 0, -leave, lag)  # no torque is needed where the load is zero
    tau = np.where(k % 2 == 0, 1.5 * math.pi, rng.uniform(0.0, math.tau, n))
    speed = np.where(k % 3 == 0, 0.0, rng.normal(size=n) * omega * np.maximum(turning, scale))
    starts = np.stack([amplitude, turning, lag, tau, speed], axis=1)
    out, codes = tosses(starts, frequency, disk)
    found = []
    for start, row, code in zip(starts.tolist(), out.tolist(), codes.tolist(), strict=True):
        a, p, theta, phase, spin = start
        motion = MotionRecord(False, 0, 0, 0, 0.0, a, 0.0, p, 0.0, frequency, 0.0, theta, 0.0)
        works = (row[2] / disk.mass, row[3] / inertia)
        found.append(Toss(motion, numbers, phase, spin, code, row[0], row[1], *works))
    return found

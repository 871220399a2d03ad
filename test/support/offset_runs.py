"""Random runs with offset trajectories, one for each seed: splices, lines, cubics and quintics.

Offsets are on the scale of a toss: heights up to some amplitudes, accelerations up to a few g.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.offset import Knot, OffsetState
from bouncing_disk_ros.core.simulation import Simulation

SECOND = 10**9
GRAVITY = 9.81


class Spliced(NamedTuple):
    """A message: when its trajectory begins, and the points of both joints.

    A point is (ns, position), or with velocity, or with velocity and acceleration.
    """

    begin_ns: int
    axial: tuple[tuple[float, ...], ...]
    angular: tuple[tuple[float, ...], ...]


class OffsetRun(NamedTuple):
    """A run with trajectories; its repr is enough to repeat it."""

    motion: Motion
    disk: Disk
    initial: InitialState
    trajectories: tuple[Spliced, ...]

    def start(self) -> Simulation:
        """The run at t = 0, its trajectories queued."""
        run = Simulation(self.motion, self.disk, self.initial)
        for one in self.trajectories:
            run.trajectory(one.begin_ns, knots(one.axial), knots(one.angular))
        return run


def knots(points: tuple[tuple[float, ...], ...]) -> list[Knot] | None:
    """Points as knots of the core; no points: the joint is left alone."""
    if not points:
        return None
    degrees = {2: 1, 3: 3, 4: 5}
    return [Knot(int(p[0]), OffsetState(*p[1:]), degrees[len(p)]) for p in points]


def points(
    rng: np.random.Generator, begin_ns: int, scale: float, rate: float
) -> tuple[tuple[float, ...], ...]:
    """One to four points about a part of 1/rate s apart."""
    kind = int(rng.integers(1, 4))
    now, found = begin_ns, []
    for _ in range(int(rng.integers(1, 5))):
        now += int(rng.uniform(0.1, 0.8) / rate * SECOND)
        stated = [float(rng.normal()) * scale * rate**order for order in range(kind)]
        found.append((now, *stated))
    return tuple(found)


def random_run(seed: int, *, friction: bool = True) -> OffsetRun:
    """A run about a second long in the motion's own units, f = 1 … 30 Hz."""
    rng = np.random.default_rng(seed)
    f = float(rng.uniform(1.0, 30.0))
    w = math.tau * f
    unit = math.pi * GRAVITY / w**2
    amplitude = float(rng.choice([0.0, 1.0])) * float(rng.uniform(0.05, 1.0)) * unit
    motion = Motion(amplitude, float(rng.uniform(0.0, 1.5)), f, float(rng.uniform(-3, 3)))
    restitution = float(rng.choice([0.0, 1.0, rng.uniform(0.1, 0.95)], p=[0.1, 0.1, 0.8]))
    mu = float(rng.uniform(0.0, 1.0)) if friction else 0.0
    disk = Disk(0.7, restitution, mu, 0.1, 0.09, GRAVITY)
    initial = InitialState(
        float(rng.choice([0.0, 1.0])) * float(rng.uniform(0.01, 2.0)) * unit,
        None if rng.random() < 0.5 else float(rng.normal()) * unit * w,
        float(rng.normal()) * w,
        0.0,
        float(rng.uniform(0.0, 6.28)),
    )
    begin, made = 0, []
    for _ in range(int(rng.integers(1, 4))):
        begin += int(rng.uniform(0.0, 1.0) / f * SECOND)
        axial = points(rng, begin, 0.3 * unit, f) if rng.random() < 0.9 else ()
        angular = points(rng, begin, 0.3, f) if rng.random() < 0.5 else ()
        made.append(Spliced(begin, axial, angular))
    return OffsetRun(motion, disk, initial, tuple(made))

"""Random runs over the whole range of the parameters, one for each seed.

Log-uniform over: A 1e-9 to 1 m, f 1e-3 to 1e6 Hz, heights 1e-8 to 100 m (a fifth at 0), preloads up
to 1000 m g and negative ones above −m g; ε in [0, 1], often at its ends; cross-fades between any
two such motions, of 1/1000 to 1000 periods of either.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation

GRAVITY = 9.81
FAR_NS = 10**15  # eleven days: a run is ended by its number of events


class RandomRun(NamedTuple):
    """A run with at most one cross-fade; its repr is enough to repeat it."""

    motion: Motion
    disk: Disk
    initial: InitialState
    target: Motion | None = None  # of the cross-fade
    begin_ns: int = 0
    duration_ns: int = 0

    def start(self) -> Simulation:
        """The run at t = 0, its cross-fade queued."""
        run = Simulation(self.motion, self.disk, self.initial)
        if self.target is not None:
            point = (self.begin_ns + self.duration_ns, self.target)
            run.command([point], crossfade_ns=self.duration_ns)
        return run


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between low and high whose logarithm is uniform."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def random_motion(rng: np.random.Generator) -> Motion:
    """A steady motion."""
    return Motion(
        log_uniform(rng, 1e-9, 1.0),
        log_uniform(rng, 1e-3, 1.0) if rng.random() < 0.7 else 0.0,
        log_uniform(rng, 1e-3, 1e6),
        float(rng.uniform(-math.pi, math.pi)),
    )


def random_disk(rng: np.random.Generator) -> Disk:
    """A disk with or without friction, preload and load torque."""
    mass = log_uniform(rng, 1e-3, 10.0)
    weight = mass * GRAVITY
    preload = (0.0, log_uniform(rng, 1e-3, 1e3), -float(rng.uniform(0.0, 0.99)))[rng.integers(3)]
    ends = (0.0, 1.0, float(rng.uniform()), 1.0 - log_uniform(rng, 1e-6, 1.0))
    friction = 0.0 if rng.random() < 0.1 else log_uniform(rng, 1e-3, 2.0)
    radius, load = log_uniform(rng, 0.01, 0.3), 0.0
    if rng.random() < 0.2:
        load = float(rng.uniform(-1.2, 1.2)) * friction * radius * weight * (1.0 + preload)
    return Disk(
        mass,
        ends[rng.integers(4)],
        friction,
        radius,
        log_uniform(rng, 0.01, 0.3),
        GRAVITY,
        preload * weight,
        load,
    )


def random_initial(rng: np.random.Generator) -> InitialState:
    """On the platform or above it; moving, or with the platform's velocity."""
    return InitialState(
        0.0 if rng.random() < 0.2 else log_uniform(rng, 1e-8, 100.0),
        None if rng.random() < 0.4 else float(rng.normal()) * log_uniform(rng, 1e-6, 10.0),
        float(rng.normal()) * 10.0,
        0.0,
        float(rng.uniform(0.0, math.tau)),
    )


def random_run(seed: int) -> RandomRun:
    """The run of a seed, the same with every version of Python."""
    rng = np.random.default_rng(seed)
    return RandomRun(random_motion(rng), random_disk(rng), random_initial(rng))


def random_fade(seed: int) -> RandomRun:
    """A run of a seed that begins with a cross-fade, at once or soon after."""
    rng = np.random.default_rng(seed)
    run = RandomRun(random_motion(rng), random_disk(rng), random_initial(rng))
    target = random_motion(rng)
    if rng.random() < 0.3:  # the same frequency or nearly
        target = target._replace(frequency=run.motion.frequency * log_uniform(rng, 0.5, 2.0))
    either = (run.motion.frequency, target.frequency)[rng.integers(2)]
    begin = 0.0 if rng.random() < 0.5 else log_uniform(rng, 1e-3, 10.0) / run.motion.frequency
    duration = log_uniform(rng, 1e-3, 1e3) / either
    return run._replace(
        target=target, begin_ns=round(begin * 1e9), duration_ns=max(round(duration * 1e9), 1)
    )

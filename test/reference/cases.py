"""Examples of slow tests: how many, from which seed, and whether intervals cover as they say.

Also what several reference tests share.
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy  # its parts are loaded where they are first used
from hypothesis import Phase as HypothesisPhase
from hypothesis import settings

from bouncing_disk_ros.core.model import Disk

NS = 1_000_000_000

#: the same examples on every run
FIXED = settings(derandomize=True, deadline=None, database=None, print_blob=True)
#: the same where one example takes long: the first failure is reported as it is found
SLOW = settings(FIXED, phases=[HypothesisPhase.explicit, HypothesisPhase.generate])


#: seed of the first random draw: 0, and another one for each `make soak`
FIRST = int(os.environ.get("SEED", "0")) if "EXAMPLES" in os.environ else 0


def examples(number: int, soak: int | None = None) -> int:
    """So many examples of a slow test, EXAMPLES times as many in `make soak`.

    `soak`: so many there instead, in proportion to EXAMPLES, of which 20 are usual.
    """
    times = int(os.environ.get("EXAMPLES", "0"))
    return number * max(times, 1) if soak is None or not times else soak * times // 20


def in_soak(*cases: Any) -> list[Any]:
    """Cases of the same code as others, which `make soak` alone takes."""
    return list(cases) if "EXAMPLES" in os.environ else []


def axial_amplitude(axial_forcing: float, frequency: float, disk: Disk) -> float:
    """A of a given Γ = A ω²/(π g), m."""
    gravity = disk.gravity + disk.preload / disk.mass
    return axial_forcing * math.pi * gravity / (math.tau * frequency) ** 2


# --- coverage of intervals ------------------------------------------------------------------------
def least_hits(trials: int, chance: float, miss: float) -> int:
    """The number of hits that is fallen short of with a chance of at most `miss`."""
    return int(scipy.stats.binom.ppf(miss, trials, chance))


FALSE_ALARM, UNSEEN = 1e-5, 0.01


def covers(trial: Callable[[np.random.Generator], bool], chance: float, poor: float) -> None:
    """Assert that `trial` succeeds as often as a coverage of `chance` must (but for 1 in 100 000).

    By Wald's sequential test: the trials end as soon as they tell `chance` from `poor`, a coverage
    that 1 time in 100 is taken for enough. A fixed number of trials for these two errors would be
    three times as large. `make soak` counts the hits of 100 trials or many times as many.
    """
    if "EXAMPLES" in os.environ:
        trials = examples(100)
        hits = sum(trial(np.random.default_rng(seed)) for seed in range(trials))
        assert hits >= least_hits(trials, chance, FALSE_ALARM), f"{hits} of {trials}"
        return
    hit, miss = math.log(poor / chance), math.log((1.0 - poor) / (1.0 - chance))
    misses, log_ratio = 0, 0.0  # of the likelihoods of `poor` and `chance`
    for seed in itertools.count():
        is_hit = trial(np.random.default_rng(seed))
        misses += not is_hit
        log_ratio += hit if is_hit else miss
        assert log_ratio < -math.log(FALSE_ALARM), f"{misses} misses in {seed + 1}"
        if log_ratio <= math.log(UNSEEN):
            return

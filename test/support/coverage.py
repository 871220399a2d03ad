"""Whether an interval covers as often as it says: trials with seeds 0, 1, 2, ..., and a bound."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.stats import binom

from reference.cases import examples


def in_soak(*cases: Any) -> list[Any]:
    """Cases of the same code as others, which `make soak` alone takes."""
    return list(cases) if "EXAMPLES" in os.environ else []


def least_hits(trials: int, chance: float, miss: float = 1e-5) -> int:
    """The number of hits that is fallen short of with a chance of at most `miss`."""
    return int(binom.ppf(miss, trials, chance))


def covers(trial: Callable[[np.random.Generator], bool], trials: int, chance: float) -> None:
    """Assert that `trial` succeeds as often as a coverage of `chance` must (but for 1 in 100 000).

    Half of the trials are made, in `make soak` many times as many. The bound for 200 at 0.95 is
    175: less coverage than 0.8 fails nearly always.
    """
    trials = examples(trials // 2)
    hits = sum(trial(np.random.default_rng(seed)) for seed in range(trials))
    assert hits >= least_hits(trials, chance), f"{hits} of {trials}"

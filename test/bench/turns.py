"""Runs that take turns: what disturbs the machine hits all alike."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Run = Callable[[], int]
"""Does its work; returns how many impacts, pixels or the like that was."""


def interleaved(runs: dict[str, Run], rounds: int) -> dict[str, NDArray[np.float64]]:
    """ns of the processor for each of what the runs count, `rounds` times in turn."""
    found = {name: np.empty(rounds) for name in runs}
    for i in range(rounds):
        for name, run in runs.items():
            clock = time.process_time_ns if name == "JAX" else time.thread_time_ns
            begin = clock()
            count = run()
            found[name][i] = (clock() - begin) / count
    return found

"""How long works take: one, or several that take turns, so that what disturbs hits all alike."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from support.processes import finished

PATIENCE = 300.0  # s; kernels may be compiled for another processor first
Run = Callable[[], int]
"""Does its work; returns how many impacts, pixels or the like that was."""


def in_process(*words: str | Path, env: Mapping[str, str] | None = None) -> str:
    """What a Python in a process of its own prints, which finds the modules of this one."""
    paths = {"PYTHONPATH": os.pathsep.join(sys.path)}
    return finished(sys.executable, *words, env={**paths, **(env or {})}, timeout=PATIENCE).stdout


def elapsed(work: Callable[[], object]) -> float:
    """Seconds that a work takes."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def interleaved(
    runs: dict[str, Run], rounds: int, clock: Callable[[], int] | None = None
) -> dict[str, NDArray[np.float64]]:
    """ns for each of what the runs count, `rounds` times in turn.

    By a clock, else by the processor time of the thread; of the process for JAX, which has others.
    """
    found = {name: np.empty(rounds) for name in runs}
    for i in range(rounds):
        for name, run in runs.items():
            now = clock or (time.process_time_ns if name == "JAX" else time.thread_time_ns)
            begin = now()
            count = run()
            found[name][i] = (now() - begin) / count
    return found

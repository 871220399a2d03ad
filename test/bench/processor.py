"""The class of this machine's processor, by which aims are stated: its speed and its vectors.

Times of work are aims for a processor on which scalar C takes SCALAR_C for an impact; on a slower
one they are as much longer. Where the lanes are compared with code that has no vectors of its own
width, the aim depends on the widest vectors. Waits of real time are the same everywhere.
"""

from __future__ import annotations

import tempfile
import time
from functools import cache
from pathlib import Path
from statistics import median

import numpy as np

from bench.c_reference import CReference

SCALAR_C = 80.0  # ns an impact, period-1
IMPACTS, ROUNDS = 2000, 50


@cache
def scalar_c() -> float:
    """Time of an impact of scalar C, ns; SCALAR_C where there is no compiler."""
    if CReference.missing():
        return SCALAR_C
    from bench.axial import REGIMES, RESTITUTION  # compiled code: only where it is used

    regime, out = REGIMES[0], np.empty((IMPACTS, 2))
    launch = (regime.axial_forcing, RESTITUTION, regime.phase, regime.speed)
    with tempfile.TemporaryDirectory() as folder:
        c = CReference(Path(folder))
    times = []
    for _ in range(ROUNDS):
        begin = time.perf_counter_ns()
        c.impacts(*launch, out)
        times.append((time.perf_counter_ns() - begin) / IMPACTS)
    return median(times)


def work(at_most: float) -> float:
    """Bound of a time of work on this processor, from that on one of SCALAR_C."""
    return at_most * max(1.0, scalar_c() / SCALAR_C)


def flags() -> set[str]:
    """What the processor can do, by the names of /proc/cpuinfo."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    return set(next((line.split(":")[1] for line in lines if line.startswith("flags")), "").split())


def vectors() -> str:
    """Name of the widest vectors."""
    found = flags()
    return next((name for name in ("AVX-512F", "AVX2") if name.replace("-", "").lower() in found),
                "SSE2")  # fmt: skip


def by_vectors(wide: float, narrow: float) -> float:
    """The first of two aims with AVX-512, else the second."""
    return wide if vectors() == "AVX-512F" else narrow

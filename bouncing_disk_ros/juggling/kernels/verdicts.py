"""What a run of a closed loop is judged by, for kernels and for Python: draws, and the verdict."""

from __future__ import annotations

import math

import numpy as np
from numba import types

from bouncing_disk_ros.core.arithmetic import TWO_PI, entry, rare_kernel
from bouncing_disk_ros.juggling.kernels.offset_plan import Array

NEVER, CAPTURED, LOST = 0, 1, 2
"""Verdicts: never near the orbit for long enough; near it up to now; once, and not now."""
VERDICT, COUNT, NEAR, REACHED, OFF_PHASE, OFF_VELOCITY = range(6)
"""Of a tally: verdict so far, impacts, those near the orbit without a break up to now, the number
of the first of these, and how far the last impact was from the orbit (rad, πg/ω)."""
TALLY = 6


@rare_kernel
def apart(t: float, phase: float) -> float:
    """Shortest angular distance of an instant from a forcing phase, in [−π, π]."""
    off = t - phase
    return off - TWO_PI * math.floor(off / TWO_PI + 0.5)


@entry(types.float64(types.int64, types.int64, types.int64))
def draw(seed: int, start: int, count: int) -> float:
    """A number in [0, 1) that these three decide: splitmix64."""
    z = np.uint64(seed) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(start) * np.uint64(
        0xD1342543DE82EF95
    )
    z += np.uint64(count + 1) * np.uint64(0x2545F4914F6CDD1D)
    for _ in range(2):
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) * 2.0**-53


@entry(
    types.void(
        types.float64[::1], types.float64[:, ::1], types.float64, types.float64, types.boolean,
        types.float64, types.int64,
    )
)  # fmt: skip
def note_impact(
    tally: Array, orbit: Array, phase: float, velocity: float, rests: bool, tolerance: float,
    streak: int,
) -> None:  # fmt: skip
    """Count an impact: forcing phase, velocity after it (πg/ω), whether the disk rests then."""
    nearest = math.inf
    for point in orbit:
        off, fast = abs(apart(phase, point[0])), abs(velocity - point[1])
        if max(off, fast) < nearest:
            nearest = max(off, fast)
            tally[OFF_PHASE], tally[OFF_VELOCITY] = off, fast
    tally[COUNT] += 1
    tally[NEAR] = tally[NEAR] + 1 if nearest <= tolerance and not rests else 0
    if tally[NEAR] == 1:
        tally[REACHED] = tally[COUNT]
    if tally[NEAR] >= streak:
        tally[VERDICT] = CAPTURED
    elif tally[VERDICT] == CAPTURED:
        tally[VERDICT] = LOST

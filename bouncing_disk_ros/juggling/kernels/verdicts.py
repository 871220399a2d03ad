"""The verdict on a run of a closed loop, for kernels and for Python."""

from __future__ import annotations

import math

from numba import types

from bouncing_disk_ros.core.arithmetic import shortest_angle
from bouncing_disk_ros.core.compilation import entry
from bouncing_disk_ros.juggling.kernels.offset_plan import Array

NEVER, CAPTURED, LOST = 0, 1, 2
"""Verdicts: never near the orbit for long enough; near it up to now; once, and not now."""
VERDICT, COUNT, NEAR, REACHED, OFF_PHASE, OFF_VELOCITY = range(6)
"""Of a tally: verdict so far, impacts, those near the orbit without a break up to now, the number
of the first of these, and how far the last impact was from the orbit (rad, πg/ω)."""
TALLY = 6


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
        off, fast = abs(shortest_angle(phase, point[0])), abs(velocity - point[1])
        if off < nearest and fast < nearest:  # NaN, of a velocity that is not known, is not near
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

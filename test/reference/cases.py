"""Examples of slow tests: how many, from which seed; and what several reference tests share."""

from __future__ import annotations

import math
import os

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


def axial_amplitude(axial_forcing: float, frequency: float, disk: Disk) -> float:
    """A of a given Γ = A ω²/(π g), m."""
    gravity = disk.gravity + disk.preload / disk.mass
    return axial_forcing * math.pi * gravity / (math.tau * frequency) ** 2

"""Whether recorded impacts lie on the platform that the record describes.

An impact's row has the height and the forcing phase at which it took place. Where the platform
moved as the record says, the height is that of the platform, and phases advance by 2π f.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Motion
from bouncing_disk_ros.report.estimate import precision_of
from bouncing_disk_ros.report.recorded_offset import Offsets, axial_offset
from bouncing_disk_ros.report.section import single_impacts

_ROUNDINGS = 8.0
"""Values within so many roundings of one another are equal: a sine, a product, three sums."""


class OffPlatform(NamedTuple):
    """Impacts that are off the platform of the record by more than rounding."""

    impacts: int  # so many of `of`
    of: int  # single impacts whose platform is known
    farthest: float  # m; nan: only their phases do not fit

    def __str__(self) -> str:
        """In words that follow "the record of the platform is wrong: "."""
        far = "by their phase" if math.isnan(self.farthest) else f"by up to {self.farthest:.3g} m"
        return f"{self.impacts} of {self.of} impacts are off the platform of the record, {far}"


NONE_OFF = OffPlatform(0, 0, math.nan)


def off_platform(rows: NDArray[np.void], motion: Motion | None, offsets: Offsets) -> OffPlatform:
    """How many rows (IMPACT_DTYPE) of one segment are not where its platform was."""
    if motion is None:
        return NONE_OFF
    rows = rows[single_impacts(rows)]
    height = axial_offset(rows["time"], offsets)
    known = np.isfinite(height)
    rows, height = rows[known], height[known]
    if not len(rows):
        return NONE_OFF
    sinusoid = motion.axial_amplitude * np.sin(rows["forcing_phase"])
    away = np.abs(rows["axial_position"] - (sinusoid + height))
    tick = np.spacing(rows["time"])
    speed = np.nan_to_num(np.abs(axial_offset(rows["time"], offsets, 1)))
    size = motion.axial_amplitude + np.abs(height)
    allowed = _ROUNDINGS * (precision_of(rows) * size + speed * tick)
    off = away > allowed
    late = ~_advances(rows, motion, tick)
    count = int(np.sum(off | late))
    return OffPlatform(count, len(rows), float(np.max(away[off])) if np.any(off) else math.nan)


def _advances(
    rows: NDArray[np.void], motion: Motion, tick: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Whether the phase of each row has advanced by 2π f since the row before it."""
    passed = np.diff(rows["time"], prepend=rows["time"][:1])
    turned = math.tau * np.diff(rows["cycles"], prepend=rows["cycles"][:1])
    turned += np.diff(rows["forcing_phase"], prepend=rows["forcing_phase"][:1])
    expected = math.tau * motion.frequency * passed
    precise = precision_of(rows)
    allowed = math.tau * motion.frequency * 2.0 * tick + precise * (expected + 2.0 * math.tau)
    good: NDArray[np.bool_] = np.abs(turned - expected) <= _ROUNDINGS * allowed
    return good

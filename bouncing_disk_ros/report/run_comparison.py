"""Two runs to be shown over each other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.report.orbit import Orbit, orbit_of


class Shown(NamedTuple):
    """What is shown of one run."""

    label: str
    impacts: int  # single ones, those counted in a row included
    rows: NDArray[np.void]  # the newest, IMPACT_DTYPE
    samples: NDArray[np.void]  # over the whole run: time_ns, axial_position, angular_velocity, ...
    detail: NDArray[np.void]  # the same fields, finer, where the two part; may be empty
    rotor_speed: float  # mean of the end, rad/s
    steady_since: float  # simulated time since which the platform's motion is steady, s

    @property
    def orbit(self) -> Orbit:
        """The orbit found at the end of the run."""
        return orbit_of(self.rows[self.rows["time"] >= self.steady_since])

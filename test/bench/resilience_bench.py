"""Resilience and curves: what needs a million starts, and a curve of a thousand points."""

from __future__ import annotations

import numpy as np

from bench.processor import work
from bench.table import Aim, Row, row
from bench.turns import elapsed
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.periodic_orbit import fixed_point
from bouncing_disk_ros.maps.window_basins import label_window
from bouncing_disk_ros.orbit_studies.fatal_changes import FatalRule
from bouncing_disk_ros.orbit_studies.orbit_branch import orbit_curve
from bouncing_disk_ros.orbit_studies.orbit_curves import Curve, Window
from bouncing_disk_ros.orbit_studies.resilience.measures import measure as measure_attractor

PART = "resilience"
STARTS = 1000
"""Along each side of the window."""
WINDOW = Window((0.05, 1.2), (0.02, 0.98))
ROUNDS = 3


def measure() -> list[Row]:
    """The rows of this part."""
    section = NextCollisionMap(0.45, 0.5)

    def all_measures() -> None:
        window = label_window(section, STARTS, -5.0)
        for label in range(len(window.known.found)):
            measure_attractor(section, window, label, 32, np.array([10.0]), FatalRule())

    def curve() -> Curve:
        return orbit_curve(fixed_point(0.45, 0.5), "doubling", WINDOW, largest_step=0.002)

    times = [(elapsed(all_measures), elapsed(curve)) for _ in range(ROUNDS)]
    all_, curves = zip(*times, strict=True)
    points = len(curve().axial_forcing)
    per = [1000.0 * seconds / points for seconds in curves]
    return [
        row(
            PART,
            "all measures at one value, 10⁶ starts, one core",
            "s",
            all_,
            Aim(at_most=work(10.0)),
        ),
        row(
            PART,
            "1000 points of a curve, with its special points",
            "s",
            per,
            Aim(at_most=work(2.0)),
        ),
    ]

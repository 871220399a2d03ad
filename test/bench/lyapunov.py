"""Means and Lyapunov exponents of many trajectories: the lanes beside the scalar map."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bench.axial import RESTITUTION, Regime
from bouncing_disk_ros.maps.lanes.attractor_lanes import measure_attractors
from bouncing_disk_ros.maps.rotation_map import LYAPUNOV, measure_attractor

TRAJECTORIES, FEW = 1024, 16  # in the lanes; one by one
SETTLING, MEASURED, KEPT = 100, 100, 10


def lyapunov_runs(regime: Regime) -> dict[str, Callable[[], int]]:
    """What measures starts near those of a regime; each returns its impacts.

    Lanes and scalar map must agree in the mean exponent, or it raises AssertionError.
    """
    n = TRAJECTORIES
    starts = np.tile([regime.phase, -regime.speed / RESTITUTION, 0.0, 1.0, 0.0], (n, 1))
    starts[:, 0] += 1e-4 * np.arange(n) / n
    parameters = np.tile([regime.axial_forcing, RESTITUTION, -0.7, 100.0], (n, 1))
    rows, results = np.empty((n, KEPT, 6)), np.empty((n, 5))

    def lanes() -> int:
        measure_attractors(starts.copy(), parameters, SETTLING, MEASURED, rows, results)
        return n * (SETTLING + MEASURED)

    def scalar(few: int = FEW) -> int:
        for i in range(few):
            state, given = starts[i].copy(), (*parameters[i], SETTLING, MEASURED)
            measure_attractor(state, *given, rows[i], results[i])
        return few * (SETTLING + MEASURED)

    found = []
    for run in (lanes, lambda: scalar(n)):
        run()
        found.append((results[:, LYAPUNOV].mean(), results[:, LYAPUNOV].var(ddof=1) / n))
    apart, error = abs(found[0][0] - found[1][0]), (found[0][1] + found[1][1]) ** 0.5
    assert apart <= 1e-6 + 5.0 * error, f"exponents of lanes and scalar map are {apart:.3g} apart"
    return {"lanes": lanes, "scalar": scalar}

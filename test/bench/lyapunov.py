"""Means and Lyapunov exponents: lanes and scalar map, beside pynamicalsys on the same map.

pynamicalsys is given this package's map and its tangent as compiled functions, so that the times
differ by what goes on around them. All take the largest exponent; this package takes the means of
the rotation besides.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bench.axial import RESTITUTION, Regime
from bench.many_references import missing
from bouncing_disk_ros.maps.axial_map import flight_tangent, next_impact
from bouncing_disk_ros.maps.lanes.attractor_lanes import measure_attractors
from bouncing_disk_ros.maps.rotation_map import LYAPUNOV, measure_attractor

Floats = NDArray[np.float64]
PYNAMICALSYS = "pynamicalsys"
TRAJECTORIES, FEW = 1024, 16  # in the lanes; one by one
SETTLING, MEASURED, KEPT = 100, 100, 10
COMPARED, AGREEMENT = 10, 1e-12  # impacts; of an exponent, after a change has grown some 50 times


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
    runs = {"lanes": lanes, "scalar": scalar}
    if not missing(PYNAMICALSYS):
        runs[PYNAMICALSYS] = _by_pynamicalsys(starts, parameters[0])
    return runs


@njit
def _step(state: Floats, parameters: Floats) -> Floats:
    """The impact that follows."""
    _, tau, w, _ = next_impact(state[0], state[1], parameters[0], parameters[1])
    return np.array([tau, w])


@njit
def _tangent(state: Floats, parameters: Floats, *_: object) -> Floats:
    """The derivatives of `_step`."""
    tau, w = state
    _, _, w1, delay = next_impact(tau, w, parameters[0], parameters[1])
    t = flight_tangent(tau, w, delay, w1, parameters[0], parameters[1])
    return np.array([[t[0], t[1]], [t[2], t[3]]])


def _by_pynamicalsys(starts: Floats, parameters: Floats) -> Callable[[], int]:
    """The exponents of the first starts; those of few impacts must be the scalar map's."""
    from pynamicalsys import DiscreteDynamicalSystem

    system = DiscreteDynamicalSystem(
        mapping=_step, jacobian=_tangent, system_dimension=2, number_of_parameters=2
    )

    def largest(start: Floats, impacts: int, settling: int) -> float:
        given = {"parameters": parameters[:2], "transient_time": settling}
        return float(
            np.squeeze(system.lyapunov(start[:2], impacts, method="ER", num_exponents=1, **given))
        )

    impacts = FEW * (SETTLING + MEASURED)

    def run() -> int:  # one long orbit: a call from Python costs as much as many impacts
        largest(starts[0], impacts, SETTLING)
        return impacts

    run()
    rows, results = np.empty((1, 6)), np.empty(5)
    for start in starts[:FEW]:
        state = start.copy()
        measure_attractor(state, *parameters, 0, 1, rows, results)
        state[3:] = 1.0, 0.0  # the vector that both follow, from the impact after the start
        measure_attractor(state, *parameters, 0, COMPARED, rows, results)
        apart = abs(largest(start, COMPARED, 0) - results[LYAPUNOV])
        assert apart <= AGREEMENT, f"an exponent by pynamicalsys is {apart:.3g} apart"
    return run

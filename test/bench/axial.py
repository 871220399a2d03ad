"""The axial problem by the core's own functions: impacts without rotation, books or rows.

Dimensionless as in the paper: time 1/ω, length πg/ω², so A is Γ, g is 1/π and ω is 1.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bouncing_disk_ros.core import platform
from bouncing_disk_ros.core.arithmetic import sincos
from bouncing_disk_ros.core.compilation import EntryCompiler
from bouncing_disk_ros.core.flight import Launch, search_impact
from bouncing_disk_ros.core.forcing_clock import Clock, clock_after
from bouncing_disk_ros.core.model import Motion

FREQUENCY = 1.0 / math.tau
GRAVITY = 1.0 / math.pi
RESTITUTION = 0.5


class Regime(NamedTuple):
    """A forcing, and the launch (forcing phase, relative speed) that the run starts from."""

    name: str
    axial_forcing: float
    phase: float
    speed: float


def period_one(axial_forcing: float) -> tuple[float, float]:
    """Forcing phase and relative speed after the impacts of the period-1 orbit (paper, eq. 4)."""
    ratio = (1.0 - RESTITUTION) / (1.0 + RESTITUTION)
    return math.acos(ratio / axial_forcing), 2.0 * RESTITUTION / (1.0 + RESTITUTION)


#: Γ = 0.45: the stable period-1 orbit, entered a little beside it. Γ = 0.55: the chaotic attractor,
#: from a launch whose first 20 impacts magnify a difference only tenfold, so that peers can be
#: compared.
REGIMES = (
    Regime("period-1", 0.45, period_one(0.45)[0] + 1e-3, period_one(0.45)[1]),
    Regime("chaos", 0.55, 1.5, 0.7),
)


def starts(regime: Regime, n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """States (τ, w) before n impacts near that which launches the regime."""
    tau = regime.phase + 1e-4 * np.arange(n) / n
    return tau, np.full(n, -regime.speed / RESTITUTION)


def motion_of(axial_forcing: float) -> NDArray[np.void]:
    """The platform's motion as the kernels read it."""
    steady = platform.steady(Motion(axial_forcing, 0.0, FREQUENCY, 0.0), 0, 0, 0.0)
    return platform.without_offset(steady)


@njit(error_model="numpy", nogil=True, pipeline_class=EntryCompiler)
def impacts(
    motions: Any, g: float, restitution: float, tau: float, u: float, out: NDArray[np.float64]
) -> int:
    """Fill out (n, 2) with the phase and |w_A| of n impacts after a launch; the whole cycles."""
    motion = motions[0]
    cycles = 0
    for i in range(len(out)):
        s, c = sincos(tau)
        jet = platform.axial_jet(motion, s, c, 0.0)
        d, w, _ = search_impact(motion, Launch(0.0, s, c, g, 0.0, u), jet, 0.0, math.inf)
        _, _, cycles, tau = clock_after(motion, Clock(0, 0.0, cycles, tau), d)
        u = -restitution * w
        out[i, 0] = tau
        out[i, 1] = -w
    return cycles

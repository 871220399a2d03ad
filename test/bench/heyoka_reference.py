"""The same problem by heyoka: scalar Taylor integration, event detection, full precision.

It integrates the gap y (y'' = Γ sin t − 1/π), the form in which it is fastest. Every flight starts
a hair above zero: started at zero it takes the launch for an impact or passes a short flight.
"""

from __future__ import annotations

import importlib.util
import math
import time
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.axial import GRAVITY, RESTITUTION, Regime

HAIR = 1e-12


class _Impact:
    """What happens at an impact; heyoka calls it."""

    def __init__(self) -> None:
        self.times: list[float] = []

    def __call__(self, integrator: Any, _: int) -> bool:
        state = integrator.state
        state[0] = HAIR
        state[1] *= -RESTITUTION
        self.times.append(integrator.time)
        return True


class HeyokaReference:
    """One integrator, set back to a regime's launch for every run."""

    def __init__(self, regime: Regime) -> None:
        import heyoka

        self._regime = regime
        y, v = heyoka.make_vars("y", "v")
        falling = heyoka.event_direction.negative
        event = heyoka.t_event(y, callback=_Impact(), direction=falling)
        self._integrator = heyoka.taylor_adaptive(
            [(y, v), (v, heyoka.par[0] * heyoka.sin(heyoka.time) - GRAVITY)],
            [0.0, 0.0],
            t_events=[event],
            pars=[regime.axial_forcing],
        )
        self._impact: _Impact = self._integrator.t_events[0].callback  # heyoka keeps a copy

    def impacts(self, cycles: int) -> int:
        """Run for a number of forcing cycles; returns how many impacts there were."""
        self._impact.times.clear()
        ta, regime = self._integrator, self._regime
        ta.reset_cooldowns()
        ta.time = regime.phase
        ta.state[:] = HAIR, regime.speed
        ta.propagate_until(regime.phase + cycles * math.tau)
        return len(self._impact.times)

    def callback_ns(self, repeats: int = 100) -> float:
        """Time of one call of the Python callback, ns: what a C++ callback would save at most."""
        self._integrator.state[:] = HAIR, 1.0
        times = []
        for _ in range(100):
            begin = time.perf_counter_ns()
            for _ in range(repeats):
                self._impact(self._integrator, -1)
            times.append((time.perf_counter_ns() - begin) / repeats)
        return median(times)

    @property
    def phases(self) -> NDArray[np.float64]:
        """Forcing phases of the impacts of the last run."""
        return np.array(self._impact.times) % math.tau

    @staticmethod
    def missing() -> str:
        """Why it cannot be had, or ''."""
        return "" if importlib.util.find_spec("heyoka") else "heyoka is not installed"

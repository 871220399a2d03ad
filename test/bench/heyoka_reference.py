"""The same problem by heyoka: Taylor integration, event detection, full precision.

It integrates the gap y (y'' = Γ sin t − 1/π), the form in which it is fastest. Every flight starts
a hair above zero: started at zero it takes the launch for an impact or passes a short flight.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.axial import GRAVITY, RESTITUTION

Floats = NDArray[np.float64]
Impact = Callable[..., bool]
"""What happens at an impact, of trajectory `i` in a batch: called with integrator, sign and i."""
HAIR = 1e-12


def integrator_of(axial_forcing: float, size: int, impact: Impact, *, has_phase: bool) -> Any:
    """A scalar integrator (size 0) or one of a batch; the phase is a state, or the time itself."""
    import heyoka

    y, v, phase = heyoka.make_vars("y", "v", "phase")
    fall = heyoka.par[0] * heyoka.sin(phase if has_phase else heyoka.time) - GRAVITY
    system = [(y, v), (v, fall), (phase, heyoka.expression(1.0))][: 2 + has_phase]
    falls, start = heyoka.event_direction.negative, np.zeros((len(system), max(size, 1)))
    if size:
        event = heyoka.t_event_batch(y, callback=impact, direction=falls)
        forcings = np.full((1, size), axial_forcing)
        return heyoka.taylor_adaptive_batch(system, start, t_events=[event], pars=forcings)
    event = heyoka.t_event(y, callback=impact, direction=falls)
    return heyoka.taylor_adaptive(system, start[:, 0], t_events=[event], pars=[axial_forcing])


def batch_size(*, batch: bool) -> int:
    """How many trajectories the processor's vectors hold; 0: no batch."""
    import heyoka

    return int(heyoka.recommended_simd_size()) if batch else 0


class ByHeyoka:
    """One integrator for a trajectory, or for a batch of them."""

    def __init__(self, axial_forcing: float, *, batch: bool) -> None:
        size = self._size = batch_size(batch=batch)
        times, counter = list[float](), [0]

        def impact(integrator: Any, _: int, i: int = 0) -> bool:
            state[0, i] = HAIR
            state[1, i] *= -RESTITUTION
            counter[0] += 1
            if i == 0:
                times.append(integrator.time[0] if size else integrator.time)
            return True

        self._impact, self._counter = impact, counter
        self.times = times  # of the first trajectory, in the last run
        self._integrator = integrator_of(axial_forcing, size, impact, has_phase=False)
        state = self._state = self._integrator.state.reshape(2, -1)  # a view

    def iterate(self, tau: Floats, w: Floats, cycles: int) -> int:
        """Run the first trajectories for some forcing cycles; how many impacts there were."""
        ta, first = self._integrator, tau[: max(self._size, 1)]
        end: Any = first + cycles * math.tau
        ta.reset_cooldowns()
        if self._size:
            ta.set_time(first)
        else:
            ta.time, end = float(first[0]), end[0]
        self._state[0], self._state[1] = HAIR, -RESTITUTION * w[: len(first)]
        self.times.clear()
        before = self._counter[0]
        ta.propagate_until(end)
        return self._counter[0] - before

    def callback_ns(self, repeats: int = 100) -> float:
        """Time of one call of the Python callback, ns: what a C++ callback would save at most."""
        self._state[:, 0] = HAIR, 1.0
        times = []
        for _ in range(100):
            begin = time.perf_counter_ns()
            for _ in range(repeats):
                self._impact(self._integrator, -1)
            times.append((time.perf_counter_ns() - begin) / repeats)
        return median(times)

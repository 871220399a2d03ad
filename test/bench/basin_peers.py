"""Peers that label a basin map: heyoka, one trajectory or a batch at a time, and SciPy.

They integrate the gap y'' = Γ sin t − 1/π and watch for y = 0. Every flight starts a hair above
zero, 1e-12 of its height, so that the bounces of a chatter stay what they are. The rule is that of
the lanes, impact after impact from the start: the label of contact where the rest of the chatter is
complete to rounding, 1 after `confirm` impacts in a row near the point, −1 after `cap` impacts.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.axial import GRAVITY, RESTITUTION
from bench.heyoka_reference import HAIR, batch_size, integrator_of
from bench.many_references import flight
from bouncing_disk_ros.core.chatter import chatter_scale as chatter_scale_kernel
from support.kernels import from_python

chatter_scale = from_python(chatter_scale_kernel)

Floats = NDArray[np.float64]
Labels = NDArray[np.int32]
CONTACT, POINT, OPEN = 0, 1, -1
FAR = 1e9  # rad; no trajectory of 300 impacts gets there
IDLE = (1.0, -1.0)


class Rule(NamedTuple):
    """Γ, the one point of the attractor, and when a start is decided."""

    axial_forcing: float
    point: tuple[float, float]
    tolerance: float
    confirm: int
    cap: int


class _Start:
    """One start under the rule: `after` says what becomes of it at each impact."""

    def __init__(self, rule: Rule) -> None:
        self.place, self.label = -1, OPEN
        self._rule = rule
        self._near = self._left = 0
        self._scale = chatter_scale(RESTITUTION)
        most = GRAVITY + rule.axial_forcing  # of a below: a faster impact completes no chatter
        self._slow = -((self._scale * most**4 / rule.axial_forcing) ** (1.0 / 3.0)) / RESTITUTION

    def begin(self, place: int, tau: float, w: float) -> bool:
        """Take start number `place`; True if it is decided at once."""
        self.place, self._near, self._left = place, 0, self._rule.cap
        self.label = CONTACT if w >= self._slow and self._complete(tau, w) else OPEN
        return self.label == CONTACT

    def _complete(self, tau: float, w: float) -> bool:
        """The bound of `core.chatter.may_end`: what the closed form leaves out is rounding."""
        axial_forcing, u = self._rule.axial_forcing, -RESTITUTION * w
        a, jerk = GRAVITY - axial_forcing * math.sin(tau), axial_forcing * math.cos(tau)
        return a > 0.0 and u**3 * (jerk * jerk + axial_forcing * a) <= self._scale * a**5

    def after(self, tau: float, w: float) -> bool:
        """Note an impact; True if the start is decided."""
        rule = self._rule
        self._left -= 1
        near = False
        if abs(w - rule.point[1]) <= rule.tolerance:
            apart = abs(tau % math.tau - rule.point[0])
            near = min(apart, math.tau - apart) <= rule.tolerance
        self._near = self._near + 1 if near else 0
        if self._near >= rule.confirm:
            self.label = POINT
            return True
        if w >= self._slow and self._complete(tau, w):
            self.label = CONTACT
            return True
        return self._left <= 0


def launch(w: float) -> tuple[float, float]:
    """Gap and speed at the begin of the flight after an impact."""
    u = -RESTITUTION * w
    return HAIR * u * u, u


class _Queue:
    """Starts that wait: each undecided one is given out as the state (y, v, phase) to fly from."""

    def __init__(self) -> None:
        self.labels = np.empty(0, np.int32)
        self.open = 0

    def fill(self, tau: Floats, w: Floats, labels: Labels) -> None:
        """Take new starts, whose labels go into `labels`."""
        self._starts = iter([*enumerate(zip(tau.tolist(), w.tolist(), strict=True))])
        self.labels, self.open = labels, len(labels)

    def keep(self, start: _Start) -> None:
        """Write the label of a start that is decided."""
        if start.place >= 0:
            self.labels[start.place] = start.label
            self.open -= 1

    def give(self, start: _Start) -> tuple[float, float, float]:
        """The next one, as `start`; where nothing is left, one that bounces on and is not kept."""
        for place, (tau, w) in self._starts:
            if not start.begin(place, tau, w):
                return (*launch(w), tau)
            self.keep(start)
        start.begin(-1, *IDLE)
        return (*launch(IDLE[1]), IDLE[0])


class ByHeyoka:
    """Full precision. The phase is a state, so that a decided start gives way to the next at once.

    `batch`: as many at a time as the processor's vectors hold, else the scalar integrator.
    """

    def __init__(self, rule: Rule, *, batch: bool) -> None:
        size = batch_size(batch=batch)
        starts = self._starts = [_Start(rule) for _ in range(max(size, 1))]
        queue = self._queue = _Queue()

        def impact(_: Any, __: int, i: int = 0) -> bool:
            start, w = starts[i], state.item(1, i)
            if start.after(state.item(2, i), w):
                queue.keep(start)
                state[0, i], state[1, i], state[2, i] = queue.give(start)
                return queue.open > 0
            state[0, i], state[1, i] = launch(w)
            return True

        self._integrator = integrator_of(rule.axial_forcing, size, impact, has_phase=True)
        self._until = np.full(size, FAR) if batch else FAR
        state = self._state = self._integrator.state.reshape(3, -1)  # a view

    def label(self, tau: Floats, w: Floats, labels: Labels) -> None:
        """Label starts."""
        ta = self._integrator
        self._queue.fill(tau, w, labels)
        for i, start in enumerate(self._starts):
            self._state[:, i] = self._queue.give(start)
        ta.reset_cooldowns()
        if self._queue.open:
            ta.propagate_until(self._until + ta.time)


class ByScipy:
    """DOP853 with an event at rtol 1e-9 (tighter is slower still), one flight after the other."""

    def __init__(self, rule: Rule) -> None:
        self._start, self._forcing = _Start(rule), rule.axial_forcing

    def label(self, tau: Floats, w: Floats, labels: Labels) -> None:
        """Label starts."""
        start = self._start
        for i in range(len(tau)):
            phase, speed = float(tau[i]), float(w[i])
            decided = start.begin(i, phase, speed)
            while not decided:
                phase, speed = flight(phase, launch(speed), self._forcing)
                decided = start.after(phase, speed)
            labels[i] = start.label

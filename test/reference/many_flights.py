"""Flights of runs with offset trajectories, many at once: no impact missed, by a second method.

From the begin of a flight on, steps that a bound of the relative acceleration allows go to its end.
Each piece of the offset has a bound of its own, from the Bernstein coefficients of its second
derivative. Nothing is shared with the core but the rows of impacts.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from reference.offset_flights import axial_pieces, flights
from reference.offset_path import Piece
from support.offset_runs import OffsetRun, random_run

Column = NDArray[np.float64]

_ROUNDED = 1e-12  # s: the time of an impact that a knot brings about may round to before it
_DEPTH = 1e-13  # of the lengths involved: rounding of the distance
_LEAST = 1e-7  # of 1/ω: the least step; closer to the end of a flight nothing can be told apart
_MOST_STEPS = 100_000
_TERMS = 6
_WEIGHTS = {
    1: ((1, -1), (0, 1)),
    2: ((1, 0, -3, 2), (0, 1, -2, 1), (0, 0, 3, -2), (0, 0, -1, 1)),
    3: (
        (1, 0, 0, -10, 15, -6),
        (0, 1, 0, -6, 8, -3),
        (0, 0, 0.5, -1.5, 1.5, -0.5),
        (0, 0, 0, 10, -15, 6),
        (0, 0, 0, -4, 7, -3),
        (0, 0, 0, 0.5, -1, 0.5),
    ),
}
"""Powers of x in each function of Hermite's basis: lines, cubics, quintics."""


def axial_run(seed: int) -> OffsetRun:
    """A random run of which only the axial joint has trajectories: cheaper, for many."""
    run = random_run(seed)
    return run._replace(trajectories=tuple(one._replace(angular=()) for one in run.trajectories))


class _Run(NamedTuple):
    """What a flight needs of its run; of many flights columns."""

    amplitude: Any
    omega: Any
    phase: Any
    gravity: Any


class ManyFlights:
    """Flights of many runs, gathered by `add` and checked together by `missed`."""

    def __init__(self) -> None:
        self._pieces: list[tuple[float, ...]] = []  # begin, end, duration, bound, coefficients
        self._flights: list[tuple[float, ...]] = []  # begin, length, u, piece, run's four
        self._sources: list[OffsetRun] = []
        self._of: list[int] = []

    def __len__(self) -> int:
        return len(self._flights)

    def add(self, run: OffsetRun, rows: NDArray[np.void]) -> None:
        """The flights between the impacts of a run."""
        first = len(self._pieces)
        found = axial_pieces(run, float)
        begins = np.array([*(one.begin for one in found), math.inf])
        ends = begins[1:].tolist()  # a splice ends a piece before its time
        self._pieces += [_piece(one, end) for one, end in zip(found, ends, strict=True)]
        motion = run.motion
        constants = _Run(
            motion.axial_amplitude,
            math.tau * motion.frequency,
            run.initial.forcing_phase,
            run.disk.gravity,
        )
        for one in flights(run, rows):
            place = int(np.searchsorted(begins, one.begin + _ROUNDED, side="right")) - 1
            self._flights.append(
                (one.begin, one.end - one.begin, one.speed, first + place, *constants)
            )
            self._of.append(len(self._sources))
        self._sources.append(run)

    def missed(self) -> list[tuple[OffsetRun, float, float]]:
        """Flights that went below the platform before their end: run, begin and how long after."""
        if not self._flights:
            return []
        t0, length, u, place, *rest = np.array(self._flights).T
        piece, pieces = place.astype(np.int64), np.array(self._pieces)
        run = _Run(*rest)
        s0, v0 = _platform(t0, pieces[piece], run)
        path = s0, v0 + u
        d = np.zeros(len(t0))
        active = np.arange(len(t0))
        found: list[tuple[int, float]] = []
        for _ in range(_MOST_STEPS):
            if not len(active):
                return [
                    (self._sources[self._of[i]], self._flights[i][0], after) for i, after in found
                ]
            some = _Run(*(column[active] for column in run))
            at, here = d[active], pieces[piece[active]]
            h, h1 = _relative(t0[active], at, here, some, (path[0][active], path[1][active]))
            h, h1 = np.where(at == 0.0, 0.0, h), np.where(at == 0.0, u[active], h1)
            unit = math.pi * some.gravity / some.omega**2
            below = h < -_DEPTH * (unit + np.abs(path[0][active]))
            found += zip(active[below].tolist(), at[below].tolist(), strict=True)
            least = _LEAST / some.omega
            bound = some.gravity + some.amplitude * some.omega**2 + here[:, 3]
            step = np.maximum(_safe(np.maximum(h, 0.0), h1, bound), least)
            ends = at + step >= length[active] - least
            knot = here[:, 1] - t0[active]
            passes = at + step >= knot
            d[active] = np.where(passes, np.maximum(knot, 0.0), at + step)
            piece[active] += passes
            active = active[~(below | ends)]
        raise AssertionError(f"{len(active)} flights take more than {_MOST_STEPS} steps")


def _piece(one: Piece, end: float) -> tuple[float, ...]:
    """A piece as numbers: begin, end, duration, bound of |p̈|, and the powers of p over it."""
    c = np.zeros(_TERMS)
    duration = 1.0
    if one.kind == 0:
        c[0] = one.values[0]
    else:
        duration = float(one.end - one.begin)
        p0, v0, a0, p1, v1, a1 = (float(value) for value in one.values)
        scaled = {
            1: (p0, p1),
            2: (p0, v0 * duration, p1, v1 * duration),
            3: (p0, v0 * duration, a0 * duration**2, p1, v1 * duration, a1 * duration**2),
        }[one.kind]
        for weights, value in zip(_WEIGHTS[one.kind], scaled, strict=True):
            c[: len(weights)] += np.array(weights) * value
    e = c[2:] * (2.0, 6.0, 12.0, 20.0)
    corners = e[0], e[0] + e[1] / 3, e[0] + (2 * e[1] + e[2]) / 3, float(np.sum(e))
    bound = 1.0001 * max(abs(float(corner)) for corner in corners) / duration**2
    return float(one.begin), end, duration, bound, *c.tolist()


def _platform(t: Column, piece: Column, run: _Run) -> tuple[Column, Column]:
    """Position and velocity of the platform at t, each in its piece."""
    x = (t - piece[:, 0]) / piece[:, 2]
    p, v = np.zeros(len(t)), np.zeros(len(t))
    for order in range(_TERMS - 1, -1, -1):
        v = v * x + p
        p = p * x + piece[:, 4 + order]
    turn = run.omega * t + run.phase
    sine, cosine = np.sin(turn), np.cos(turn)
    return run.amplitude * sine + p, run.amplitude * run.omega * cosine + v / piece[:, 2]


def _relative(
    t0: Column, d: Column, piece: Column, run: _Run, path: tuple[Column, Column]
) -> tuple[Column, Column]:
    """Distance and velocity relative to the platform a time d after t0."""
    s, s1 = _platform(t0 + d, piece, run)
    return path[0] + path[1] * d - 0.5 * run.gravity * d * d - s, path[1] - run.gravity * d - s1


def _safe(h: Column, h1: Column, bound: Column) -> Column:
    """A time in which a distance h > 0 with |ḧ| ≤ bound cannot end."""
    root = np.sqrt(h1 * h1 + 2.0 * bound * h)
    with np.errstate(divide="ignore", invalid="ignore"):
        step = np.where(h1 > 0.0, (h1 + root) / bound, 2.0 * h / (root - h1))
    return np.where(np.isfinite(step), step, 0.0)

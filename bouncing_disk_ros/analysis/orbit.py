"""Which orbit the impacts of a run have settled on, without guessing."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import ImpactKind

REPEATS = 3
"""An orbit counts as found when its rows have repeated this often at the end of the run ..."""
LEAST_ROWS = 8
"""... and over at least this many rows."""
CLEARLY = 10.0
"""Impacts of a longer orbit differ by more than this many tolerances."""


class OrbitKind(StrEnum):
    """What the last impacts show."""

    PERIODIC = "periodic"  # single impacts that repeat
    CHATTERING = "chattering"  # repeats, with a complete chatter and contact in each repetition
    UNRESOLVED = "unresolved"  # too few impacts, not settled, a longer period, or chaos


class Orbit(NamedTuple):
    """An orbit of the next-collision map."""

    kind: OrbitKind
    impacts: int  # rows in one repetition; 0: unresolved
    cycles: int  # periods of the platform in one repetition; 0: unresolved
    forcing_phases: tuple[float, ...]  # τ of each row of the last repetition, rad
    axial_impact_velocities: tuple[float, ...]  # w_A of each, m/s

    @property
    def name(self) -> str:
        """As people say it: period-1, period-2, chattering (3 cycles), unresolved."""
        if self.kind is OrbitKind.PERIODIC:
            name = f"period-{self.impacts}"
            return name if self.impacts == self.cycles else f"{name} in {self.cycles} cycles"
        if self.kind is OrbitKind.CHATTERING:
            return f"chattering ({self.cycles} cycle{'s' if self.cycles > 1 else ''})"
        return str(self.kind)

    @property
    def is_period_one(self) -> bool:
        """One impact in each period of the platform."""
        return self.kind is OrbitKind.PERIODIC and self.impacts == self.cycles == 1


UNRESOLVED = Orbit(OrbitKind.UNRESOLVED, 0, 0, (), ())


def orbit_of(rows: NDArray[np.void], tolerance: float = 1e-3, longest: int = 200) -> Orbit:
    """The orbit at the end of a run, from its impacts under one steady platform motion.

    `rows`: IMPACT_DTYPE in the order of their index. The shortest number of rows (up to `longest`)
    after which forcing phase (to `tolerance` rad), impact velocity (to `tolerance` of the largest
    one), kind and number of cycles repeat, `REPEATS` times. Otherwise UNRESOLVED, also when rows
    were lost (their `index` has a gap), and when a part of the repetition almost repeats by itself
    (within `CLEARLY` tolerances: the run is still settling, or close to a bifurcation).
    """
    rows = rows[-(REPEATS + 1) * longest :]
    gaps = np.flatnonzero(np.diff(rows["index"]) != 1.0)
    rows = rows[gaps[-1] + 1 :] if len(gaps) else rows
    for period in range(1, longest + 1):
        window = max((REPEATS + 1) * period, LEAST_ROWS)
        if window > len(rows):
            break
        last = rows[-window:]
        if _mismatch(last, period) <= tolerance:
            parts = (part for part in range(1, period) if period % part == 0)
            clear = all(_mismatch(last, part) > CLEARLY * tolerance for part in parts)
            return _orbit(rows, period) if clear else UNRESOLVED
    return UNRESOLVED


def _mismatch(rows: NDArray[np.void], period: int) -> float:
    """How far rows are from repeating (rad, or relative speed); inf: cycles or kinds differ."""
    first, second = rows[:-period], rows[period:]
    turned = _turned(first, second)
    if np.any(first["kind"] != second["kind"]) or np.any(turned != turned[0]):
        return math.inf
    if turned[0] < 1.0:  # within one chatter nothing repeats
        return math.inf
    phase = np.abs(_wrapped(second["forcing_phase"] - first["forcing_phase"]))
    speed = np.abs(second["axial_impact_velocity"] - first["axial_impact_velocity"])
    scale = np.max(np.abs(rows["axial_impact_velocity"]))
    return float(max(np.max(phase), np.max(speed) / scale))


def _turned(first: NDArray[np.void], second: NDArray[np.void]) -> NDArray[np.float64]:
    """Cycles between rows, those about phase 0 counted to the nearest whole."""
    wrap = np.round((second["forcing_phase"] - first["forcing_phase"]) / math.tau)
    turned: NDArray[np.float64] = second["cycles"] - first["cycles"] + wrap
    return turned


def _orbit(rows: NDArray[np.void], period: int) -> Orbit:
    turned = _turned(rows[-1 - period : -period], rows[-1:])[0]
    one = rows[-period:]
    single = np.all(one["kind"] == ImpactKind.IMPACT)
    return Orbit(
        OrbitKind.PERIODIC if single else OrbitKind.CHATTERING,
        period,
        int(turned),
        tuple(float(v) for v in one["forcing_phase"]),
        tuple(float(v) for v in one["axial_impact_velocity"]),
    )


def _wrapped(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same angle in [−π, π)."""
    return np.mod(angle + math.pi, math.tau) - math.pi

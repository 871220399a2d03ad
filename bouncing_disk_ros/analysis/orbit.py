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
    were lost (their `index` has a gap).
    """
    rows = rows[-(REPEATS + 1) * longest :]
    gaps = np.flatnonzero(np.diff(rows["index"]) != 1.0)
    rows = rows[gaps[-1] + 1 :] if len(gaps) else rows
    for period in range(1, longest + 1):
        window = max((REPEATS + 1) * period, LEAST_ROWS)
        if window > len(rows):
            break
        if _repeats(rows[-window:], period, tolerance):
            return _orbit(rows, period)
    return UNRESOLVED


def _repeats(rows: NDArray[np.void], period: int, tolerance: float) -> bool:
    first, second = rows[:-period], rows[period:]
    phase = np.abs(_wrapped(second["forcing_phase"] - first["forcing_phase"]))
    speed = np.abs(second["axial_impact_velocity"] - first["axial_impact_velocity"])
    scale = np.max(np.abs(rows["axial_impact_velocity"]))
    turned = second["cycles"] - first["cycles"]
    turned += np.round((second["forcing_phase"] - first["forcing_phase"]) / math.tau)
    return bool(
        np.all(first["kind"] == second["kind"])
        and turned[0] >= 1.0  # within one chatter nothing repeats
        and np.all(turned == turned[0])
        and np.all(phase <= tolerance)
        and np.all(speed <= tolerance * scale)
    )


def _orbit(rows: NDArray[np.void], period: int) -> Orbit:
    last, before = rows[-1], rows[-1 - period]
    turned = last["cycles"] - before["cycles"]
    turned += np.round((last["forcing_phase"] - before["forcing_phase"]) / math.tau)
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

"""The orbit that the impacts of a run have reached; unresolved where it is not certain."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.angles import wrap_to_pi
from bouncing_disk_ros.core.model import Disk, ImpactKind, Motion
from bouncing_disk_ros.field_checks import number, plain, whole
from bouncing_disk_ros.report.estimate import Estimate
from bouncing_disk_ros.report.section import rows_of

if TYPE_CHECKING:
    from bouncing_disk_ros.report.stability import Path

REPEATS = 3
"""An orbit counts as found when its rows have repeated this often at the end of the run ..."""
LEAST_ROWS = 8
"""... and over at least this many rows."""
CLEARLY = 10.0
"""Impacts of a longer orbit differ by more than this many tolerances."""

ROUNDING = 1e-12
"""Changes below this (rad, or relative speed) are rounding."""


class OrbitKind(StrEnum):
    """What the last impacts show."""

    PERIODIC = "periodic"  # single impacts that repeat
    CHATTERING = "chattering"  # repeats, with a complete chatter and contact in each repetition
    CHAOTIC = "chaotic"  # neighbouring orbits part; said only where motion and disk are known
    CONTACT = "in contact"  # for good: the platform cannot throw the disk; said in reports only
    REST = "at rest"  # likewise, and neither platform nor disk moves
    UNRESOLVED = "unresolved"  # too few impacts, not settled, or a longer period


class Orbit(NamedTuple):
    """An orbit of the next-collision map."""

    kind: OrbitKind
    impacts: int  # rows in one repetition; 0: unresolved
    cycles: int  # periods of the platform in one repetition; 0: unresolved
    forcing_phases: tuple[float, ...]  # τ of each row of the last repetition, rad
    axial_impact_velocities: tuple[float, ...]  # w_A of each, m/s
    exponent: Estimate | None = None  # chaotic: the largest Lyapunov exponent, per impact

    @property
    def name(self) -> str:
        """As people say it: period-1, period-2, chattering (3 cycles), unresolved."""
        if self.kind is OrbitKind.PERIODIC:
            name = f"period-{self.impacts}"
            cycles = f"{self.cycles} cycle{'s' if self.cycles > 1 else ''}"
            return name if self.impacts == self.cycles else f"{name} in {cycles}"
        if self.kind is OrbitKind.CHATTERING:
            return f"chattering ({self.cycles} cycle{'s' if self.cycles > 1 else ''})"
        return str(self.kind)

    @property
    def is_period_one(self) -> bool:
        """One impact in each period of the platform."""
        return self.kind is OrbitKind.PERIODIC and self.impacts == self.cycles == 1


UNRESOLVED = Orbit(OrbitKind.UNRESOLVED, 0, 0, (), ())


def orbit_of(
    rows: NDArray[np.void],
    tolerance: float = 1e-3,
    longest: int = 200,
    *,
    motion: Motion | None = None,
    disk: Disk | None = None,
) -> Orbit:
    """Orbit at the end of a run, from its impacts under one steady platform motion.

    `rows`: IMPACT_DTYPE in the order of their index. The shortest number of rows (up to `longest`)
    after which forcing phase (to `tolerance` rad), impact velocity (to `tolerance` of the largest
    one), kind and number of cycles repeat, `REPEATS` times. Otherwise UNRESOLVED, also when rows
    were lost (their `index` has a gap), when a part of the repetition almost repeats by itself
    (within `CLEARLY` tolerances), and when the rows still drift to somewhere else.

    With `motion` and `disk`, and rows that follow their map, the answer rests on the map as well:
    periodic means that a stable cycle of just that period is within `tolerance` of the rows, and
    CHAOTIC is possible (see `stability.chaos_of` for its evidence).

    >>> orbit_of(simulate(60.0, preset="pizza_multiple_toss").impacts).name
    """
    rows, longest = rows_of(rows), whole("longest", plain(longest), 1)
    tolerance = number("tolerance", plain(tolerance), 0.0)
    gaps = np.flatnonzero(np.diff(rows["index"]) != 1.0)
    rows = rows[gaps[-1] + 1 :] if len(gaps) else rows
    path = _path(rows, motion, disk)
    period = _period(rows[-(REPEATS + 1) * longest :], tolerance, longest)
    if period == 0:
        return _chaos(path) if path else UNRESOLVED
    last = rows[-max((REPEATS + 1) * period, LEAST_ROWS) :]
    parts = (part for part in range(1, period) if period % part == 0)
    if any(_mismatch(last, part) <= CLEARLY * tolerance for part in parts):
        return UNRESOLVED
    if path and len(path.tau) > period:
        return _orbit(rows, period) if _on_cycle(path, period, tolerance) else UNRESOLVED
    return UNRESOLVED if _drifts(rows, period, tolerance) else _orbit(rows, period)


def _path(rows: NDArray[np.void], motion: Motion | None, disk: Disk | None) -> Path | None:
    """The impacts at the end that follow the map, where it is known."""
    if motion is None or disk is None:
        return None
    from bouncing_disk_ros.report.stability import path_of  # loads kernels

    return path_of(rows, motion, disk)


def _chaos(path: Path) -> Orbit:
    from bouncing_disk_ros.report.stability import chaos_of

    exponent = chaos_of(path)
    if exponent is None:
        return UNRESOLVED
    return Orbit(OrbitKind.CHAOTIC, 0, 0, (), (), exponent)


def _period(rows: NDArray[np.void], tolerance: float, longest: int) -> int:
    """The shortest number of rows after which they repeat; 0: they do not."""
    for period in range(1, longest + 1):
        window = max((REPEATS + 1) * period, LEAST_ROWS)
        if window > len(rows):
            return 0
        if _mismatch(rows[-window:], period) <= tolerance:
            return period
    return 0


def _on_cycle(path: Path, period: int, tolerance: float) -> bool:
    """Whether the last impacts are within tolerance of a stable cycle of the map."""
    from bouncing_disk_ros.report.stability import cycle_near

    cycle = cycle_near(path, period)
    if cycle is None or not cycle.stable:
        return False
    velocity = cycle.axial_impact_velocity
    phase = np.max(np.abs(wrap_to_pi(path.tau[-period:] - cycle.forcing_phase)))
    speed = np.max(np.abs(path.w[-period:] - velocity)) / np.max(np.abs(velocity))
    return bool(max(phase, speed) <= tolerance)


def _drifts(rows: NDArray[np.void], period: int, tolerance: float) -> bool:
    """Whether rows that repeat within tolerance still creep to somewhere farther away than that.

    The mean change per repetition over the last rows, if it is beyond its scatter, is extrapolated
    as a geometric series whose ratio is that to the rows before; without those nothing is known.
    Two repetitions count as one if there are rows enough: a creep that alternates is one way then.
    """
    for lag in (2 * period, period):
        repeats = max(REPEATS, math.ceil(LEAST_ROWS / lag) - 1)
        length = (repeats + 1) * lag
        if len(rows) >= 2 * length:
            break
    else:
        return False
    late = _changes(rows[-length:], lag)
    before = np.mean(_changes(rows[-2 * length : -length], lag), axis=0)
    now = np.mean(late, axis=0)
    scatter = math.sqrt(float(np.sum((late - now) ** 2)) / (len(late) * (len(late) - 1)))
    size = float(np.linalg.norm(now))
    if size <= max(3.0 * scatter, ROUNDING) or not np.any(before):
        return False
    gain = float(np.sum(now * before) / np.sum(before**2))
    if gain >= 1.0:
        return True
    ratio = max(gain, 0.0) ** (1.0 / (repeats + 1))
    return size * ratio / (1.0 - ratio) > tolerance


def _changes(rows: NDArray[np.void], period: int) -> NDArray[np.float64]:
    """From each repetition to the next: phase and relative speed, shape (repeats, 2 period)."""
    speed = rows["axial_impact_velocity"]
    phase = wrap_to_pi(rows["forcing_phase"][period:] - rows["forcing_phase"][:-period])
    change = (speed[period:] - speed[:-period]) / np.max(np.abs(speed))
    whole = len(phase) // period * period
    return np.stack((phase[-whole:], change[-whole:]), axis=1).reshape(-1, 2 * period)


def _mismatch(rows: NDArray[np.void], period: int) -> float:
    """How far rows are from repeating (rad, or relative speed); inf: cycles or kinds differ."""
    first, second = rows[:-period], rows[period:]
    turned = _turned(first, second)
    if np.any(first["kind"] != second["kind"]) or np.any(turned != turned[0]):
        return math.inf
    if turned[0] < 1.0:  # within one chatter nothing repeats
        return math.inf
    phase = np.abs(wrap_to_pi(second["forcing_phase"] - first["forcing_phase"]))
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

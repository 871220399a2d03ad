"""A controller: impacts in, offset trajectories of the platform out; SI units, whole nanoseconds.

>>> juggler = Juggler("deadbeat", motion, disk)
>>> juggler.on_impact(HeardImpact(0.21, 1.635), now_ns=210_000_000)
OffsetTrajectory(begin_ns=210000000, points=(TrajectoryPoint(...), ...))
"""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.kernels.offset_plan import (
    BEGIN,
    DURATION,
    END,
    ROWS,
    empty_plan,
)
from bouncing_disk_ros.juggling.kernels.strategies import AIM, EPSILON, empty_memory, hear
from bouncing_disk_ros.juggling.kernels.toss_planner import FORCING, OWN_ORBIT
from bouncing_disk_ros.juggling.loop_settings import (
    HEARS_TIMES_ONLY,
    Array,
    Limits,
    check_strategy,
    controller_settings,
    period_one_points,
)
from bouncing_disk_ros.maps.scales import acceleration, axial_forcing_of, velocity_scale

_GIGA = 1e9


class HeardImpact(NamedTuple):
    """What a controller is told of one impact."""

    time: float  # simulated, s
    velocity: float | None = None  # of the disk just after it, absolute, m/s
    rests: bool = False  # whether a chatter ended then, and the disk lies on the platform


class TrajectoryPoint(NamedTuple):
    """A knot of an offset trajectory: when, and position, velocity and acceleration there."""

    at_ns: int
    position: float  # m
    velocity: float  # m/s
    acceleration: float  # m/s²


class OffsetTrajectory(NamedTuple):
    """What takes over from the offset in force at begin_ns; quintics between the points."""

    begin_ns: int
    points: tuple[TrajectoryPoint, ...]


class Controller(Protocol):
    """What the loop and the node `juggle` ask: any object with this method is a controller."""

    def on_impact(self, impact: HeardImpact, now_ns: int) -> OffsetTrajectory | None:
        """Answer an impact that is known at now_ns; None: leave the offset as it is."""


class Juggler:
    """The controller of a strategy of this package, under a steady motion of the platform.

    `restitution`: as believed (None: that of `disk`), corrected by what is heard where `learns`.
    `phase`: forcing phase at simulated time 0. `orbit`: points (forcing phase, velocity after the
    impact in units of πg/ω) to be reached; None: the period-1 orbit. Raises InputError.
    """

    def __init__(
        self, strategy: str, motion: Motion, disk: Disk, *, restitution: float | None = None,
        limits: Limits | None = None, learns: bool = True, phase: float = 1.5 * math.pi,
        orbit: Array | None = None,
    ) -> None:  # fmt: skip
        check_strategy(strategy)
        believed = disk.restitution if restitution is None else restitution
        forcing = axial_forcing_of(motion, disk)
        if not 0.0 < forcing < math.inf:
            raise InputError("axial_amplitude", motion.axial_amplitude, "a platform that moves")
        own = orbit is None
        self.orbit = period_one_points(forcing, believed) if orbit is None else orbit.copy()
        self._settings = controller_settings(
            strategy, forcing, believed, limits or Limits(), learns=learns, own_orbit=own
        )
        self._hears_velocity = strategy not in HEARS_TIMES_ONLY
        self._memory, self._plan = empty_memory(believed), empty_plan()
        self._omega, self._phase = math.tau * motion.frequency, phase
        self._speed = velocity_scale(motion, disk)
        self._length = math.pi * acceleration(disk) / (self._omega * self._omega)

    @property
    def restitution(self) -> float:
        """ε as learned so far."""
        return float(self._memory[EPSILON])

    @property
    def arrives(self) -> float | None:
        """Simulated time, s, at which the plan has the disk on the orbit; None: no plan."""
        at = float(self._memory[AIM])
        return (at - self._phase) / self._omega if math.isfinite(at) else None

    def aim_at(self, orbit: Array | None) -> None:
        """Aim at another orbit from the next impact on; None: the period-1 orbit."""
        self._settings[OWN_ORBIT] = float(orbit is None)
        if orbit is None:
            orbit = period_one_points(float(self._settings[FORCING]), self.restitution)
        self.orbit = orbit.copy()
        self._memory[AIM] = -math.inf

    def take_over(self, other: Juggler) -> None:
        """Go on where another controller of the same platform ends: what it heard and commanded."""
        self._memory[:], self._plan[:] = other._memory, other._plan
        self._memory[AIM] = -math.inf

    def on_impact(self, impact: HeardImpact, now_ns: int) -> OffsetTrajectory | None:
        """Take in an impact; the trajectory that replaces the one in force, or None."""
        velocity = impact.velocity if self._hears_velocity else None
        now = self._instant(now_ns / _GIGA)
        changed = hear(
            self._settings, self.orbit, self._memory, self._plan, self._instant(impact.time),
            math.nan if velocity is None else velocity / self._speed, impact.rests, now,
        )  # fmt: skip
        return self._trajectory(max(now, self._instant(impact.time))) if changed else None

    def _instant(self, seconds: float) -> float:
        return self._phase + self._omega * seconds

    def _ns(self, instant: float) -> float:
        return (instant - self._phase) / self._omega * _GIGA

    def _trajectory(self, now: float) -> OffsetTrajectory:
        """The pieces of the plan from now on; between them its position is held."""
        points: list[TrajectoryPoint] = []
        begin_ns = math.ceil(self._ns(now) - 1e-3)
        end, last = now, np.zeros(3)
        for row in self._plan[:ROWS]:
            if not now <= row[BEGIN] < math.inf:
                continue
            if self._ns(row[BEGIN]) - self._ns(end) > 1.0:
                points.append(self._point(row[BEGIN], np.array([last[0], 0.0, 0.0])))
            end, last = row[BEGIN] + row[DURATION], row[END : END + 3]
            points.append(self._point(end, last))
        return OffsetTrajectory(begin_ns, tuple(points))

    def _point(self, instant: float, state: Array) -> TrajectoryPoint:
        """A knot at a whole nanosecond: its state is that of the same curve at that instant."""
        exact = self._ns(instant)
        at_ns = round(exact)
        late = (at_ns - exact) / _GIGA * self._omega
        p, v, a = (float(value) for value in state)
        p, v = p + late * (v + 0.5 * late * a), v + late * a
        return TrajectoryPoint(
            at_ns, p * self._length, v * self._speed, a * self._speed * self._omega
        )

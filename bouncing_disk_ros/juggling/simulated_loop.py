"""A closed loop in one process: a Simulation, a sensor and a controller; the same bits each time.

>>> simulation = Simulation(motion, disk, InitialState())
>>> result = run_loop(simulation, Juggler("deadbeat", motion, disk), periods=50)
>>> result.verdict
Verdict(outcome=<Outcome.CAPTURED: 1>, impacts=21)
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import ImpactKind, join_rows
from bouncing_disk_ros.core.offset import QUINTIC, Knot, OffsetState
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.juggling.juggler import Controller, HeardImpact, OffsetTrajectory
from bouncing_disk_ros.juggling.kernels.loop_kernel import sensor_error
from bouncing_disk_ros.juggling.loop_settings import Array, Sensor, period_one_points
from bouncing_disk_ros.juggling.loop_verdict import Verdict, verdict_of
from bouncing_disk_ros.juggling.target_orbit import mean_rotor_speed
from bouncing_disk_ros.maps.scales import axial_forcing_of, velocity_scale
from bouncing_disk_ros.units import NS


@dataclass
class LoopRecord:
    """What happened: rows of the impacts (IMPACT_DTYPE), commands and the verdict."""

    rows: NDArray[np.void]
    verdict: Verdict
    commands: list[OffsetTrajectory] = field(default_factory=list)

    def rotor_speed(self, impacts: int = 10) -> float:
        """Mean angular velocity, rad/s, over so many flights at the end; nan: fewer than two."""
        last = self.rows[-impacts - 1 :]
        return mean_rotor_speed(last["time"].tolist(), last["angular_velocity"].tolist())


def knots_of(trajectory: OffsetTrajectory) -> list[Knot]:
    """The points as knots of Simulation.trajectory."""
    return [Knot(p.at_ns, OffsetState(*p[1:]), QUINTIC) for p in trajectory.points]


def heard_of(row: NDArray[np.void] | np.void) -> HeardImpact:
    """What a controller is told of a row of the impact log."""
    rests = int(row["kind"]) == ImpactKind.CHATTER_TAIL
    return HeardImpact(float(row["time"]), float(row["axial_velocity"]), rests)


def hear_row(
    row: NDArray[np.void] | np.void, sensor: Sensor, frequency: float, start: int, number: int
) -> tuple[int, HeardImpact] | None:
    """When a row is known, ns of simulated time, and what is heard of it; None: it is missed.

    `start`, `number`: of the run, and of the row in it, as `sensor_error` takes them.
    """
    off = sensor_error(sensor.missed, sensor.jitter, sensor.seed, start, number)
    if math.isnan(off):
        return None
    impact = heard_of(row)
    known_ns = math.ceil((impact.time + (sensor.delay + sensor.jitter) / frequency) * NS)
    return known_ns, impact._replace(time=impact.time + off / frequency)


def run_loop(
    simulation: Simulation, controller: Controller | None, *, periods: float = 50.0,
    sensor: Sensor | None = None, orbit: Array | None = None, start: int = 0,
    tolerance: float = 0.05, streak: int = 5,
) -> LoopRecord:  # fmt: skip
    """Run to the end of so many periods; each impact reaches the controller when it is due.

    `start`: number of this run; with the sensor's seed it decides delays and misses.
    """
    sensor = sensor or Sensor()
    motion, disk = simulation.latest_target, simulation.disk
    period_ns = NS / motion.frequency
    end_ns = simulation.time_ns + round(periods * period_ns)
    parts: list[NDArray[np.void]] = []
    commands: list[OffsetTrajectory] = []
    waiting: deque[tuple[int, HeardImpact]] = deque()
    drawn = 0
    while simulation.time_ns < end_ns:
        until = min(waiting[0][0] if waiting else end_ns, end_ns)
        rows, behind = simulation.advance(until, 1 if controller else 1_000_000)
        parts.append(rows.copy())
        for row in rows if controller is not None else ():
            heard = hear_row(row, sensor, motion.frequency, start, drawn)
            drawn += 1
            if heard is not None:
                waiting.append(heard)
        if behind or not waiting or simulation.time_ns < waiting[0][0]:
            continue
        known_ns, impact = waiting.popleft()
        answer = controller.on_impact(impact, known_ns) if controller else None
        if answer is not None:
            commands.append(answer)
            simulation.trajectory(answer.begin_ns, axial=knots_of(answer))
    rows = join_rows(parts)
    if orbit is None:
        orbit = period_one_points(axial_forcing_of(motion, disk), disk.restitution)
    scale = velocity_scale(motion, disk)
    found = (
        (float(r["forcing_phase"]), float(r["axial_velocity"]) / scale, heard_of(r).rests)
        for r in rows
    )
    return LoopRecord(rows, verdict_of(found, orbit, tolerance=tolerance, streak=streak), commands)

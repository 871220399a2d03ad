"""A motor's map: the study `motor` beside a loop of `simulate`, and how good its means are."""

from __future__ import annotations

import math
import tempfile
import time
from pathlib import Path

import numpy as np

from bench.processor import work
from bench.studies import on_cores
from bench.table import Aim, Row, row
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.maps.period_one import period_one
from bouncing_disk_ros.motor_study.compute import Motor
from bouncing_disk_ros.motor_study.motor_points import NOT_PERIODIC
from bouncing_disk_ros.run.simulate import simulate
from bouncing_disk_ros.study import named, run

PART = "motor"
ROUNDS = 3
CHECKED = 300
SIMULATED = 20
SETTLING, MEASURED = 300, 512
TRANSIENT = 20_000
"""Periods before the means of the simulation: chaos may come before a cycle for long."""
RUNS = 10
"""Simulations of a motion that does not repeat, with restitutions apart by roundings.

One of them may repeat a cycle that roundings have decided, and its mean is that of no other one.
"""
LONGER = 10
"""Times as many periods as those of the map, where the motion repeats."""
SURE = 3.0
"""Standard errors, of the map and of the simulations, that two means may differ by."""


def measure() -> list[Row]:
    """The rows of this part."""
    study = named("motor")
    assert isinstance(study, Motor)
    seconds = []
    for _ in range(ROUNDS):
        with tempfile.TemporaryDirectory() as folder, on_cores(2):
            begin = time.perf_counter()
            found = run(study, Path(folder, "r"), workers=2)
            seconds.append(time.perf_counter() - begin)
            assert found is not None
            speeds, kinds = found["mean_speed"].values.ravel(), found["kind"].values.ravel()
            errors = found["mean_speed_error"].values.ravel()
            periods = np.maximum(found["measured"].values.ravel(), MEASURED)
    points = [(float(y), float(x)) for y in study.axes["preload"].values
              for x in study.axes["load_torque"].values]  # fmt: skip
    rng = np.random.default_rng(14)
    known = np.flatnonzero(np.isfinite(speeds))
    picked = rng.choice(known, CHECKED, replace=False)
    scale = math.tau * float(study.parameters["frequency"])
    scale *= float(study.parameters["angular_amplitude"])
    repeats, inside = [], []
    for i in picked:
        mean, error = simulated_mean(study, points[i], int(periods[i]), kinds[i] != NOT_PERIODIC)
        off = abs(speeds[i] - mean) / scale
        if kinds[i] != NOT_PERIODIC:
            repeats.append(off)
        inside.append(off <= max(1e-3, SURE * math.hypot(errors[i], error) / scale))
    return [
        row(PART, "swum, preload × load torque 200 × 200, stored, two cores", "s", seconds,
            Aim(at_most=work(10.0))),
        row(PART, "the same by a loop of simulate, one core", "s", _loop(study, points, rng)),
        row(PART, "mean speed within 1e-3 ωΦ or three errors of the mean of simulations", "%",
            [100.0 * float(np.mean(inside))], Aim(at_least=99.0)),
        row(PART, "standard error of the mean speed, where the motion does not repeat", "ωΦ",
            list(errors[known][kinds[known] == NOT_PERIODIC] / scale)),
        row(PART, "the same where the motion repeats: largest difference", "ωΦ", [max(repeats)],
            Aim(at_most=1e-3)),
    ]  # fmt: skip


def begin_of(motion: Motion, disk: Disk) -> InitialState:
    """Where the study starts: beside the period-1 orbit, or on the platform."""
    orbit = period_one(motion, disk)
    if orbit is None:
        return InitialState()
    phase = orbit.forcing_phase + 1e-3
    climb = motion.axial_amplitude * math.tau * motion.frequency * math.cos(phase)
    bounce = climb - disk.restitution * orbit.axial_impact_velocity
    return InitialState(0.0, bounce, orbit.angular_velocity, 0.0, phase)


def simulated_mean(
    study: Motor, point: tuple[float, float], periods: int, repeats: bool
) -> tuple[float, float]:
    """The mean speed by the simulation itself, over so many periods at least, and its error."""
    motion, disk = study.motor_at(dict(zip(("preload", "load_torque"), point, strict=True)))
    runs = 1 if repeats else RUNS
    length = max(periods // runs, MEASURED) if runs > 1 else LONGER * periods
    means = []
    for number in range(runs):
        other = disk._replace(restitution=disk.restitution * (1.0 - 1e-14 * number))
        simulation = Simulation(motion, other, begin_of(motion, disk))
        begin, angles = TRANSIENT // runs, []
        for end in (begin, begin + length):
            while simulation.advance(round(end / motion.frequency * 1e9))[1]:
                pass
            angles.append(simulation.sample().unwrapped_angle)
        means.append((angles[1] - angles[0]) * motion.frequency / length)
    error = float(np.std(means, ddof=1)) / math.sqrt(runs) if runs > 1 else 0.0
    return float(np.mean(means)), error


def _loop(study: Motor, points: list[tuple[float, float]], rng: np.random.Generator) -> list[float]:
    """Seconds for all points, from a few: one call of `simulate` for each."""
    fixed = {name: value for name, value in study.parameters.items()
             if name in (*Motion._fields, *Disk._fields)}  # fmt: skip
    found = []
    for i in rng.choice(len(points), SIMULATED, replace=False):
        preload, load = points[i]
        begin = time.perf_counter()
        simulate(
            (SETTLING + MEASURED) / 40_000.0,
            sample_rate=40_000.0,
            **{**fixed, "preload": preload, "load_torque": load},
        )
        found.append((time.perf_counter() - begin) * len(points))
    return found

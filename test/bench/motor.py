"""A motor's map: the study `motor` beside a loop of `simulate`, and how good its means are."""

from __future__ import annotations

import math
import tempfile
import time
from pathlib import Path

import numpy as np

from bench.studies import on_cores
from bench.table import Aim, Row, row
from bouncing_disk_ros.core.model import Disk, InitialState, Motion
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.maps.period_one import period_one
from bouncing_disk_ros.motor_study.compute import Motor
from bouncing_disk_ros.run.simulate import simulate
from bouncing_disk_ros.study import named, run

PART = "motor"
ROUNDS = 3
CHECKED = 300
SIMULATED = 20
SETTLING, MEASURED = 300, 512
TRANSIENT = 20_000
"""Periods before the longer means: chaos may come before a cycle for long."""
LONGER = 10
"""Times as many periods for the speeds that those of the map are held to."""


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
            periods = np.maximum(found["measured"].values.ravel(), MEASURED)
    points = [(float(y), float(x)) for y in study.axes["preload"].values
              for x in study.axes["load_torque"].values]  # fmt: skip
    rng = np.random.default_rng(14)
    known = np.flatnonzero(np.isfinite(speeds))
    picked = rng.choice(known, CHECKED, replace=False)
    scale = math.tau * float(study.parameters["frequency"])
    scale *= float(study.parameters["angular_amplitude"])
    off = []
    for i in picked:
        longer = long_mean(study, points[i], LONGER * int(periods[i]))
        off.append(abs(speeds[i] - longer) / scale)
    repeats = [one for one, i in zip(off, picked, strict=True) if kinds[i] != 3]
    share = 100.0 * float(np.mean(np.array(off) <= 1e-3))
    return [
        row(PART, "swum, preload × load torque 200 × 200, stored, two cores", "s", seconds,
            Aim(at_most=10.0)),
        row(PART, "the same by a loop of simulate, one core", "s", _loop(study, points, rng)),
        row(PART, f"mean speed within 1e-3 ωΦ of that over {LONGER} times as many periods", "%",
            [share], Aim(at_least=100.0)),
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


def long_mean(study: Motor, point: tuple[float, float], periods: int) -> float:
    """The mean speed by the simulation itself, over so many periods."""
    motion, disk = study.motor_at(dict(zip(("preload", "load_torque"), point, strict=True)))
    simulation = Simulation(motion, disk, begin_of(motion, disk))
    angles = []
    for end in (TRANSIENT, TRANSIENT + periods):
        while simulation.advance(round(end / motion.frequency * 1e9))[1]:
            pass
        angles.append(simulation.sample().unwrapped_angle)
    return (angles[1] - angles[0]) * motion.frequency / periods


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

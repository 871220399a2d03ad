"""Paths of the hand in single tosses, and one toss in time (paper, Figs. 1 and 2d)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bouncing_disk_ros.core.model import SAMPLE_DTYPE, InitialState, Sample
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.tosses import (
    LOWEST,
    PAPER,
    Floats,
    TossSetting,
    amplitudes,
    motion_of,
    separation_phase,
    toss,
)
from bouncing_disk_ros.units import NS

LONGEST = 1e6
"""So long (s) one toss is followed."""


class TossPaths(NamedTuple):
    """Closed paths of the hand; (...) is the broadcast shape of the θ and φ_L asked for."""

    forcing_phase: Floats  # (n,) τ, rad, from the lowest point through one whole period
    arc: Floats  # (..., n) a_e β, m: along the circle of radius a_e
    axial_position: Floats  # (..., n) s, m
    separation_phase: Floats  # (...) τ_sep, rad; nan where the disk never leaves
    separation_arc: Floats  # (...) a_e β there, m
    separation_position: Floats  # (...) s there, m


def toss_paths(
    phase_lag: ArrayLike,
    amplitude_angle: ArrayLike,
    setting: TossSetting = PAPER,
    *,
    points: int = 361,
) -> TossPaths:
    """Paths (a_e β, s) of a point of the hand at radius a_e (eq. 1), for θ and φ_L broadcast.

    `points` of each path, at least 2: the last is the first again.
    """
    if points < 2:
        raise InputError("points", points, "a whole number >= 2")
    lag, angle = np.broadcast_arrays(
        np.asarray(phase_lag, np.float64), np.asarray(amplitude_angle, np.float64)
    )
    toss(lag, angle, setting)  # refuses what cannot be used
    axial, angular = amplitudes(angle, setting)
    arc = setting.disk.friction_radius * angular
    tau = LOWEST + np.linspace(0.0, math.tau, points)
    leave = separation_phase(angle, setting)
    return TossPaths(
        tau,
        arc[..., None] * np.sin(tau + lag[..., None]),
        axial[..., None] * np.sin(tau),
        leave,
        arc * np.sin(leave + lag),
        axial * np.sin(leave),
    )


class TossTrajectory(NamedTuple):
    """Platform and disk in time, arrays (n,); angles counted from the start of the disk's."""

    time: Floats  # s after the start
    forcing_phase: Floats  # τ, rad, not taken back into [0, 2π)
    phase: NDArray[np.int8]  # model.Phase of the disk
    platform_position: Floats  # s, m
    platform_velocity: Floats  # ṡ, m/s
    platform_angle: Floats  # β, rad
    platform_angular_velocity: Floats  # β̇, rad/s
    axial_position: Floats  # x, m
    axial_velocity: Floats  # ẋ, m/s
    angle: Floats  # α, rad
    angular_velocity: Floats  # α̇, rad/s
    airborne_speed: float  # α̇_f at the separation, rad/s; nan where the disk never leaves
    separation_time: float  # s; nan where the disk never leaves
    landing_time: float  # of the first impact, s; nan where none is within the time looked at


def toss_trajectory(
    phase_lag: float,
    amplitude_angle: float,
    setting: TossSetting = PAPER,
    *,
    angular_velocity: float = 0.0,
    forcing_phase: float = LOWEST,
    duration: float | None = None,
    samples: int = 1001,
) -> TossTrajectory:
    """One toss in time, at evenly spaced instants (whole nanoseconds) from the start.

    `duration` (s): how long; without it, up to the first impact, if it comes within some 1e6 s.
    InputError where the disk never leaves the platform and no duration is given.
    """
    if samples < 2:
        raise InputError("samples", samples, "a whole number >= 2")
    if duration is not None and not 0.0 < duration <= LONGEST:
        raise InputError("duration", duration, f"a number > 0 and <= {LONGEST:g} s")
    start = {"angular_velocity": angular_velocity, "forcing_phase": forcing_phase}
    found = toss(phase_lag, amplitude_angle, setting, **start)
    delay, speed = float(found.delay), float(found.airborne_speed)
    if math.isnan(delay) and duration is None:
        hint = "Give a duration, or choose a smaller amplitude angle or a larger arc amplitude."
        allowed = "an angle with axial forcing above 1/pi"
        raise InputError("amplitude_angle", amplitude_angle, allowed, hint)
    motion = motion_of(phase_lag, amplitude_angle, setting)
    initial = InitialState(angular_velocity=angular_velocity, forcing_phase=forcing_phase)
    run = Simulation(motion, setting.disk, initial)
    period = 1.0 / setting.frequency
    end = delay + period if duration is None else duration
    rows, _ = run.advance(round(end * NS))
    while len(rows) == 0 and duration is None and end < LONGEST:
        end *= 2.0
        rows, _ = run.advance(round(end * NS))
    landing = float(rows["time"][0]) if len(rows) else math.nan
    if duration is None and len(rows):
        end = landing
    taken = _samples(Simulation(motion, setting.disk, initial), end, samples)
    return _trajectory(taken, speed, delay, landing)


def _samples(run: Simulation, end: float, count: int) -> list[Sample]:
    """States at `count` instants from 0 to `end` s, rounded down to whole nanoseconds."""
    taken = []
    for i in range(count):
        run.advance(math.floor(end * NS * i / (count - 1)))
        taken.append(run.sample())
    return taken


def _trajectory(taken: list[Sample], speed: float, delay: float, landing: float) -> TossTrajectory:
    rows = np.array([tuple(sample) for sample in taken], SAMPLE_DTYPE)
    names = (*TossTrajectory._fields[3:9], "angular_velocity")
    return TossTrajectory(
        time=rows["time_ns"] / NS,
        forcing_phase=rows["forcing_phase"] + math.tau * rows["cycles"],
        phase=rows["phase"].astype(np.int8),
        angle=math.tau * rows["turns"] + rows["angle"],
        airborne_speed=speed,
        separation_time=delay,
        landing_time=landing,
        **{name: rows[name].copy() for name in names},
    )

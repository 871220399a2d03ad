"""Starts of the disk in the plane of a map: their coordinates, and the orbit from one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, InitialState, Motion, join_rows
from bouncing_disk_ros.core.simulation import Simulation
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractors import (
    Attractor,
    AttractorKind,
    refuse_conservative,
)
from bouncing_disk_ros.maps.basin_measures import centres
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.scales import acceleration, axial_forcing_of, velocity_scale
from bouncing_disk_ros.parameters import DEFAULTS, Value, complete
from bouncing_disk_ros.run.session import Session, motion_of
from bouncing_disk_ros.run.simulate import advance_to, sampled
from bouncing_disk_ros.run.time_map import nanoseconds
from bouncing_disk_ros.study.basins.options import DEFINITION as BASINS
from bouncing_disk_ros.units import number_text

NOT_DECIDED = "unresolved"
"""Name of the label −1."""
MOST_POINTS = 1500
"""Points of an attractor that are drawn; a chaotic one has more."""


class Window(NamedTuple):
    """A part of the plane of starts: forcing phase in rad, w_A in πg/ω."""

    phase_begin: float
    phase_end: float
    velocity_begin: float
    velocity_end: float


def whole_window() -> Window:
    """The window of the study `basins` by default."""
    table = BASINS.options
    return Window(*(float(table[name].default) for name in Window._fields))


class View(NamedTuple):
    """Labels of a window; rows by rising velocity, columns by rising phase."""

    window: Window
    labels: NDArray[np.int32]  # (side, side) index of the attractor, −1: unresolved
    attractors: tuple[Attractor, ...]
    names: tuple[str, ...]
    distinct: bool  # False: double precision ends here, several pixels are one start

    @property
    def shares(self) -> list[float]:
        """Part of the pixels of each attractor, and of unresolved ones at the end."""
        counts = np.bincount(self.labels.ravel() + 1, minlength=len(self.names) + 1)
        return [float(count) / self.labels.size for count in (*counts[1:], counts[0])]


def section_of(values: Mapping[str, float]) -> NextCollisionMap:
    """The map (Γ, ε) of a simulator's parameters. InputError where it has no such plane."""
    whole = {**DEFAULTS, **values}
    motion, disk = motion_of(whole), Disk.of(whole)
    if not acceleration(disk) > 0.0:
        hint = "Nothing brings the disk back to the platform: there are no impacts to map."
        raise InputError("gravity", disk.gravity, "gravity + preload/mass > 0", hint)
    forcing = axial_forcing_of(motion, disk)
    most = BASINS.options["axial_forcing"].high
    if most is not None and forcing > most:
        raise InputError("axial_amplitude", motion.axial_amplitude, f"Γ <= {most:g}",
                         f"It amounts to Γ = {forcing:g}.")  # fmt: skip
    refuse_conservative(disk.restitution)
    return NextCollisionMap(forcing, disk.restitution)


def pixel_centre(window: Window, side: int, phase: float, velocity: float) -> tuple[float, float]:
    """The start (τ, w_A) whose pixel holds a point of the window."""
    ends = (*window[:2], side), (*window[2:], side)
    tau, w = (
        float(centres(*one)[place_of(*one, value)])
        for one, value in zip(ends, (phase, velocity), strict=True)
    )
    return tau, w


def place_of(begin: float, end: float, count: int, value: float) -> int:
    """Number of the pixel, of those from begin to end, that holds a value."""
    return min(max(math.floor((value - begin) / (end - begin) * count), 0), count - 1)


def is_distinct(window: Window, side: int) -> bool:
    """Whether the centres of a window's pixels are different doubles."""
    return all(len(np.unique(centres(*ends, side))) == side for ends in (window[:2], window[2:]))


def points_of(one: Attractor) -> NDArray[np.float64]:
    """Points (n, 2) τ and w_A of an attractor, of a chaotic one some; (0, 2) for rest."""
    points = np.stack((one.forcing_phases, one.velocities), axis=1)
    return points[:: max(1, -(-len(points) // MOST_POINTS))]


def described(one: Attractor, name: str) -> str:
    """A line on an attractor: its name, with what tells how strongly it draws."""
    if one.kind is AttractorKind.PERIODIC:
        return f"{name}, multiplier {number_text(one.multiplier)}"
    if one.kind is AttractorKind.CHAOTIC:
        return f"{name}, Lyapunov exponent {number_text(math.log(one.multiplier))} per impact"
    return name


# ------------------------------------------------------------------------------------------------
# The orbit of one start of the plane (τ, w_A), as the simulator itself computes it.


PATH_PERIODS, SAMPLES = 10, 48
"""Periods of the platform that the path is sampled over, and samples of each."""
IMPACT_PERIODS = 60
"""Periods over which impacts are gathered."""
_ROUNDINGS = 4
"""Velocities so many roundings up and down are tried, for the one that meets the start best."""
_KEPT = ("initial_angular_velocity", "initial_angle", "chatter_report_speed")
"""Parameters of a run besides its motion and disk that a start leaves as they are."""

Floats = NDArray[np.float64]


class Start(NamedTuple):
    """A state just before a first impact, with the parameters that begin a run there."""

    forcing_phase: float  # τ, rad, in [0, 2π)
    velocity: float  # w_A, πg/ω
    impact_velocity: float  # the same in m/s, to the bit as the run has it
    parameters: Mapping[str, Value]  # for the node: initial state, and the motion to begin with


class Orbit(NamedTuple):
    """What becomes of a start; arrays of times count from it."""

    start: Start
    impacts: NDArray[np.void]  # rows of IMPACT_DTYPE
    forcing_phase: Floats  # τ of the impacts, rad
    velocity: Floats  # w_A of the impacts, πg/ω
    time: Floats  # s, of the path
    height: Floats  # x, m
    platform: Floats  # s, m


def start_at(values: Mapping[str, float], forcing_phase: float, velocity: float) -> Start:
    """The start (τ in rad, w_A < 0 in πg/ω) at the parameters in force. Raises InputError.

    The run begins at the impact: on the platform, with the velocity of the platform there and
    w_A. Their sum is rounded, so w_A is met to about its last digit; `Start` has what is met. A w_A
    within the roundings of the platform's velocity begins in contact.
    """
    whole = complete(_in_force(values))
    scale = velocity_scale(motion_of(whole), Disk.of(whole))
    phase = forcing_phase % math.tau
    phase = phase if phase < math.tau else 0.0
    motion, still = motion_of(whole), InitialState(axial_velocity=0.0, forcing_phase=phase)
    platform = Simulation(motion, Disk.of(whole), still).sample().platform_velocity
    wanted = velocity * scale
    axial = min(_around(platform + wanted), key=lambda v: _miss(v - platform, wanted))
    parameters: dict[str, Value] = {
        "initial_height": 0.0,
        "initial_with_platform": False,
        "initial_axial_velocity": axial,
        "initial_forcing_phase": phase,
        **{name: whole[name] for name in Motion._fields},  # a reset goes back to these
    }
    impact = axial - platform
    return Start(phase, impact / scale, impact, parameters)


def orbit_of(values: Mapping[str, float], start: Start) -> Orbit:
    """Path and impacts of a start: bit by bit what `simulate` gives with the same parameters.

    Raises InputError, and FailedError where the state leaves the range of numbers.
    """
    whole = complete({**_in_force(values), **start.parameters})
    session = Session(whole, lambda _: None, paused=True)
    frequency = float(whole["frequency"])
    end = nanoseconds((PATH_PERIODS + 0.5 / SAMPLES) / frequency)  # rounding loses no sample
    path = sampled(session, end, SAMPLES * frequency)
    advance_to(session, nanoseconds(IMPACT_PERIODS / frequency))
    impacts = join_rows(session.take_rows())
    scale = velocity_scale(motion_of(whole), Disk.of(whole))
    return Orbit(
        start, impacts, impacts["forcing_phase"], impacts["axial_impact_velocity"] / scale,
        path["time_ns"] * 1e-9, path["axial_position"], path["platform_position"],
    )  # fmt: skip


def _in_force(values: Mapping[str, float]) -> dict[str, Value]:
    """Parameters that decide a run, of those given; its begin is the start."""
    names = (*Motion._fields, *Disk._fields, *_KEPT)
    return {name: values[name] for name in names if name in values}


def _around(value: float) -> list[float]:
    """A double and its neighbours, itself first."""
    found, low, high = [value], value, value
    for _ in range(_ROUNDINGS):
        low, high = math.nextafter(low, -math.inf), math.nextafter(high, math.inf)
        found += [low, high]
    return found


def _miss(met: float, wanted: float) -> float:
    """How far a relative velocity is from the one wanted; it must be an impact."""
    return abs(met - wanted) if met < 0.0 else math.inf

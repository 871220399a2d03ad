"""The plane of starts at the parameters in force: windows, units, what a view of it holds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.attractors import (
    Attractor,
    AttractorKind,
    refuse_conservative,
)
from bouncing_disk_ros.maps.scales import acceleration, axial_forcing_of, velocity_scale
from bouncing_disk_ros.parameters import DEFAULTS
from bouncing_disk_ros.run.session import motion_of
from bouncing_disk_ros.study.basins.tool import DEFINITION as BASINS

UNRESOLVED = "unresolved"
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


class Section(NamedTuple):
    """The next-collision map that the parameters of a simulator amount to, and its units."""

    axial_forcing: float  # Γ
    restitution: float  # ε
    velocity_scale: float  # πg/ω in m/s, preload included

    def amplitude(self, axial_forcing: float, frequency: float) -> float:
        """The axial amplitude of another Γ at this frequency (Hz), m: A = Γπg/ω²."""
        return axial_forcing * self.velocity_scale / (math.tau * frequency)


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


def section_of(values: Mapping[str, float]) -> Section:
    """The section of a simulator's parameters. InputError where it has no such plane."""
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
    return Section(forcing, disk.restitution, velocity_scale(motion, disk))


def pixel_centre(window: Window, side: int, phase: float, velocity: float) -> tuple[float, float]:
    """The start (τ, w_A) whose pixel holds a point of the window."""
    return (
        _centre(*window[:2], side, phase),
        _centre(*window[2:], side, velocity),
    )


def centres(begin: float, end: float, count: int) -> NDArray[np.float64]:
    """Centres (count,) of pixels from begin to end, as the study `basins` places them."""
    return begin + (end - begin) * (np.arange(count) + 0.5) / count


def _centre(begin: float, end: float, side: int, value: float) -> float:
    """That of `centres` whose pixel holds a value."""
    place = min(max(math.floor((value - begin) / (end - begin) * side), 0), side - 1)
    return begin + (end - begin) * (place + 0.5) / side


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
        return f"{name}, multiplier {one.multiplier:.4g}"
    if one.kind is AttractorKind.CHAOTIC:
        return f"{name}, Lyapunov exponent {math.log(one.multiplier):.4g} per impact"
    return name

"""Basins of attraction in a window of starts, for a picture that is zoomed: no Bokeh here."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.dynamics.attractors import Attractor, AttractorKind
from bouncing_disk_ros.analysis.dynamics.basin_labels import LabelRule, label_starts
from bouncing_disk_ros.analysis.dynamics.next_collision import NextCollisionMap
from bouncing_disk_ros.analysis.scales import (
    acceleration,
    angular_forcing_of,
    axial_forcing_of,
    velocity_scale,
)
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parameters import DEFAULTS, Value
from bouncing_disk_ros.run.session import disk_of, motion_of
from bouncing_disk_ros.study.basin_study import (
    Basins,
    from_arrays,
    numbered,
    refuse_conservative,
)
from bouncing_disk_ros.study.definition import Arrays
from bouncing_disk_ros.study_tables import STUDY_TABLES

COARSE, FULL = 128, 512
"""Pixels along each side of a view: what is shown at first, and in the end."""
UNRESOLVED = "unresolved"
"""Name of the label −1."""
MOST_POINTS = 1500
"""Points of an attractor that are drawn; a chaotic one has more."""
_KEPT = 64


class Window(NamedTuple):
    """A part of the plane of starts: forcing phase in rad, w_A in πg/ω."""

    phase_begin: float
    phase_end: float
    velocity_begin: float
    velocity_end: float

    @property
    def is_whole(self) -> bool:
        """Whether it holds each forcing phase once."""
        return abs(self.phase_end - self.phase_begin - math.tau) < 1e-9


def whole_window() -> Window:
    """The window of the study `basins` by default."""
    table = STUDY_TABLES["basins"]
    return Window(*(float(table[name].default) for name in Window._fields))


class Section(NamedTuple):
    """The next-collision map that the parameters of a simulator amount to, and its units."""

    axial_forcing: float  # Γ
    restitution: float  # ε
    phase_lag: float  # θ, rad
    angular_forcing: float  # Γ_T; inf without friction, nan without rotation besides
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
    motion, disk = motion_of(whole), disk_of(whole)
    if not acceleration(disk) > 0.0:
        hint = "Nothing brings the disk back to the platform: there are no impacts to map."
        raise InputError("gravity", disk.gravity, "gravity + preload/mass > 0", hint)
    forcing = axial_forcing_of(motion, disk)
    most = STUDY_TABLES["basins"]["axial_forcing"].high
    if most is not None and forcing > most:
        raise InputError("axial_amplitude", motion.axial_amplitude, f"Γ <= {most:g}",
                         f"It amounts to Γ = {forcing:g}.")  # fmt: skip
    refuse_conservative(disk.restitution)
    lag, angular = motion.phase_lag, angular_forcing_of(motion, disk)
    return Section(forcing, disk.restitution, lag, angular, velocity_scale(motion, disk))


def view(
    axial_forcing: float,
    restitution: float,
    window: Window,
    side: int,
    is_obsolete: Callable[[], bool] = lambda: False,
) -> View | None:
    """Labels of side × side starts of a window; None if it becomes obsolete meanwhile.

    The labels are those of the study `basins` over this window where that finds the same
    attractors: here they are looked for once at each Γ and ε, from the study's whole window, so
    that a label means the same in every zoom. Raises InputError.
    """
    found = _context(axial_forcing, restitution)
    study = _study(axial_forcing, restitution, window, side)
    labels = np.empty((side, side), np.int32)
    for region in study.regions():
        if is_obsolete():
            return None
        part = study.compute(region, found, None)["label"]
        labels[region.select(("velocity", "forcing_phase"))] = part
    attractors = from_arrays(found).found
    names = tuple(numbered([one.name for one in attractors]))
    return View(window, labels, attractors, names, is_distinct(window, side))


def attractors_at(axial_forcing: float, restitution: float) -> tuple[Attractor, ...]:
    """The attractors that labels of views stand for, in their order. Raises InputError."""
    return from_arrays(_context(axial_forcing, restitution)).found


def label_of(axial_forcing: float, restitution: float, phase: float, velocity: float) -> str:
    """Name of the attractor that one start goes to."""
    found = from_arrays(_context(axial_forcing, restitution))
    start = np.array([phase % math.tau]), np.array([velocity])
    rule = LabelRule(float(STUDY_TABLES["basins"]["tolerance"].default))
    section = NextCollisionMap(axial_forcing, restitution)
    label = int(label_starts(found, section, *start, rule).label[0])
    return numbered([one.name for one in found.found])[label] if label >= 0 else UNRESOLVED


def pixel_centre(window: Window, side: int, phase: float, velocity: float) -> tuple[float, float]:
    """The start (τ, w_A) whose pixel holds a point of the window."""
    return (
        _centre(*window[:2], side, phase),
        _centre(*window[2:], side, velocity),
    )


def _centre(begin: float, end: float, side: int, value: float) -> float:
    """As the study places its pixels."""
    place = min(max(math.floor((value - begin) / (end - begin) * side), 0), side - 1)
    return begin + (end - begin) * (place + 0.5) / side


def is_distinct(window: Window, side: int) -> bool:
    """Whether the centres of a window's pixels are different doubles."""
    places = (np.arange(side) + 0.5) / side
    return all(
        len(np.unique(begin + (end - begin) * places)) == side
        for begin, end in (window[:2], window[2:])
    )


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


def _study(axial_forcing: float, restitution: float, window: Window, side: int) -> Basins:
    given: dict[str, Value] = {name: s.default for name, s in STUDY_TABLES["basins"].items()}
    given |= {"axial_forcing": axial_forcing, "restitution": restitution}
    given |= {"width": side, "height": side, **window._asdict()}
    return Basins(given)


@lru_cache(maxsize=_KEPT)
def _context(axial_forcing: float, restitution: float) -> Arrays:
    """The attractors at Γ and ε, once for all sessions and zooms."""
    table = STUDY_TABLES["basins"]
    given = {name: spec.default for name, spec in table.items()}
    given |= {"axial_forcing": axial_forcing, "restitution": restitution}
    return Basins(given).context()


def map_of(section: Section) -> NextCollisionMap:
    """The section as the map that analysis computes with; no friction where Γ_T is not known."""
    angular = section.angular_forcing
    known = angular if angular > 0.0 else math.inf
    return NextCollisionMap(section.axial_forcing, section.restitution, section.phase_lag, known)

"""Labels of a window of starts, for a picture that is zoomed."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.dynamics.attractor_search import find_attractors
from bouncing_disk_ros.analysis.dynamics.attractors import Attractor, Attractors, numbered
from bouncing_disk_ros.analysis.dynamics.basin_labels import LabelRule, label_starts
from bouncing_disk_ros.analysis.dynamics.next_collision import NextCollisionMap
from bouncing_disk_ros.study_tables import STUDY_TABLES
from bouncing_disk_ros.workbench.start_plane import (
    UNRESOLVED,
    View,
    Window,
    centres,
    is_distinct,
    whole_window,
)

COARSE, FULL = 128, 512
"""Pixels along each side of a view: what is shown at first, and in the end."""
SEARCHED = 24
"""Attractors are looked for from SEARCHED × SEARCHED starts: those of the study by default."""
_ROWS = 32
"""Rows labelled between two questions whether the view is still wanted: some 10 ms."""
_KEPT = 64


def view(
    axial_forcing: float,
    restitution: float,
    window: Window,
    side: int,
    is_obsolete: Callable[[], bool] = lambda: False,
) -> View | None:
    """Labels of side × side starts of a window; None if it becomes obsolete meanwhile.

    The labels are those of the study `basins` over this window where that finds the same
    attractors: here they are looked for once at each Γ and ε, over the whole window, so that a
    label means the same in every zoom. Raises InputError.
    """
    found, section = _attractors(axial_forcing, restitution), _map(axial_forcing, restitution)
    speeds, phases = centres(*window[2:], side), centres(*window[:2], side) % math.tau
    labels = np.empty((side, side), np.int32)
    for first in range(0, side, _ROWS):
        if is_obsolete():
            return None
        rows = slice(first, first + _ROWS)
        w, tau = np.meshgrid(speeds[rows], phases, indexing="ij")
        labels[rows] = label_starts(found, section, tau.ravel(), w.ravel(), _rule()).label.reshape(
            w.shape
        )
    names = tuple(numbered([one.name for one in found.found]))
    return View(window, labels, found.found, names, is_distinct(window, side))


def attractors_at(axial_forcing: float, restitution: float) -> tuple[Attractor, ...]:
    """The attractors that labels of views stand for, in their order. Raises InputError."""
    return _attractors(axial_forcing, restitution).found


def label_of(axial_forcing: float, restitution: float, phase: float, velocity: float) -> str:
    """Name of the attractor that one start goes to."""
    found, section = _attractors(axial_forcing, restitution), _map(axial_forcing, restitution)
    start = np.array([phase % math.tau]), np.array([velocity])
    label = int(label_starts(found, section, *start, _rule()).label[0])
    return numbered([one.name for one in found.found])[label] if label >= 0 else UNRESOLVED


def _map(axial_forcing: float, restitution: float) -> NextCollisionMap:
    return NextCollisionMap(axial_forcing, restitution)


def _rule() -> LabelRule:
    """That of the study by default."""
    return LabelRule(float(STUDY_TABLES["basins"]["tolerance"].default))


@lru_cache(maxsize=_KEPT)
def _attractors(axial_forcing: float, restitution: float) -> Attractors:
    """The attractors at Γ and ε, looked for once for all sessions and zooms."""
    table = STUDY_TABLES["basins"]
    phases, speeds = (
        _some(centres(*ends, int(table[count].default)))
        for ends, count in zip(
            (whole_window()[:2], whole_window()[2:]), ("width", "height"), strict=True
        )
    )
    starts = [(float(tau), float(w)) for w in speeds for tau in phases]
    return find_attractors(_map(axial_forcing, restitution), starts)


def _some(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values[np.unique(np.linspace(0, len(values) - 1, SEARCHED).astype(int))]

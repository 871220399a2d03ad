"""Labels of a window of starts, for a picture that is zoomed."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.dynamics.absorbing_region import AbsorbingRegion, absorbing_regions
from bouncing_disk_ros.analysis.dynamics.attractor_search import find_attractors
from bouncing_disk_ros.analysis.dynamics.attractors import (
    Attractor,
    AttractorKind,
    Attractors,
    numbered,
)
from bouncing_disk_ros.analysis.dynamics.basin_labels import UNRESOLVED as UNDECIDED
from bouncing_disk_ros.analysis.dynamics.basin_labels import LabelRule, label_starts
from bouncing_disk_ros.analysis.dynamics.next_collision import NextCollisionMap
from bouncing_disk_ros.collision_map.lanes.axial_lanes import iterate_axial
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
EARLY = 64
"""Impacts after which a start is looked for in a region about a chaotic attractor."""
_ROWS = 64
"""Rows labelled between two questions whether the view is still wanted: 20 to 60 ms."""
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
    found, section = found_attractors(axial_forcing, restitution), _map(axial_forcing, restitution)
    # looking for them takes longer than a coarse view
    regions = _regions(axial_forcing, restitution) if side > COARSE else {}
    speeds, phases = centres(*window[2:], side), centres(*window[:2], side) % math.tau
    labels = np.empty((side, side), np.int32)
    for first in range(0, side, _ROWS):
        if is_obsolete():
            return None
        rows = slice(first, first + _ROWS)
        w, tau = np.meshgrid(speeds[rows], phases, indexing="ij")
        labels[rows] = _labels(found, regions, section, tau.ravel(), w.ravel()).reshape(w.shape)
    names = tuple(numbered([one.name for one in found.found]))
    return View(window, labels, found.found, names, is_distinct(window, side))


def _labels(
    found: Attractors,
    regions: dict[int, AbsorbingRegion],
    section: NextCollisionMap,
    tau: NDArray[np.float64],
    w: NDArray[np.float64],
) -> NDArray[np.int32]:
    """Labels (n,) of starts; those that are early in a region about chaos are not followed on.

    The study follows these for hundreds of impacts more, to see that they do not leave.
    """
    if not regions:
        return label_starts(found, section, tau, w, _rule()).label
    # chaotic attractors are the last: without them all other labels are the same
    others = tuple(one for one in found.found if one.kind is not AttractorKind.CHAOTIC)
    early = _rule()._replace(cap=EARLY)
    labels = label_starts(found._replace(found=others), section, tau, w, early).label
    open_ = np.flatnonzero(labels == UNDECIDED)
    states = tau[open_], w[open_]
    ones = np.ones(len(open_))
    platform = section.axial_forcing * ones, section.restitution * ones
    iterate_axial(*states, *platform, EARLY, np.zeros((len(open_), 2), np.int64))
    for label, region in regions.items():
        labels[open_[region.hold(*states)]] = label
    late = np.flatnonzero(labels == UNDECIDED)
    labels[late] = label_starts(found, section, tau[late], w[late], _rule()).label
    return labels


def attractors_at(axial_forcing: float, restitution: float) -> tuple[Attractor, ...]:
    """The attractors that labels of views stand for, in their order. Raises InputError."""
    return found_attractors(axial_forcing, restitution).found


def label_of(axial_forcing: float, restitution: float, phase: float, velocity: float) -> str:
    """Name of the attractor that one start goes to."""
    found, section = found_attractors(axial_forcing, restitution), _map(axial_forcing, restitution)
    start = np.array([phase % math.tau]), np.array([velocity])
    label = int(label_starts(found, section, *start, _rule()).label[0])
    return numbered([one.name for one in found.found])[label] if label >= 0 else UNRESOLVED


def _map(axial_forcing: float, restitution: float) -> NextCollisionMap:
    return NextCollisionMap(axial_forcing, restitution)


def _rule() -> LabelRule:
    """That of the study by default."""
    return LabelRule(float(STUDY_TABLES["basins"]["tolerance"].default))


@lru_cache(maxsize=_KEPT)
def found_attractors(axial_forcing: float, restitution: float) -> Attractors:
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


@lru_cache(maxsize=_KEPT)
def _regions(axial_forcing: float, restitution: float) -> dict[int, AbsorbingRegion]:
    section = _map(axial_forcing, restitution)
    return absorbing_regions(section, found_attractors(axial_forcing, restitution))


def _some(values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values[np.unique(np.linspace(0, len(values) - 1, SEARCHED).astype(int))]

"""Labels of a window of starts, for a picture that is zoomed."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.attractor_search import find_attractors
from bouncing_disk_ros.maps.attractors import (
    Attractor,
    AttractorKind,
    Attractors,
    numbered,
)
from bouncing_disk_ros.maps.basin_labels import UNRESOLVED as UNDECIDED
from bouncing_disk_ros.maps.basin_labels import LabelRule, label_starts
from bouncing_disk_ros.maps.lanes.axial_lanes import iterate_axial
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.study.basins.tool import DEFINITION as BASINS
from bouncing_disk_ros.workbench.absorbing_region import AbsorbingRegion, absorbing_regions
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
EARLY = 64, 256
"""Impacts after which starts are looked for in a region about a chaotic attractor."""
_ROWS = 128
"""Rows labelled between two questions whether the view is still wanted: 20 to 150 ms."""
_KEPT = 12
"""Values of Γ and ε whose attractors are kept: a chaotic one has 1 MB."""

Floats = NDArray[np.float64]
Labels = NDArray[np.int32]
States = tuple[Floats, Floats]
Regions = dict[int, AbsorbingRegion]


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
    found: Attractors, regions: Regions, section: NextCollisionMap, tau: Floats, w: Floats
) -> Labels:
    """Labels (n,) of starts, those of the study; whoever is in a region about chaos is known.

    The study follows these for hundreds of impacts more, to see that they do not leave. Each start
    is followed from its beginning, as in the study: in pieces it would have other roundings, and
    where it comes near to contact it might end elsewhere.
    """
    labels = np.full(len(tau), UNDECIDED, np.int32)
    # chaotic attractors are the last: without them all other labels are the same
    others = tuple(one for one in found.found if one.kind is not AttractorKind.CHAOTIC)
    left = np.arange(len(tau))
    for impacts in EARLY if regions else ():
        rule = _rule()._replace(cap=impacts)
        early = label_starts(found._replace(found=others), section, tau[left], w[left], rule)
        labels[left] = early.label
        left = left[early.label == UNDECIDED]
        states = _iterated(section, tau[left], w[left], impacts)
        for label, region in regions.items():
            labels[left[region.hold(*states)]] = label
        left = left[labels[left] == UNDECIDED]
    labels[left] = label_starts(found, section, tau[left], w[left], _rule()).label
    return labels


def _iterated(section: NextCollisionMap, tau: Floats, w: Floats, impacts: int) -> States:
    """States after some impacts."""
    states = tau.copy(), w.copy()
    forcings, restitutions = (
        np.full(len(tau), float(value)) for value in (section.axial_forcing, section.restitution)
    )
    iterate_axial(*states, forcings, restitutions, impacts, np.zeros((len(tau), 2), np.int64))
    return states


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
    return LabelRule(float(BASINS.options["tolerance"].default))


@lru_cache(maxsize=_KEPT)
def found_attractors(axial_forcing: float, restitution: float) -> Attractors:
    """The attractors at Γ and ε, looked for once for all sessions and zooms."""
    table = BASINS.options
    phases, speeds = (
        _some(centres(*ends, int(table[count].default)))
        for ends, count in zip(
            (whole_window()[:2], whole_window()[2:]), ("width", "height"), strict=True
        )
    )
    starts = [(float(tau), float(w)) for w in speeds for tau in phases]
    return find_attractors(_map(axial_forcing, restitution), starts)


@lru_cache(maxsize=_KEPT // 4)
def _regions(axial_forcing: float, restitution: float) -> Regions:
    section = _map(axial_forcing, restitution)
    return absorbing_regions(section, found_attractors(axial_forcing, restitution))


def _some(values: Floats) -> Floats:
    return values[np.unique(np.linspace(0, len(values) - 1, SEARCHED).astype(int))]

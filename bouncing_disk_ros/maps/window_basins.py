"""Labels of the starts of a window of the axial next-collision map, and its attractors."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.attractor_search import missed_attractors, window_attractors
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind, Attractors
from bouncing_disk_ros.maps.axial_iteration import iterate_forwards
from bouncing_disk_ros.maps.axial_map import ORBIT_DELAY, ORBIT_TAU, ORBIT_W, axial_orbit
from bouncing_disk_ros.maps.basin_labels import Floats, LabelRule, StartLabels, label_starts
from bouncing_disk_ros.maps.basin_measures import UNRESOLVED, centres
from bouncing_disk_ros.maps.next_collision import NextCollisionMap

if TYPE_CHECKING:
    from bouncing_disk_ros.maps.absorbing_region import AbsorbingRegion

IN_CONTACT = -2
"""Label of a start that comes to contact, before it is said where contact leads."""
SEARCHED = 16
"""`label_window` first looks for attractors from SEARCHED × SEARCHED starts."""


def label_plane(
    known: Attractors, section: NextCollisionMap, forcing_phases: Floats, velocities: Floats,
    rule: LabelRule | None = None, regions: Mapping[int, AbsorbingRegion] | None = None,
) -> StartLabels:  # fmt: skip
    """The `label_starts` of each velocity (rows) at each forcing phase (columns), rad."""
    w, tau = np.meshgrid(velocities, forcing_phases % math.tau, indexing="ij")
    found = label_starts(known, section, tau.ravel(), w.ravel(), rule, regions)
    label, impacts, time = found
    return StartLabels(label.reshape(w.shape), impacts.reshape(w.shape), time.reshape(w.shape))


class Labelled(NamedTuple):
    """Where starts of a window go."""

    known: Attractors
    labels: StartLabels  # (side, side) by rising τ and w_A; IN_CONTACT where it comes to contact
    missed: int  # how many attractors the search missed, and open starts led to

    def ends(self) -> NDArray[np.int32]:
        """Label (side, side) of the attractor that each start ends on."""
        label = self.labels.label
        return np.where(label == IN_CONTACT, np.int32(self.known.after_contact), label)


def window_axes(side: int, lowest: float) -> tuple[Floats, Floats]:
    """τ ∈ [0, 2π) and w_A ∈ (lowest, 0) of side × side pixels' centres."""
    parts = centres(0.0, 1.0, side)
    return math.tau * parts, lowest * (1.0 - parts)


def label_window(section: NextCollisionMap, side: int, lowest: float) -> Labelled:
    """The attractors of the starts on `window_axes`, and the label of each start."""
    known = window_attractors(section, *window_axes(SEARCHED, lowest))
    tau, w = window_axes(side, lowest)
    labels = label_plane(_apart(known), section, tau, w)
    rows, columns = open_ = np.nonzero(labels.label == UNRESOLVED)
    missed: list[Attractor] = []
    if len(rows):
        left = np.stack((tau[columns], w[rows]), axis=1)
        missed = missed_attractors(section, known, left)
        if missed:
            known = known._replace(found=(*known.found, *missed))
            again = label_starts(_apart(known), section, *left.T)
            labels.label[open_], labels.impacts[open_], labels.time[open_] = again
    _go_on_after_contact(known, section, tau, w, labels)
    return Labelled(known, labels, len(missed))


def _apart(known: Attractors) -> Attractors:
    """The same, so that starts that come to contact are labelled IN_CONTACT."""
    return known._replace(after_contact=IN_CONTACT)


def _go_on_after_contact(
    known: Attractors, section: NextCollisionMap, tau: Floats, w: Floats, labels: StartLabels
) -> None:
    """Where contact leads to a periodic attractor: the times up to there, in place."""
    after = known.after_contact
    rows, columns = chattered = np.nonzero(labels.label == IN_CONTACT)
    if not len(rows) or after < 0 or known.found[after].kind is not AttractorKind.PERIODIC:
        return
    platform = section.axial_parameters
    states = np.stack((tau[columns], w[rows]), axis=1)
    iterate_forwards(states, labels.impacts[chattered].astype(np.int64), *platform)
    next_one = np.empty((1, 4))
    delays = np.empty(len(states))
    for i, state in enumerate(states):
        axial_orbit(*state, *platform, 1, next_one)
        delays[i] = next_one[0, ORBIT_DELAY]
    tau, w = (next_one[:, column].copy() for column in (ORBIT_TAU, ORBIT_W))  # the same for all
    labels.time[chattered] += delays
    labels.time[chattered] += label_starts(known, section, tau, w).time[0]

"""The attractors and labels of all starts of a window of the axial next-collision map."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.attractor_search import missed_attractors, window_attractors
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind, Attractors
from bouncing_disk_ros.maps.axial_flights import iterate_forwards
from bouncing_disk_ros.maps.axial_map import ORBIT_DELAY, ORBIT_TAU, ORBIT_W, axial_orbit
from bouncing_disk_ros.maps.basin_labels import Floats, StartLabels, label_starts
from bouncing_disk_ros.maps.label_maps import UNRESOLVED
from bouncing_disk_ros.maps.next_collision import NextCollisionMap

IN_CONTACT = -2
"""Label of a start that comes to contact, before it is said where contact leads."""
SEARCHED = 16
"""`label_window` first looks for attractors from SEARCHED × SEARCHED starts."""


class Labelled(NamedTuple):
    """Where starts of a window go."""

    known: Attractors
    labels: StartLabels  # of each start; IN_CONTACT where it comes to contact
    side: int
    missed: int  # how many attractors the search missed, and open starts led to

    def ends(self) -> NDArray[np.int32]:
        """Label (n,) of the attractor that each start ends on."""
        label = self.labels.label
        return np.where(label == IN_CONTACT, np.int32(self.known.after_contact), label)


def _axes(side: int, lowest: float) -> tuple[Floats, Floats]:
    centres = (np.arange(side) + 0.5) / side
    return math.tau * centres, lowest * (1.0 - centres)


def window_starts(side: int, lowest: float) -> tuple[Floats, Floats]:
    """τ and w_A (n,) of side × side pixels' centres, τ ∈ [0, 2π), w_A ∈ (lowest, 0), row by row."""
    tau, w = np.meshgrid(*_axes(side, lowest))
    return tau.ravel(), w.ravel()


def label_window(section: NextCollisionMap, side: int, lowest: float) -> Labelled:
    """The attractors that the `window_starts` lead to, and the label of each of them."""
    known = window_attractors(section, *_axes(SEARCHED, lowest))
    tau, w = window_starts(side, lowest)
    labels = _labels(known, section, tau, w)
    open_ = np.flatnonzero(labels.label == UNRESOLVED)
    missed: list[Attractor] = []
    if len(open_):
        left = np.stack((tau[open_], w[open_]), axis=1)
        missed = missed_attractors(section, known, left)
        if missed:
            known = known._replace(found=(*known.found, *missed))
            again = _labels(known, section, *left.T.copy())
            labels.label[open_], labels.impacts[open_], labels.time[open_] = again
    _go_on_after_contact(known, section, tau, w, labels)
    return Labelled(known, labels, side, len(missed))


def _go_on_after_contact(
    known: Attractors, section: NextCollisionMap, tau: Floats, w: Floats, labels: StartLabels
) -> None:
    """Where contact leads to a periodic attractor: the times up to there, in place."""
    after = known.after_contact
    held = np.flatnonzero(labels.label == IN_CONTACT)
    if not len(held) or after < 0 or known.found[after].kind is not AttractorKind.PERIODIC:
        return
    platform = float(section.axial_forcing), float(section.restitution)
    states = np.stack((tau[held], w[held]), axis=1)
    iterate_forwards(states, labels.impacts[held].astype(np.int64), *platform)
    next_one = np.empty((1, 4))
    for i, state in zip(held, states, strict=True):
        axial_orbit(*state, *platform, 1, next_one)
        labels.time[i] += next_one[0, ORBIT_DELAY]
    tau, w = (next_one[:, column].copy() for column in (ORBIT_TAU, ORBIT_W))  # the same for all
    labels.time[held] += label_starts(known, section, tau, w).time[0]


def _labels(known: Attractors, section: NextCollisionMap, tau: Floats, w: Floats) -> StartLabels:
    """Labels with IN_CONTACT kept apart."""
    apart = known._replace(after_contact=IN_CONTACT)
    return label_starts(apart, section, np.ascontiguousarray(tau), np.ascontiguousarray(w))

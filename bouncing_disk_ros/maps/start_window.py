"""Where the starts of a window of the plane go: their attractors, labels and times."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.attractor_search import (
    find_attractors,
    missed_attractors,
)
from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind, Attractors
from bouncing_disk_ros.maps.axial_flights import iterate_forwards
from bouncing_disk_ros.maps.axial_map import ORBIT_DELAY, ORBIT_TAU, ORBIT_W, axial_orbit
from bouncing_disk_ros.maps.basin_labels import UNRESOLVED, Basins, label_starts
from bouncing_disk_ros.maps.next_collision import NextCollisionMap

Array = NDArray[np.float64]


IN_CONTACT = -2
"""Label of a start that comes to contact, before it is said where contact leads."""


SEARCHED = 16
"""Attractors are looked for from SEARCHED × SEARCHED starts of the window."""


class WindowStarts(NamedTuple):
    """Starts at the centres of n × n pixels of τ ∈ [0, 2π), w_A ∈ (lowest, 0)."""

    tau: Array
    w: Array
    side: int


class Labelled(NamedTuple):
    """Where starts of a window go."""

    known: Attractors
    labels: Basins  # of each start; IN_CONTACT where it comes to contact
    side: int
    missed: int  # how many attractors the search missed, and open starts led to

    def ends(self) -> NDArray[np.int32]:
        """Label (n,) of the attractor that each start ends on."""
        label = self.labels.label
        return np.where(label == IN_CONTACT, np.int32(self.known.after_contact), label)


def window_starts(side: int, lowest: float) -> WindowStarts:
    """The centres of side × side pixels, rows of equal w_A."""
    centres = (np.arange(side) + 0.5) / side
    tau, w = np.meshgrid(math.tau * centres, lowest * (1.0 - centres))
    return WindowStarts(tau.ravel(), w.ravel(), side)


def label_window(section: NextCollisionMap, starts: WindowStarts, lowest: float) -> Labelled:
    """The attractors that a window leads to, and the label of each of its starts."""
    few = window_starts(SEARCHED, lowest)
    known = find_attractors(section, list(zip(few.tau.tolist(), few.w.tolist(), strict=True)))
    labels = _labels(known, section, starts.tau, starts.w)
    open_ = np.flatnonzero(labels.label == UNRESOLVED)
    missed: list[Attractor] = []
    if len(open_):
        left = np.stack((starts.tau[open_], starts.w[open_]), axis=1)
        missed = missed_attractors(section, known, left)
        if missed:
            known = known._replace(found=(*known.found, *missed))
            again = _labels(known, section, *left.T.copy())
            labels.label[open_], labels.impacts[open_], labels.time[open_] = again
    _go_on_after_contact(known, section, starts, labels)
    return Labelled(known, labels, starts.side, len(missed))


def _go_on_after_contact(
    known: Attractors, section: NextCollisionMap, starts: WindowStarts, labels: Basins
) -> None:
    """Where contact leads to a periodic attractor: the times up to there, in place."""
    after = known.after_contact
    held = np.flatnonzero(labels.label == IN_CONTACT)
    if not len(held) or after < 0 or known.found[after].kind is not AttractorKind.PERIODIC:
        return
    platform = float(section.axial_forcing), float(section.restitution)
    states = np.stack((starts.tau[held], starts.w[held]), axis=1)
    iterate_forwards(states, labels.impacts[held].astype(np.int64), *platform)
    next_one = np.empty((1, 4))
    for i, (tau, w) in zip(held, states, strict=True):
        axial_orbit(tau, w, *platform, 1, next_one)
        labels.time[i] += next_one[0, ORBIT_DELAY]
    tau, w = (next_one[:, column].copy() for column in (ORBIT_TAU, ORBIT_W))  # the same for all
    labels.time[held] += label_starts(known, section, tau, w).time[0]


def _labels(known: Attractors, section: NextCollisionMap, tau: Array, w: Array) -> Basins:
    """Labels with IN_CONTACT kept apart."""
    apart = known._replace(after_contact=IN_CONTACT)
    return label_starts(apart, section, np.ascontiguousarray(tau), np.ascontiguousarray(w))

"""Labels of starts of the axial next-collision map: which attractor each goes to (paper, Fig. 4).

Starts are states (τ_imp, w_A) just before an impact, w_A in units of πg/ω. Labels are indices into
the attractors found beforehand, none of them given by the user; −1 is unresolved, never merged with
anything. `label_lanes` decides contact and periodic ends, `chaotic_labels` tells chaotic ends
apart.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.field_checks import numbers
from bouncing_disk_ros.maps.absorbing_region import AbsorbingRegion
from bouncing_disk_ros.maps.attractors import AttractorKind, Attractors, Cells
from bouncing_disk_ros.maps.label_maps import UNRESOLVED
from bouncing_disk_ros.maps.lanes.axial_lanes import iterate_axial, iterated
from bouncing_disk_ros.maps.lanes.label_lanes import (
    LaneRule,
    StartLabels,
    known_points,
    label_lanes,
)
from bouncing_disk_ros.maps.next_collision import NextCollisionMap

Floats = NDArray[np.float64]
Labels = NDArray[np.int32]
TRANSIENT, MOST = 500, 100_000
REACHED = 8
"""A periodic attractor is reached at this impact in a row that is near it."""
LONGER = 20
"""Starts that are still open get so many times the impacts: chaos may be a long transient."""
WATCHED = 200
"""Impacts that must all lie on a chaotic attractor's cells for a start to belong to it."""
EARLY = 64, 256
"""Impacts after which starts are looked for in the regions about chaotic attractors."""


class LabelRule(NamedTuple):
    """Rule that decides to which attractor a start belongs."""

    tolerance: float = 1e-4  # of τ (rad) and w_A (πg/ω) to a point of a periodic attractor
    repetitions: int = 4  # so often in a row it must go around, and at least REACHED impacts
    cap: int = (
        0  # impacts after which a start is unresolved; 0: `impacts_needed`, LONGER for the rest
    )


def label_starts(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule | None = None, regions: Mapping[int, AbsorbingRegion] | None = None,
) -> StartLabels:  # fmt: skip
    """Labels of starts (τ in [0, 2π), w_A <= 0) at Γ and ε of `section`: flat arrays (n,).

    1. A start that comes to contact belongs to the attractor of the orbit that leaves contact.
    2. A start whose impacts stay within `tolerance` of the points of a periodic attractor, in their
       order, for `repetitions` rounds, and at least REACHED impacts, belongs to it.
    3. After `cap` impacts it belongs to a chaotic attractor if its next WATCHED impacts all lie on
       cells that this attractor visits and no other one does; else it is unresolved.

    Each label depends on its own start alone, so the arrays may be cut anywhere. `regions` about
    chaotic attractors, by their labels, give the same labels sooner: a start that is in a region
    after EARLY impacts is followed no further. Raises InputError for starts that are none.

    >>> section = NextCollisionMap(axial_forcing=0.45, restitution=0.5)
    >>> tau, w = np.linspace(0.0, 6.0, 50), np.full(50, -1.3)
    >>> label_starts(find_attractors(section, [(1.0, -1.3)]), section, tau, w).label
    """
    rule = rule or LabelRule()
    tau, w = _starts(tau, w)
    n = len(tau)
    found = StartLabels(np.full(n, UNRESOLVED, np.int32), np.zeros(n, np.int32), np.empty(n))
    if regions:
        _label_early(attractors, section, tau, w, rule, regions, found)
    cap = rule.cap or impacts_needed(attractors, rule.tolerance)
    for impacts in (cap,) if rule.cap else (cap, LONGER * cap):
        _label(attractors, section, tau, w, rule._replace(cap=impacts), found)
    return found


def _starts(tau: Floats, w: Floats) -> tuple[Floats, Floats]:
    """Starts as the kernels take them, or InputError."""
    tau, w = numbers("tau", tau), numbers("w", w)
    if tau.ndim != 1 or tau.shape != w.shape:
        given = f"shapes {tau.shape}, {w.shape}"
        raise InputError("tau, w", given, "two flat arrays of one length")
    wrong = ~(np.isfinite(tau) & np.isfinite(w) & (w <= 0.0))
    if wrong.any():
        at = int(np.flatnonzero(wrong)[0])
        allowed = "finite numbers, w < 0, or 0 for a disk on the platform"
        raise InputError("tau, w", f"{tau[at]:g}, {w[at]:g} at place {at + 1}", allowed)
    return tau, w


def _label(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule, found: StartLabels,
) -> None:  # fmt: skip
    """Label the starts that `found` leaves open, by the rule, its cap given."""
    is_open = found.label == UNRESOLVED
    if is_open.all():  # as at first: to copy those that are open would hold the GIL
        _label_all(attractors, section, tau, w, rule, found)
    elif is_open.any():
        left = np.flatnonzero(is_open)
        part = StartLabels(found.label[left], found.impacts[left], found.time[left])
        _label_all(attractors, section, tau[left], w[left], rule, part)
        found.label[left], found.impacts[left], found.time[left] = part


def _label_all(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule, found: StartLabels,
) -> None:  # fmt: skip
    """Label starts of which none has a label, by the rule, its cap given."""
    label_followed(attractors, section, tau, w, rule, found)
    open_ = np.flatnonzero(found.label == UNRESOLVED)
    if len(open_) and any(a.kind is AttractorKind.CHAOTIC for a in attractors.found):
        found.label[open_] = chaotic_labels(attractors, section, tau[open_], w[open_], rule)
    found.time[open_] = math.nan


def _label_early(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule, regions: Mapping[int, AbsorbingRegion], found: StartLabels,
) -> None:  # fmt: skip
    """Label the starts that EARLY impacts decide, with the regions.

    Each start is followed from its beginning: in pieces it would have other roundings, and where it
    comes near to contact it might end elsewhere.
    """
    # chaotic attractors are the last: without them all other labels are the same
    others = tuple(one for one in attractors.found if one.kind is not AttractorKind.CHAOTIC)
    quiet = attractors._replace(found=others)
    platform = section.axial_forcing, section.restitution
    for impacts in EARLY:
        _label(quiet, section, tau, w, rule._replace(cap=impacts), found)
        left = np.flatnonzero(found.label == UNRESOLVED)
        after = iterated(tau[left], w[left], platform, impacts)
        for label, region in regions.items():
            found.label[left[region.hold(*after[:2])]] = label


def label_followed(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule, found: StartLabels,
) -> None:  # fmt: skip
    """Label starts that reach contact or a periodic attractor within the rule's cap, into `found`.

    The others are UNRESOLVED, with the time of `cap` impacts.
    """
    known = known_points(*_periodic_points(attractors), rule.repetitions)
    after_contact = attractors.after_contact
    lane_rule = LaneRule(rule.tolerance, float(REACHED), after_contact, after_contact, rule.cap)
    platform = (float(section.axial_forcing), float(section.restitution))
    label_lanes(tau, w, *platform, known, lane_rule, found)


def impacts_needed(attractors: Attractors, tolerance: float) -> int:
    """Limit of impacts that is enough to reach the slowest attractor, at most MOST.

    TRANSIENT impacts to come near, and three times those in which the distance to the slowest
    periodic attractor shrinks from 1 to the tolerance, by its multiplier in each round.
    """
    rounds = 0.0
    for attractor in attractors.found:
        if attractor.kind is AttractorKind.PERIODIC and 0.0 < attractor.multiplier < 1.0:
            each = len(attractor.forcing_phases) * math.log(tolerance)
            rounds = max(rounds, each / math.log(attractor.multiplier))
    return min(MOST, TRANSIENT + round(3.0 * rounds))


def _periodic_points(attractors: Attractors) -> tuple[Floats, NDArray[np.int32]]:
    """Points (m, 2) of the periodic attractors, and their labels (m,)."""
    points, of = [np.empty((0, 2))], [np.empty(0, np.int32)]
    for i, attractor in enumerate(attractors.found):
        if attractor.kind is AttractorKind.PERIODIC:
            points.append(np.stack((attractor.forcing_phases, attractor.velocities), axis=1))
            of.append(np.full(len(points[-1]), i, np.int32))
    return np.ascontiguousarray(np.concatenate(points)), np.concatenate(of)


def chaotic_labels(
    attractors: Attractors, section: NextCollisionMap, tau: Floats, w: Floats,
    rule: LabelRule,
) -> Labels:  # fmt: skip
    """Labels of starts that the cap left open, by the cells of the chaotic attractors."""
    tau, w = tau.copy(), w.copy()
    forcings = np.full_like(tau, section.axial_forcing)
    restitutions = np.full_like(tau, section.restitution)
    counts = np.zeros((len(tau), 2), np.int64)
    iterate_axial(tau, w, forcings, restitutions, rule.cap, counts)
    chaotic = [i for i, a in enumerate(attractors.found) if a.kind is AttractorKind.CHAOTIC]
    cells = [Cells(attractors.found[i]) for i in chaotic]
    on = np.ones((len(chaotic), len(tau)), bool)
    for _ in range(WATCHED):
        iterate_axial(tau, w, forcings, restitutions, 1, counts)
        for row, visited in enumerate(cells):
            on[row] &= visited.hold(tau, w)
    sure = on.sum(axis=0) == 1
    return np.where(sure, np.array(chaotic, np.int32)[on.argmax(axis=0)], UNRESOLVED)

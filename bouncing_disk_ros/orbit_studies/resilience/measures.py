"""How safe an attractor of the next-collision map is: all its measures at one Γ and ε."""

from __future__ import annotations

import math

import numpy as np

from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind
from bouncing_disk_ros.maps.basin_measures import shares
from bouncing_disk_ros.maps.next_collision import NextCollisionMap
from bouncing_disk_ros.maps.window_basins import Labelled
from bouncing_disk_ros.orbit_studies.fatal_changes import (
    FatalRule,
    fatal_impulses,
    fatal_timing_errors,
)
from bouncing_disk_ros.orbit_studies.orbit_instants import Array, impact_limits, instants_of


def measure(
    section: NextCollisionMap, window: Labelled, label: int, instants: int,
    after: Array, rule: FatalRule,
) -> dict[str, float | Array]:  # fmt: skip
    """All measures of one attractor by the names of the study's fields.

    `after` (k,): numbers of periods of the shares in time. Times are in periods: median and slow
    time those of starts of its basin until it is clear that they are on it.
    """
    known = window.known
    attractor = known.found[label]
    own = window.ends() == label
    share = shares(window.ends(), label + 1)[label]
    time = window.labels.time / math.tau
    direct = window.labels.label == label
    mine = time[own & np.isfinite(time)]
    sizes = fatal_impulses(section, known, label, instants_of(attractor, section, instants), rule)
    least = sizes
    if len(attractor.forcing_phases):
        limits = impact_limits(attractor, section)
        least = np.concatenate((sizes, fatal_impulses(section, known, label, limits, rule)), axis=1)
        errors = fatal_timing_errors(section, known, label, rule).min(axis=1)
    else:
        errors = np.full(2, math.nan)
    return {
        "share": share.fraction,
        "share_uncertainty": share.uncertainty,
        "share_without_contact": float(direct.mean()),
        "share_in_time": _share_in_time(attractor, mine, after, own.size),
        "convergence_time": convergence_time(attractor),
        "median_time": float(np.median(mine)) if len(mine) else math.nan,
        "slow_time": float(np.quantile(mine, 0.95)) if len(mine) else math.nan,
        "fatal_impulse": sizes,
        "least_fatal_impulse": least.min(axis=1),
        "fatal_timing_error": errors,
    }


def _share_in_time(attractor: Attractor, times: Array, after: Array, starts: int) -> Array:
    """Share of so many starts whose time is up after so many periods (k,)."""
    if attractor.kind is AttractorKind.CHAOTIC:
        return np.full(len(after), math.nan)
    return np.array([np.count_nonzero(times <= limit) / starts for limit in after])


def convergence_time(attractor: Attractor) -> float:
    """Periods in which a small distance shrinks to 1/e; 0 with contact, nan of chaos."""
    if attractor.kind is AttractorKind.CHAOTIC:
        return math.nan
    if attractor.kind is not AttractorKind.PERIODIC or attractor.multiplier == 0.0:
        return 0.0
    return -attractor.cycles / math.log(attractor.multiplier)

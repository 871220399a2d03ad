"""Attractors along the axis of a study: kept at each value, and matched into lines afterwards."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, SupportsInt

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from bouncing_disk_ros.angles import wrap_to_pi
from bouncing_disk_ros.maps.attractors import (
    Attractor,
    AttractorKind,
    attractor_name,
    numbered,
)
from bouncing_disk_ros.study.computation import Row, variables

Floats = NDArray[np.float64]

MOST_POINTS = 64
"""Points of each attractor that are kept, for its line."""
KINDS = list(AttractorKind)
FLAGS = {-1: "none", **{i: str(kind) for i, kind in enumerate(KINDS)}}
_ABOUT = {
    "kind": ("1", "kind of attractor"),
    "impacts": ("1", "impacts in one repetition"),
    "cycles": ("1", "periods in one repetition"),
    "multiplier": ("1", "largest multiplier in magnitude"),
    "share": ("1", "share of the window"),
    "share_uncertainty": ("1", "standard error of the share"),
    "share_without_contact": ("1", "share that reaches it without contact before"),
    "share_in_time": ("1", "share on it after so many periods"),
    "convergence_time": ("2 pi/omega", "time constant near it"),
    "median_time": ("2 pi/omega", "median time to reach it"),
    "slow_time": ("2 pi/omega", "time within which 95 % reach it"),
    "fatal_impulse": ("m pi g/omega", "smallest fatal impulse"),
    "least_fatal_impulse": ("m pi g/omega", "smallest fatal impulse at any instant"),
    "fatal_timing_error": ("rad", "smallest fatal timing error"),
}
"""Fields of a line of attractors -> unit and what they are; a study has some of them."""
THRESHOLD = 0.3
"""Attractors further apart (rad and πg/ω together) are not matched."""
MEMORY = 5
"""A line that has been missing at more values than this is over."""


def put_attractor(
    arrays: Mapping[str, np.ndarray], slot: int, attractor: Attractor, names: Mapping[str, str]
) -> None:
    """Write an attractor into a slot of arrays (1, slots …) of a study.

    `names`: kind, impacts, cycles and, if it is kept, multiplier -> the fields they go to.
    """
    n = len(attractor.forcing_phases)
    chosen = np.unique(np.linspace(0, n - 1, min(n, MOST_POINTS)).astype(int))
    periodic = attractor.kind is AttractorKind.PERIODIC
    values = {
        "kind": KINDS.index(attractor.kind), "impacts": n if periodic else 0,
        "cycles": attractor.cycles, "multiplier": attractor.multiplier,
    }  # fmt: skip
    for key, name in names.items():
        arrays[name][0, slot] = values[key]
    arrays["point_forcing_phase"][0, slot, : len(chosen)] = attractor.forcing_phases[chosen]
    arrays["point_velocity"][0, slot, : len(chosen)] = attractor.velocities[chosen]


def lines_of(
    result: xr.Dataset, fields: Mapping[str, str], threshold: float
) -> dict[str, xr.Variable]:
    """Fields over lines of attractors instead of their slots at each value, by name line_*.

    `fields`: what follows line_ -> the field over (value, attractor …); kind, impacts, cycles are
    among them.
    """
    kinds = result[fields["kind"]].values
    seen = [
        [_seen(result, kinds[k, i], k, int(i)) for i in np.flatnonzero(row >= 0)]
        for k, row in enumerate(kinds)
    ]
    numbers = match_attractors(seen, threshold)
    count = max((line + 1 for row in numbers for line in row), default=0)
    found: dict[str, Row] = {}
    for key, name in fields.items():
        field = result[name]
        values = np.full((count, *field.shape[:1], *field.shape[2:]), _fill(key), field.dtype)
        for k, row in enumerate(numbers):
            for i, line in zip(np.flatnonzero(kinds[k] >= 0), row, strict=True):
                values[line, k] = field.values[k, i]
        units, about = _ABOUT[key]
        dims = "line", "value", *map(str, field.dims[2:])
        found[f"line_{key}"] = dims, values, units, f"of each line: {about}"
    names = numbered(_names(found, count))
    found["line_name"] = "line", names, "1", "name of the attractor, first and last"
    return variables(found)


def _fill(name: str) -> float:
    return {"kind": -1, "impacts": 0, "cycles": 0}.get(name, math.nan)


def _seen(result: xr.Dataset, kind: int, k: int, i: int) -> Seen:
    points = np.stack(
        [result[f"point_{name}"].values[k, i] for name in ("forcing_phase", "velocity")], axis=1
    )
    return Seen(KINDS[int(kind)], points[~np.isnan(points[:, 0])])


def _names(found: Mapping[str, Row], count: int) -> list[str]:
    """What each line is called: what it is first, and the last if that is something else."""
    fields = {name: values for name, (_, values, _, _) in found.items()}
    names = []
    for line in range(count):
        places = np.flatnonzero(fields["line_kind"][line] >= 0)
        ends = [
            name_of(*(fields[f"line_{name}"][line, k] for name in ("kind", "impacts", "cycles")))
            for k in (places[0], places[-1])
        ]
        names.append(ends[0] if ends[0] == ends[1] else f"{ends[0]} … {ends[1]}")
    return names


def name_of(kind: SupportsInt, impacts: SupportsInt, cycles: SupportsInt) -> str:
    """What an attractor is called, by the fields of the study."""
    return attractor_name(KINDS[int(kind)], int(impacts), int(cycles))


# ------------------------------------------------------------------------------------------------
# Attractors along a parameter keep their number: those that are near each other are one line.
#
# The distance of two attractors is that of their points: the mean way from the points of each to
# the nearest one of the other, the larger of the two. Through a doubling, and from a cascade into
# its chaotic band, it grows from 0. Where two attractors are near one, the nearest pair is joined
# first. The attractor with contact is always one line: there is at most one.


class Seen(NamedTuple):
    """An attractor at one value."""

    kind: AttractorKind
    points: Floats  # (m, 2) τ and w_A; (0, 2) of rest


def attractor_distance(first: Floats, second: Floats) -> float:
    """Distance of two sets of points (m, 2), (n, 2); inf where one is empty."""
    if not len(first) or not len(second):
        return math.inf
    phase = wrap_to_pi(first[:, None, 0] - second[None, :, 0])
    apart = np.hypot(phase, first[:, None, 1] - second[None, :, 1])
    return float(max(apart.min(axis=1).mean(), apart.min(axis=0).mean()))


def match_attractors(
    values: Sequence[Sequence[Seen]], threshold: float = THRESHOLD
) -> list[list[int]]:
    """The number of the line that each attractor at each value is on, in the order given.

    Lines are numbered as they appear.
    """
    last: list[tuple[int, Seen]] = []  # of each line: where it was seen last, and what
    found = []
    for k, here in enumerate(values):
        own = _matched([(line, seen) for line, (at, seen) in enumerate(last)
                        if k - at <= MEMORY or _always(seen)], here, threshold)  # fmt: skip
        for i, seen in enumerate(here):
            if i not in own:
                own[i] = len(last)
                last.append((k, seen))
            last[own[i]] = k, seen
        found.append([own[i] for i in range(len(here))])
    return found


def _always(seen: Seen) -> bool:
    """Whether an attractor is the only one of its kind."""
    return seen.kind in (AttractorKind.REST, AttractorKind.CHATTERING)


def _matched(
    lines: Sequence[tuple[int, Seen]], here: Sequence[Seen], threshold: float
) -> dict[int, int]:
    """Attractor -> line, the nearest pairs first."""
    pairs = []
    for line, before in lines:
        for i, seen in enumerate(here):
            if _always(before) or _always(seen):
                size = 0.0 if before.kind is seen.kind else math.inf
            else:
                size = attractor_distance(before.points, seen.points)
            if size <= threshold:
                pairs.append((size, line, i))
    own: dict[int, int] = {}
    for _, line, i in sorted(pairs):
        if i not in own and line not in own.values():
            own[i] = line
    return own

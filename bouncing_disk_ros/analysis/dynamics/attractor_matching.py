"""Attractors along a parameter keep their number: those that are near each other are one line.

The distance of two attractors is that of their points: the mean way from the points of each to the
nearest one of the other, the larger of the two. Through a doubling, and from a cascade into its
chaotic band, it grows from 0. Where two attractors are near one, the nearest pair is joined first.
The attractor with contact is always one line: there is at most one (analysis.dynamics.attractors).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.dynamics.attractors import AttractorKind
from bouncing_disk_ros.analysis.phases import wrap_to_pi

Array = NDArray[np.float64]

THRESHOLD = 0.3
"""Attractors further apart (rad and πg/ω together) are not matched."""
MEMORY = 5
"""A line that has been missing at more values than this is over."""


class Seen(NamedTuple):
    """An attractor at one value."""

    kind: AttractorKind
    points: Array  # (m, 2) τ and w_A; (0, 2) of rest


def attractor_distance(first: Array, second: Array) -> float:
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

"""The bifurcation diagram over a range of Γ, for a picture that is zoomed: no Bokeh here."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.bifurcation_diagram import Branch, from_starts
from bouncing_disk_ros.maps.next_collision import NextCollisionMap, spread_starts
from bouncing_disk_ros.study.bifurcation.picture import density
from bouncing_disk_ros.study.bifurcation.tool import DEFINITION as BIFURCATION

COARSE, FULL = 160, 800
"""Values of Γ in a view: what is shown at first, and in the end."""
STARTS, SETTLING, KEPT = 16, 500, 128
"""Starts at each value, impacts of each that are left out, and shown."""
ROWS = 360
"""Cells of τ, fewer than a picture has pixels: else some would be lost."""
BEGIN, END = 0.3, 0.7
LEAST, MOST = 1e-3, 1e3
"""Range of Γ that can be shown."""
_TOGETHER = 80
"""Values computed between two questions whether it is still wanted: some 50 ms."""
_REMEMBERED = 12
"""Pieces of diagrams of _TOGETHER values that are kept, about a fine view: 1.3 MB each."""

Image = NDArray[np.float32]


class Diagram(NamedTuple):
    """Impacts on the attractors at n values of Γ, spread evenly from begin to end."""

    restitution: float
    begin: float
    end: float
    branches: tuple[Branch, ...]  # one after the other, rising Γ

    @property
    def columns(self) -> int:
        """Values of Γ, n."""
        return sum(len(branch.values) for branch in self.branches)


def diagram(
    restitution: float,
    begin: float,
    end: float,
    count: int,
    is_obsolete: Callable[[], bool] = lambda: False,
) -> Diagram | None:
    """The attractors that spread starts reach at `count` values; None if obsolete meanwhile.

    The values are the centres of `count` columns from begin to end. Raises InputError.
    """
    values = begin + (end - begin) * (np.arange(count) + 0.5) / count
    branches = []
    for first in range(0, count, _TOGETHER):
        if is_obsolete():
            return None
        branches.append(_branch(restitution, tuple(values[first : first + _TOGETHER].tolist())))
    return Diagram(restitution, begin, end, tuple(branches))


@lru_cache(maxsize=_REMEMBERED)
def _branch(restitution: float, values: tuple[float, ...]) -> Branch:
    """What `images` needs, kept for another look at it and for other sessions."""
    section = NextCollisionMap(values[0], restitution)
    starts = spread_starts(STARTS, float(BIFURCATION.options["velocity_begin"].default))
    counts = {"settling": SETTLING, "measured": KEPT, "kept": KEPT}
    found = from_starts(section, "axial_forcing", np.array(values), starts, **counts)
    nothing = np.empty(0)
    return found._replace(
        axial_impact_velocity=nothing, angular_velocity=nothing, ends=nothing,
        contact=np.empty(0, bool),
    )  # fmt: skip


def images(shown: Diagram, low: float, high: float) -> tuple[Image, Image]:
    """Shares (ROWS, n) of the impacts of each column in cells of τ from low to high, as log10.

    The first of starts that stay without contact, the second of those with; nan: none is there.
    """
    found: list[list[NDArray[np.float64]]] = [[], []]
    for branch in shown.branches:
        contact = (branch.contacts > 0.0)[..., None]
        for parts, mine in zip(found, (~contact, contact), strict=True):
            phases = np.where(mine, branch.forcing_phase, math.nan)
            parts.append(density(branch._replace(forcing_phase=phases), low, high, ROWS))
    with np.errstate(divide="ignore"):
        first, second = (np.log10(np.concatenate(parts, axis=1)) for parts in found)
    first[np.isinf(first)] = second[np.isinf(second)] = math.nan
    return first.astype(np.float32), second.astype(np.float32)

"""A region about a chaotic attractor that no impact leaves.

The cells of a grid that the attractor visits, with the cells that their images reach, and so on
until nothing is added (M. Dellnitz, A. Hohmann, "A subdivision algorithm for the computation of
unstable manifolds and global attractors", Numer. Math. 75, 1997). The image of a cell is that of a
grid of points in it, with the cells beside; neighbouring points must not be carried further apart
than these cells reach. So it is checked, not proved: between two points nothing is looked at.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.maps.attractors import Attractor, AttractorKind, Attractors
from bouncing_disk_ros.maps.lanes.axial_lanes import iterated
from bouncing_disk_ros.maps.next_collision import NextCollisionMap

GRIDS = 1024, 2048
"""Cells along a period that are tried, the smaller number first: a coarse region may leak."""
POINTS = 5
"""Points along each side of a cell; with one cell beside, images may be 3 cells apart."""
_APART = 3
_FASTER = 1.5
"""The grid goes to so many times the fastest impact of the attractor."""
_LARGEST = 0.1
"""Part of the grid that a region may have: else it is no region about the attractor alone."""

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


class AbsorbingRegion:
    """Cells of the plane (τ, w_A) that impacts do not leave."""

    def __init__(self, cells: Mask, side: float) -> None:
        """cells: rows by falling w_A from 0, columns by τ; side of a cell in rad and πg/ω."""
        self._cells, self._side = cells, side

    def hold(self, tau: Floats, w: Floats) -> Mask:
        """Which states (n,) lie in it; nan does not."""
        known = np.isfinite(tau) & np.isfinite(w)
        rows, columns = _places(np.where(known, tau, 0.0), np.where(known, w, 0.0),
                                self._side, self._cells.shape[1])  # fmt: skip
        within = known & (rows < len(self._cells))
        return within & self._cells[np.minimum(rows, len(self._cells) - 1), columns]


def absorbing_regions(
    section: NextCollisionMap, attractors: Attractors
) -> dict[int, AbsorbingRegion]:
    """Regions about the chaotic attractors by their labels, those that have one.

    None comes to contact from them, and none holds a point of another attractor.
    """
    found: dict[int, AbsorbingRegion] = {}
    for label, one in enumerate(attractors.found):
        region = None
        for cells in GRIDS:
            if one.kind is AttractorKind.CHAOTIC and region is None:
                region = _closed(section, one, cells)
        others = [other for other in attractors.found if other is not one]
        if region and not any(
            region.hold(other.forcing_phases, other.velocities).any() for other in others
        ):
            found[label] = region
    return found


def _closed(section: NextCollisionMap, one: Attractor, cells: int) -> AbsorbingRegion | None:
    """The region on a grid of so many cells along a period; None if it leaks."""
    side = math.tau / cells
    count = math.ceil(_FASTER * -float(one.velocities.min()) / side)
    inside = np.zeros((count, cells), bool)
    added = np.zeros_like(inside)
    added[_places(one.forcing_phases, one.velocities, side, cells)] = True
    while added.any():
        inside |= added
        if inside.sum() > _LARGEST * inside.size:
            return None
        image = _image(section, np.argwhere(added), side, inside.shape)
        if image is None:
            return None
        added = image & ~inside
    return AbsorbingRegion(inside, side)


def _image(
    section: NextCollisionMap, places: NDArray[np.intp], side: float, shape: tuple[int, int]
) -> Mask | None:
    """The cells that those at `places` (n, 2) are carried to, with the cells beside; None: out."""
    offsets = (np.arange(POINTS) + 0.5) / POINTS
    down, across = np.meshgrid(offsets, offsets, indexing="ij")
    w = (-(places[:, :1, None] + down) * side).ravel()
    tau = ((places[:, 1:, None] + across) * side).ravel()
    tau, w, counts = iterated(tau, w, section.axial_parameters, 1)
    if counts.any():
        return None  # contact
    rows, columns = _places(tau, w, side, shape[1])
    if rows.min() < 1 or rows.max() > shape[0] - 2:
        return None
    if not _are_near(rows.reshape(-1, POINTS, POINTS), columns.reshape(-1, POINTS, POINTS), shape):
        return None
    image = np.zeros(shape, bool)
    image[rows, columns] = True
    image[1:-1] |= image[:-2] | image[2:]  # right to left: numpy reads before it writes
    return image | np.roll(image, 1, axis=1) | np.roll(image, -1, axis=1)


def _are_near(rows: NDArray[np.intp], columns: NDArray[np.intp], shape: tuple[int, int]) -> bool:
    """Whether neighbouring points of each cell (n, POINTS, POINTS) are carried near each other."""
    for axis in (1, 2):
        turned = np.abs(np.diff(columns, axis=axis))
        turned = np.minimum(turned, shape[1] - turned)
        if max(int(np.abs(np.diff(rows, axis=axis)).max()), int(turned.max())) > _APART:
            return False
    return True


def _places(
    tau: Floats, w: Floats, side: float, cells: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of states (n,)."""
    rows = np.floor(-w / side).astype(np.intp)
    return rows, np.floor(tau / side).astype(np.intp) % cells

"""The next-collision section and the return map of a run, from its rows of impacts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, ImpactKind, Motion
from bouncing_disk_ros.maps.scales import velocity_scale


class Axis(NamedTuple):
    """Values with what they are called."""

    name: str
    symbol: str
    unit: str
    values: NDArray[np.float64]  # shape (n,)

    @property
    def label(self) -> str:
        """For an axis of a figure: τ_imp (rad)."""
        return f"{self.symbol} ({self.unit})"


class Section(NamedTuple):
    """Single impacts as points just before the impact."""

    row_index: NDArray[np.int64]  # of the rows, shape (n,)
    forcing_phase: Axis  # in [0, 2π)
    axial_impact_velocity: Axis  # negative


class ReturnMap(NamedTuple):
    """Pairs of impacts that followed one another."""

    row_index: NDArray[np.int64]  # of the first of each pair, shape (n,)
    forcing_phase: Axis
    next_forcing_phase: Axis
    axial_impact_velocity: Axis
    next_axial_impact_velocity: Axis


def single_impacts(rows: NDArray[np.void]) -> NDArray[np.bool_]:
    """Which rows (IMPACT_DTYPE) are one impact each: only these lie on the section, shape (n,)."""
    single: NDArray[np.bool_] = (rows["kind"] == ImpactKind.IMPACT) & (rows["count"] == 1)
    return single


def section_of(rows: NDArray[np.void], motion: Motion, disk: Disk) -> Section:
    """The next-collision section (τ_imp, w_A) of rows (IMPACT_DTYPE) under one steady motion.

    Rows that sum several impacts are left out: they have no one phase.
    """
    rows = rows[single_impacts(rows)]
    return Section(rows["index"].astype(np.int64), _phase(rows), _velocity(rows, motion, disk))


def return_map_of(rows: NDArray[np.void], motion: Motion, disk: Disk) -> ReturnMap:
    """The return map τ_n → τ_{n+1}, w_n → w_{n+1} of rows (IMPACT_DTYPE) under one steady motion.

    No pair reaches across a gap in the index (lost rows) or a row that sums several impacts.
    """
    single = single_impacts(rows)
    pairs = single[:-1] & single[1:] & (np.diff(rows["index"]) == 1.0)
    first, second = rows[:-1][pairs], rows[1:][pairs]
    return ReturnMap(
        first["index"].astype(np.int64),
        _phase(first, "n"),
        _phase(second, "n+1"),
        _velocity(first, motion, disk, "n"),
        _velocity(second, motion, disk, "n+1"),
    )


def _phase(rows: NDArray[np.void], at: str = "imp") -> Axis:
    symbol = "τ_imp" if at == "imp" else f"τ_{at}"
    return Axis("forcing_phase", symbol, "rad", rows["forcing_phase"].copy())


def _velocity(rows: NDArray[np.void], motion: Motion, disk: Disk, at: str = "imp") -> Axis:
    symbol = "w_A" if at == "imp" else f"w_{at}"
    values = rows["axial_impact_velocity"] / velocity_scale(motion, disk)
    return Axis("axial_impact_velocity", symbol, "πg/ω", values)

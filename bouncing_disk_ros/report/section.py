"""The next-collision section and the return map of a run, from its rows of impacts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import IMPACT_DTYPE, Disk, ImpactKind, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.maps.scales import velocity_scale

Rows = NDArray[np.void]
_NAMES = IMPACT_DTYPE.names or ()


def rows_of(given: object) -> Rows:
    """Rows (n,) of IMPACT_DTYPE as they were given; InputError for anything else.

    So also for a frame, which has rows by labels.
    """
    shown = type(given).__name__
    if isinstance(given, np.ndarray) and given.dtype.names:
        missing = [name for name in _NAMES if name not in given.dtype.names]
        if given.ndim == 1 and not missing:
            return given
        shown = f"rows without {missing[0]}" if missing else f"an array of shape {given.shape}"
    hint = "frame.to_records(index=False) makes one of a frame."
    allowed = "an array (n,) of IMPACT_DTYPE, such as read_run(...).rows"
    raise InputError("rows", shown, allowed, hint)


def single_impacts(rows: Rows) -> NDArray[np.bool_]:
    """Which rows are one impact each, shape (n,): only these lie on the section.

    Rows that sum several impacts have no one phase.
    """
    single: NDArray[np.bool_] = (rows["kind"] == ImpactKind.IMPACT) & (rows["count"] == 1)
    return single


def section_velocity(rows: Rows, motion: Motion, disk: Disk) -> NDArray[np.float64]:
    """w_A/(πg/ω) of rows under one steady motion, shape (n,); negative."""
    velocity: NDArray[np.float64] = rows["axial_impact_velocity"] / velocity_scale(motion, disk)
    return velocity


def successive_impacts(rows: Rows) -> tuple[Rows, Rows]:
    """Pairs of impacts that followed one another, n → n+1: all the first ones, all the second ones.

    No pair reaches across a gap in the index (lost rows) or a row that sums several impacts.
    """
    single = single_impacts(rows)
    pairs = single[:-1] & single[1:] & (np.diff(rows["index"]) == 1.0)
    return rows[:-1][pairs], rows[1:][pairs]

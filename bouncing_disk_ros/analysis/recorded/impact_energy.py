"""Energy losses of impacts from their rows alone, compared with the simulator's energy ledger."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.recorded.run_record import Change, Health
from bouncing_disk_ros.analysis.recorded.segments import known
from bouncing_disk_ros.core.model import Disk

Column = NDArray[np.float64]


class ImpactEnergy(NamedTuple):
    """Losses of each row of IMPACT_DTYPE, J, shape (n,)."""

    axial: Column  # m (1 − ε²) w_A²/2
    friction: Column  # −Ĥ (w_T + Ĥ/(2 m a_g²)): the impulse times the mean slip
    summed: NDArray[np.bool_]  # rows of several impacts: their losses are those of the first only


def impact_energy(rows: NDArray[np.void], disk: Disk) -> ImpactEnergy:
    """The losses in impacts of rows under one set of disk parameters."""
    fall = rows["axial_impact_velocity"]
    axial = 0.5 * disk.mass * (1.0 - disk.restitution**2) * fall * fall
    twist = rows["angular_impulse"]
    inertia = disk.inertia
    summed = rows["count"] > 1
    # a row of several impacts has the sum of their impulses, but the slip before the first of them
    friction = -twist * (rows["angular_impact_velocity"] + 0.5 * twist / inertia)
    return ImpactEnergy(axial, np.where(summed, 0.0, friction), summed)


class LedgerCheck(NamedTuple):
    """Losses in impacts over one stretch: by the simulator's ledger, and by the rows."""

    begin: float  # simulated s
    end: float
    rows: int
    summed: int  # rows of several impacts among them
    missing: int  # rows lost in between
    start_axial: float  # in the ledger at `begin`, J
    start_friction: float
    ledger_axial: float  # since then, J
    ledger_friction: float
    rows_axial: float
    rows_friction: float
    in_summed: float  # about what the impacts in `summed` rows lose axially, J: m w_A²/2 of each


def check_ledger(
    rows: NDArray[np.void],
    health: Sequence[Health],
    changes: Sequence[Change],
    disks: Sequence[tuple[float, Disk]],
) -> LedgerCheck | None:
    """Compare over the longest stretch at the end in which the ledger and the disk stay the same.

    The ledger counts from the start or the last reset, and so does the stretch where the rows do;
    else it begins with the first report after the last change of parameters. None: no reports, no
    rows, or the disk is unknown.
    """
    reset, changed = (_last(changes, what) for what in ("reset", "parameters"))
    reports = [row for row in health if row.simulated > max(reset, changed) and row.energy]
    if not reports or not len(rows) or not disks or not known(disks[-1][1]):
        return None
    begin, axial, friction = reset, 0.0, 0.0
    if changed > reset or (reset < 0.0 and rows["index"][0] > 0.0):
        first = reports[0].energy
        assert first is not None
        begin = reports[0].simulated
        axial, friction = first.loss_impact_axial, first.loss_impact_friction
    last = reports[-1]
    assert last.energy is not None
    # a disk that starts in contact and falls behind has an impact at the very instant of a reset
    low = np.searchsorted(rows["time"], begin, side="left" if begin == reset else "right")
    high = np.searchsorted(rows["time"], last.simulated, side="right")
    part = rows[int(low) : int(high)]
    if not len(part):
        return None
    found = impact_energy(part, disks[-1][1])
    fall = part["axial_impact_velocity"][found.summed]
    return LedgerCheck(
        max(begin, 0.0),
        last.simulated,
        len(part),
        int(np.sum(found.summed)),
        int(part["index"][-1] - part["index"][0]) + 1 - len(part),
        axial,
        friction,
        last.energy.loss_impact_axial - axial,
        last.energy.loss_impact_friction - friction,
        float(np.sum(found.axial[~found.summed])),
        float(np.sum(found.friction)),
        float(np.sum(0.5 * disks[-1][1].mass * fall * fall)),
    )


def _last(changes: Sequence[Change], what: str) -> float:
    return max((change.time for change in changes if change.what == what), default=-1.0)

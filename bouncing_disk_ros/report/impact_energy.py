"""Energy losses of impacts from their rows alone, compared with the simulator's energy ledger."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import Disk, Energy
from bouncing_disk_ros.report.run_record import HealthReport
from bouncing_disk_ros.report.section import single_impacts
from bouncing_disk_ros.report.spans import INSTANT, Spans, known

Column = NDArray[np.float64]
Rows = NDArray[np.void]


class ImpactEnergy(NamedTuple):
    """Losses of each row of IMPACT_DTYPE, J, shape (n,)."""

    axial: Column  # m (1 − ε²) w_A²/2
    friction: Column  # −Ĥ (w_T + Ĥ/(2 m a_g²)): the impulse times the mean slip
    summed: NDArray[np.bool_]  # rows of chatters: their losses are those of the first impact only


def impact_energy(rows: NDArray[np.void], disk: Disk) -> ImpactEnergy:
    """The losses in impacts of rows under one set of disk parameters."""
    fall = rows["axial_impact_velocity"]
    axial = 0.5 * disk.mass * (1.0 - disk.restitution**2) * fall * fall
    twist = rows["angular_impulse"]
    inertia = disk.inertia
    # a row of a chatter has the sum of all impulses, but the slip before the first; the one that
    # ends in contact has a rest without end too, however few impacts it counts
    summed = ~single_impacts(rows)
    friction = -twist * (rows["angular_impact_velocity"] + 0.5 * twist / inertia)
    return ImpactEnergy(axial, np.where(summed, 0.0, friction), summed)


class LedgerCheck(NamedTuple):
    """Losses in impacts between two instants: by the simulator's ledger, and by the rows."""

    begin: float  # simulated s: the start, a reset, or a report
    end: float  # a report
    disk: Disk
    first: int  # index of the first row after `begin`
    last: int  # index of the first row after `end`
    rows: int  # in between, of those recorded
    summed: int  # rows of chatters among them
    missing: int  # rows in between that the record lacks
    start_axial: float  # in the ledger at `begin`, J
    start_friction: float
    ledger_axial: float  # since then, J
    ledger_friction: float
    rows_axial: float
    rows_friction: float
    in_summed: float  # about what the impacts in `summed` rows lose axially, J: m w_A²/2 of each


class _Mark(NamedTuple):
    """An instant at which the ledger is known, and the index of the first row after it."""

    time: float
    row: int
    energy: Energy


def check_ledger(rows: Rows, health: Sequence[HealthReport], spans: Spans) -> LedgerCheck | None:
    """Compare over the longest stretch at the end without a reset or a change of parameters.

    Both ends are instants at which the ledger is known, and so is which rows are before them: the
    start, a reset, or a report with no chatter under way. None: there are no two such instants with
    rows in between, or the disk is unknown.
    """
    reports = [row for row in health if row.energy is not None]
    if not len(rows):
        return None
    for place in range(len(reports) - 1, -1, -1):
        end = _mark(reports[place], rows)
        found = _up_to(end, rows, reports[:place], spans) if end else None
        if found is not None:
            return found
    return None


def _up_to(
    end: _Mark, rows: Rows, before: Sequence[HealthReport], spans: Spans
) -> LedgerCheck | None:
    """The longest comparison that ends at a mark."""
    disk = next((one.disk for one in reversed(spans.segments) if one.begin <= end.time), None)
    since = spans.unchanged_since(end.time)
    if disk is None or not known(disk) or not since <= end.time:
        return None
    begin = _origin(rows, spans, end.time, since)
    for report in before if begin is None else ():
        if report.simulated > since:
            begin = _mark(report, rows)
        if begin is not None and begin.row >= int(rows["index"][0]):
            break
    return None if begin is None else _compared(rows, disk, begin, end)


def _mark(report: HealthReport, rows: Rows) -> _Mark | None:
    """The report as a mark; None where the next row is not at hand, or a chatter is under way."""
    assert report.energy is not None
    if report.rows >= 0:
        place = int(np.searchsorted(rows["index"], report.rows))
    elif _is_near(rows, report.simulated):
        return None
    else:
        place = int(np.searchsorted(rows["time"], report.simulated))
    if place == len(rows) or (report.rows >= 0 and rows["index"][place] != report.rows):
        return None
    if not single_impacts(rows[place : place + 1])[0]:
        return None
    return _Mark(report.simulated, int(rows["index"][place]), report.energy)


def _origin(rows: Rows, spans: Spans, end: float, since: float) -> _Mark | None:
    """The start or the last reset as a mark.

    None where the parameters changed after it, or where rows after it may be missing.
    """
    origin = spans.origin(end)
    if origin is None or origin < since:
        return None
    nothing = Energy(*[0.0] * len(Energy._fields))
    if origin == 0.0:
        return _Mark(0.0, 0, nothing) if rows["index"][0] == 0.0 else None
    place = int(np.searchsorted(rows["time"], origin))
    if _is_near(rows, origin) or not 0 < place < len(rows):
        return None
    before, after = (int(rows["index"][at]) for at in (place - 1, place))
    return _Mark(origin, after, nothing) if after == before + 1 else None


def _is_near(rows: Rows, time: float) -> bool:
    """Whether an impact is so near an instant that nothing tells which was first."""
    low, high = np.searchsorted(rows["time"], (time - INSTANT, time + INSTANT))
    return bool(low < high)


def _compared(rows: Rows, disk: Disk, begin: _Mark, end: _Mark) -> LedgerCheck | None:
    """What the rows between two marks lose, beside the ledger."""
    low, high = np.searchsorted(rows["index"], (begin.row, end.row))
    part = rows[int(low) : int(high)]
    if not len(part):
        return None
    found = impact_energy(part, disk)
    fall = part["axial_impact_velocity"][found.summed]
    return LedgerCheck(
        begin.time,
        end.time,
        disk,
        begin.row,
        end.row,
        len(part),
        int(np.sum(found.summed)),
        end.row - begin.row - len(part),
        begin.energy.loss_impact_axial,
        begin.energy.loss_impact_friction,
        end.energy.loss_impact_axial - begin.energy.loss_impact_axial,
        end.energy.loss_impact_friction - begin.energy.loss_impact_friction,
        float(np.sum(found.axial[~found.summed])),
        float(np.sum(found.friction)),
        float(np.sum(0.5 * disk.mass * fall * fall)),
    )

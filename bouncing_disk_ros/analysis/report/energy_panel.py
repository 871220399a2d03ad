"""The panel of the energy ledger: as the simulator reports them, and as the impacts give them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.analysis.recorded.impact_energy import impact_energy
from bouncing_disk_ros.analysis.recorded.run_record import Health
from bouncing_disk_ros.analysis.report.panel import Panel, SeriesStyle, envelope, series
from bouncing_disk_ros.analysis.report.run_report import Report

_LEDGER = (
    ("work, axial", "work_axial", 0),
    ("work, angular", "work_angular", 5),
    ("loss in impacts, axial", "loss_impact_axial", 1),
    ("loss in impacts, friction", "loss_impact_friction", 3),
    ("loss in sliding", "loss_sliding", 2),
    ("taken by the brake", "loss_brake", 4),
)
_RINGS = 40
"""Recomputed points in the panel."""


def time_range(report: Report) -> tuple[float, float]:
    """What axes of simulated time show, s: the run and a little more."""
    margin = 0.02 * (report.end - report.begin)
    return report.begin - margin, report.end + margin


def rows_before(rows: NDArray[np.void], health: Health) -> int:
    """How many of some rows came before a report: by its count of them, else by its time."""
    if health.rows >= 0:
        return int(np.searchsorted(rows["index"], health.rows))
    return int(np.searchsorted(rows["time"], health.simulated, side="right"))


def energy_panel(report: Report, most: int) -> Panel:
    """The ledger over time; rings are the losses recomputed from the impacts."""
    health = [row for row in report.record.health if row.energy is not None]
    drawn, note = [], ""
    times = np.array([row.simulated for row in health])
    for name, field, colour in _LEDGER if health else ():
        values = np.array([getattr(row.energy, field) for row in health])
        keep = envelope(values, most)
        if len(keep) < len(values):
            note = f"{len(keep)} of {len(values)} reports. "
        look = SeriesStyle.WIDE if name.startswith("work") else SeriesStyle.LINE
        drawn.append(series(name, times[keep], values[keep], look, colour))
    check = report.ledger
    if check is not None:
        first, last = np.searchsorted(report.rows["index"], (check.first, check.last))
        rows = report.rows[int(first) : int(last)]
        losses = impact_energy(rows, check.disk)
        within = [row for row in health if check.begin <= row.simulated <= check.end]
        some = np.linspace(0, len(within) - 1, min(len(within), _RINGS)).astype(int)
        shown = [within[place] for place in np.unique(some)]
        until = [rows_before(rows, one) for one in shown]
        axial = np.where(losses.summed, 0.0, losses.axial)
        for name, each, start, colour in (
            ("axial", axial, check.start_axial, 1),
            ("friction", losses.friction, check.start_friction, 3),
        ):
            summed = np.concatenate(([0.0], np.cumsum(each)))
            drawn.append(
                series(
                    f"{name}, from the impacts",
                    np.array([one.simulated for one in shown]),
                    start + summed[until],
                    SeriesStyle.RINGS,
                    colour,
                )
            )
        note += "Rings: losses recomputed from the impacts. "
    return Panel("Energy ledger", "simulated time t (s)", "energy E (J)", drawn, note,
                 x_range=time_range(report), topics=("/diagnostics",))  # fmt: skip

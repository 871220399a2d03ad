"""Energy, real time and loss of a report in words."""

from __future__ import annotations

import math

from bouncing_disk_ros.analysis.report.estimate_text import Pairs
from bouncing_disk_ros.analysis.report.run_report import ABSENT, Report
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.parsing import read_json


def energy(report: Report) -> Pairs:
    """The simulator's energy ledger, and what the impacts give."""
    found: Pairs = []
    last = next((h for h in reversed(report.record.health) if h.energy), None)
    if last is None or last.energy is None:
        found.append(("energy ledger of the simulator", _no_diagnostics(report)))
    else:
        e = last.energy
        found += [
            ("ledger at", f"{last.simulated:.3f} s, since the start or the last reset"),
            ("work of the platform", f"{e.work_axial:.6g} J axial, {e.work_angular:.6g} J angular"),
            ("work of impulses, parameters", f"{e.work_impulses:.4g} J, {e.work_parameters:.4g} J"),
            (
                "loss in impacts",
                (f"{e.loss_impact_axial:.6g} J axial, {e.loss_impact_friction:.6g} J friction"),
            ),
            ("loss in sliding contact", f"{e.loss_sliding:.6g} J"),
            (
                "balance residual",
                (f"{max(h.residual for h in report.record.health):.1e} of the throughput, largest"),
            ),
        ]
    return [*found, *_checked(report)]


def _checked(report: Report) -> Pairs:
    check = report.ledger
    if check is None:
        return [
            (
                "recomputed from impacts",
                ("not possible: needs impacts, the disk's parameters and reports on /diagnostics"),
            )
        ]
    rest = f", {check.missing} rows lost" if check.missing else ""
    summed = ""
    if check.summed:
        summed = f"; {check.summed} rows of chatters left out: about {check.in_summed:.2g} J axial"
    return [
        (
            "recomputed from",
            (f"{check.rows} rows, {check.begin:.3f} s to {check.end:.3f} s{rest}{summed}"),
        ),
        (
            "axial loss in them",
            f"{check.rows_axial:.6g} J, ledger {check.ledger_axial:.6g} J",
        ),
        (
            "friction loss in them",
            (f"{check.rows_friction:.6g} J, ledger {check.ledger_friction:.6g} J"),
        ),
    ]


def real_time(report: Report) -> Pairs:
    """How the simulator kept time, and what was lost on the way."""
    found: Pairs = []
    real = report.real_time
    if real is None:
        found.append(("real time", _no_diagnostics(report)))
    else:
        reached = f"{real.reached:.4f}"
        if math.isnan(real.reached):
            reached = f"not known from {real.reports} report{'s' if real.reports > 1 else ''}"
        p50, p99, largest = (1e3 * value for value in real.lateness)
        found += [
            ("real-time factor", f"asked {real.asked}, reached {reached}"),
            (
                "lateness of the ticks",
                (f"p50 {p50:.2f} ms, p99 {p99:.2f} ms, largest {largest:.2f} ms"),
            ),
            ("simulated time behind", f"at most {1e3 * real.behind:.1f} ms"),
            ("samples skipped", str(real.skipped)),
            ("inputs refused", str(real.refused)),
        ]
    found.append(("impacts lost by index", f"{report.record.lost} rows"))
    lost = [t for t in report.source.topics if t.lost != "0"]
    found.append(("messages lost by number", "; ".join(f"{t.topic} {t.lost}" for t in lost) or "0"))
    return [*found, *_noted(report)]


def _no_diagnostics(report: Report) -> str:
    return f"/diagnostics is {report.source.absence('/diagnostics')}"


def _noted(report: Report) -> Pairs:
    notes = report.source.notes or {}
    if "lost" not in notes:
        return [("recorder's notes", ABSENT)]
    try:
        lost = read_json("lost", notes["lost"]) or "0"
        dropped = read_json("dropped", notes.get("received_but_not_recorded", "{}")) or "0"
    except InputError:
        return [("recorder's notes", "not to be understood")]
    return [
        (
            "recorder's notes",
            (
                f"lost on the way {_flat(lost)}, impact rows "
                f"{notes.get('lost_impact_rows', '?')}, received but not recorded {_flat(dropped)}"
            ),
        )
    ]


def _flat(value: object) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {number}" for key, number in value.items())
    return str(value)

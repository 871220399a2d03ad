"""The tables of a report on energy, real time and loss."""

from __future__ import annotations

import math

from bouncing_disk_ros.analysis.report.run_report import ABSENT, Pace, Report
from bouncing_disk_ros.errors import InputError, counted
from bouncing_disk_ros.parsing import read_json

Pairs = list[tuple[str, str]]


def span_text(report: Report, begin: float, end: float) -> str:
    """Two simulated times in words."""
    return f"{begin:.{report.decimals}f} s to {end:.{report.decimals}f} s"


def energy(report: Report) -> Pairs:
    """The simulator's energy ledger, and what the impacts give."""
    found: Pairs = []
    last = next((h for h in reversed(report.record.health) if h.energy), None)
    if last is None or last.energy is None:
        found.append(("energy ledger of the simulator", _no_diagnostics(report)))
    else:
        e = last.energy
        found += [
            (
                "ledger at",
                f"{last.simulated:.{report.decimals}f} s, {_since(report, last.simulated)}",
            ),
            ("work of the platform", f"{e.work_axial:.6g} J axial, {e.work_angular:.6g} J angular"),
            ("work of impulses, parameters", f"{e.work_impulses:.4g} J, {e.work_parameters:.4g} J"),
            (
                "loss in impacts",
                (f"{e.loss_impact_axial:.6g} J axial, {e.loss_impact_friction:.6g} J friction"),
            ),
            ("loss in sliding contact", f"{e.loss_sliding:.6g} J"),
            *([("taken by the brake", f"{e.loss_brake:.6g} J")] if e.loss_brake else []),
            (
                "balance residual",
                (f"{max(h.residual for h in report.record.health):.1e} of the throughput, largest"),
            ),
        ]
    return [*found, *_checked(report)]


def _since(report: Report, time: float) -> str:
    """From when on the ledger counts, in words."""
    origin = report.spans.origin(time)
    if origin is None:
        return "since the start or a reset that the record lacks"
    return f"since the reset at {origin:.{report.decimals}f} s" if origin else "since the start"


def _checked(report: Report) -> Pairs:
    check = report.ledger
    if check is None:
        return [
            (
                "recomputed from impacts",
                (
                    "not possible: needs the disk's parameters, and impacts between two reports on "
                    "/diagnostics without a reset or a change of parameters"
                ),
            )
        ]
    rest = f", {counted(check.missing, 'row')} lost" if check.missing else ""
    summed = ""
    if check.summed:
        left = f"{counted(check.summed, 'row')} of chatters left out"
        summed = f"; {left}: about {check.in_summed:.2g} J axial"
    return [
        (
            "recomputed from",
            (f"{check.rows} rows, {span_text(report, check.begin, check.end)}{rest}{summed}"),
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
        p50, p99, largest = (1e3 * value for value in real.lateness)
        found += [
            *(("real-time factor", _pace(pace)) for pace in real.paces),
            (
                "lateness of the ticks",
                (f"p50 {p50:.2f} ms, p99 {p99:.2f} ms, largest {largest:.2f} ms"),
            ),
            ("simulated time behind", f"at most {1e3 * real.behind:.1f} ms"),
            ("samples skipped", f"{real.skipped} since the start"),
            ("inputs refused", f"{real.refused} since the start"),
        ]
    found.append(("impacts lost by index", _lost(report)))
    lost = [t for t in report.source.topics if t.lost != "0"]
    found.append(("messages lost by number", "; ".join(f"{t.topic} {t.lost}" for t in lost) or "0"))
    return [*found, *_noted(report)]


def _pace(pace: Pace) -> str:
    unknown = "not known: no two reports in one go, as far as disk/inputs tells"
    reached = unknown if math.isnan(pace.reached) else f"{pace.reached:.4f}"
    return f"asked {pace.asked}, reached {reached}"


def _lost(report: Report) -> str:
    """The gaps in the index of the rows, and between which instants."""
    rows = report.rows
    if not len(rows):
        return f"not known: disk/impacts is {report.source.absence('disk/impacts')}"
    return f"{counted(report.lost, 'row')}, {span_text(report, *rows['time'][[0, -1]])}"


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
        return [("recorder's notes", "cannot be read")]
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

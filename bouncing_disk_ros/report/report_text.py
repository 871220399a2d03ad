"""A report in words: its tables, for the terminal and for the page, and the terminal's lines."""

from __future__ import annotations

import math
import sys

from bouncing_disk_ros.errors import InputError, counted
from bouncing_disk_ros.maps.motor_curves import mean_speed, no_load_speed
from bouncing_disk_ros.maps.period_one import period_one
from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.parsing import read_json
from bouncing_disk_ros.report.estimate import Estimate
from bouncing_disk_ros.report.impact_text import terminal_width
from bouncing_disk_ros.report.panel import Pairs, Table
from bouncing_disk_ros.report.rise_time import RiseTime
from bouncing_disk_ros.report.run_record import ABSENT
from bouncing_disk_ros.report.run_report import Pace, Report, SegmentReport
from bouncing_disk_ros.report.spans import known
from bouncing_disk_ros.report.steady_speed import Mean
from bouncing_disk_ros.report.transient import FEWEST, Transient, TransientKind
from bouncing_disk_ros.units import with_prefix


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


# ------------------------------------------------------------------------------------------------
# A report as tables of words: what stands on the terminal and in the page, written once.


LAST_ONLY = "by platform/motion, which has only the last change of each slice of work"


def tables(report: Report) -> list[Table]:
    """Everything in words but the list of segments."""
    return [
        Table("Recording", _recording(report)),
        Table(f"Segment {report.shown + 1}", _drive(report)),
        Table("Orbit", _orbit(report)),
        Table("Rotor speed", _speed(report)),
        Table("Estimates from the impacts (95 % intervals)", _estimates(report)),
        Table("Energy", energy(report)),
        Table("Real time and loss", real_time(report)),
    ]


def _recording(report: Report) -> Pairs:
    source, rows = report.source, report.rows
    run = f", run {source.run} of {source.runs}" if source.runs > 1 else ""
    single = int((rows["count"] == 1).sum())
    summed = int(rows["count"].sum()) - single
    chatter = f", {summed} of chatters in {counted(len(rows) - single, 'row')}" if summed else ""
    impacts = f"disk/impacts is {source.absence('disk/impacts')}"
    if len(rows):
        span = span_text(report, float(rows["time"][0]), float(rows["time"][-1]))
        impacts = f"{single + summed}{chatter}, {span}"
    found = [
        ("bag", f"{source.name}, simulator {source.namespace}{run}"),
        ("simulated time", span_text(report, report.begin, report.end)),
        ("impacts", impacts),
    ]
    found += [("version", source.version)] if source.version else []
    found += [(ABSENT, ", ".join(source.missing))] if source.missing else []
    found += [("without messages", ", ".join(source.empty))] if source.empty else []
    found += [("left out", limit) for limit in source.limits]
    return [*found, *(("damage", remark) for remark in source.remarks)]


def _why_unknown(report: Report, begin: float, *topics: str) -> str:
    """Why nothing is known of what topics say at an instant."""
    if report.record.known and not report.spans.knows_inputs(begin, begin):
        return "not known: records of disk/inputs are missing here"
    first, *more = topics
    beside = f" (without all of {', '.join(more)})" if more else ""
    return f"not known: {first} is {report.source.absence(first)}{beside}"


def _drive(report: Report) -> Pairs:
    if report.chosen is None:
        return [("nothing", "the bag has no simulated time")]
    segment = report.chosen.segment
    found = [
        (
            "time",
            f"{span_text(report, segment.begin, segment.end)}, begins with {segment.began_by}",
        )
    ]
    if motion := segment.motion:
        text = (
            f"A {1e3 * motion.axial_amplitude:.6g} mm, Φ {motion.angular_amplitude:.6g} rad, f "
            f"{motion.frequency:.6g} Hz, θ {motion.phase_lag:.6g} rad"
        )
        partly = "" if report.record.known else f"; {LAST_ONLY}"
        found.append(("platform", text + partly))
    elif report.record.motions:
        found.append(("platform", "not known: records of its motion are missing here"))
    else:
        found.append(("platform", f"platform/motion is {report.source.absence('platform/motion')}"))
    if report.chosen.off.impacts:
        found.append(("not so", str(report.chosen.off)))
    if report.chosen.rows:
        part = report.chosen
        lost = f", {counted(part.lost, 'row')} lost between them" if part.lost else ""
        found.append(("impacts", f"{part.impacts} in {counted(part.rows, 'row')}{lost}"))
    if moved := report.chosen.trajectories:
        text = f"{moved} trajector{'y' if moved == 1 else 'ies'} accepted; theory is without them"
        found.append(("offset of the platform", text))
    if not known(segment.disk):
        return [*found, ("disk", _why_unknown(report, segment.begin, "disk/inputs"))]
    disk = segment.disk
    loads = f", P {disk.preload:g} N" if disk.preload else ""
    loads += f", T_L {disk.load_torque:g} N·m" if disk.load_torque else ""
    loads += f", T_B {disk.brake_torque:g} N·m" if disk.brake_torque else ""
    loads += f", J {disk.load_inertia:g} kg·m²" if disk.load_inertia else ""
    found.append(
        (
            "disk",
            (
                f"m {disk.mass:g} kg, ε {disk.restitution:g}, μ {disk.friction:g}, a_e "
                f"{disk.friction_radius:g} m, a_g {disk.gyration_radius:.6g} m, g "
                f"{disk.gravity:g} m/s²{loads}"
            ),
        )
    )
    if motion and report.chosen.is_confirmed:
        found.append(("axial forcing Γ", f"{axial_forcing_of(motion, disk):.6f}"))
    return found


def _orbit(report: Report) -> Pairs:
    part = report.chosen
    if part is None or part.orbit is None:
        return [("orbit found", "unresolved: no impacts")]
    orbit, segment = part.orbit, part.segment
    rows = report.shown_rows
    span = f", {span_text(report, *rows['time'][[0, -1]])}" if len(rows) else ""
    found = [("orbit found", f"{orbit.name}, from {counted(part.rows, 'row')} of impacts{span}")]
    if orbit.exponent is not None:
        exponent = estimate_text(orbit.exponent, "impacts", " per impact")
        found.append(("Lyapunov exponent", exponent))
    theory = None
    if segment.motion and part.is_confirmed and known(segment.disk):
        theory = period_one(segment.motion, segment.disk)
    if orbit.is_period_one and theory:
        found += [
            ("τ_imp", f"{orbit.forcing_phases[0]:.6f} rad, theory {theory.forcing_phase:.6f}"),
            (
                "w_A",
                (
                    f"{orbit.axial_impact_velocities[0]:.6f} m/s, theory "
                    f"{theory.axial_impact_velocity:.6f}"
                ),
            ),
        ]
    elif 0 < orbit.impacts <= 8:
        found += [
            ("τ_imp", ", ".join(f"{v:.5f}" for v in orbit.forcing_phases) + " rad"),
            ("w_A", ", ".join(f"{v:.5g}" for v in orbit.axial_impact_velocities) + " m/s"),
        ]
    return found


def _speed(report: Report) -> Pairs:
    part = report.chosen
    if part is None or part.transient is None:
        absent = report.source.absence("disk/impacts", "joint_states")
        return [("rotor speed", f"not known: impacts and joint_states are {absent}")]
    found = [("at the end", mean_text(report, part.settled))]
    if part.transient.kind is TransientKind.LINEAR and not part.transient.finished:
        found = [("at the end", f"{found[0][1]}, still changing")]
    found += _theory_rows(part)
    found.append(("transient", transient_text(part.transient)))
    rises = [(place, one.rise) for place, one in enumerate(report.segments, start=1) if one.rise]
    return [*found, *(rise_row(report, place, rise) for place, rise in rises[:MOST_CHANGES])]


def mean_text(report: Report, mean: Mean) -> str:
    """A mean rotor speed with its span."""
    if math.isnan(mean.value):
        return "not known: no samples, and impacts with contact, unknown loads or gaps in between"
    of = f", {counted(mean.periods, 'period')} of the platform" if mean.periods else ""
    return f"{mean.value:.6f} rad/s, mean from {span_text(report, mean.begin, mean.end)}{of}"


def _theory_rows(part: SegmentReport) -> Pairs:
    """The mean speed of the period-1 orbit by eq. 4, less what the loads take between impacts."""
    motion, disk = part.segment.motion, part.segment.disk
    if motion is None or not part.is_confirmed or not known(disk):
        return []
    if not (part.orbit and part.orbit.is_period_one) or math.isnan(part.settled.value):
        return []
    predicted = mean_speed(motion, disk)
    if math.isnan(predicted):
        return []
    name = "eq. 4, ωΦ cos(τ_imp + θ)"
    text = f"{predicted:.6f} rad/s, difference {part.settled.value - predicted:+.1e} rad/s"
    if disk.load_torque or disk.brake_torque:
        name = "eq. 4, less the loads"
        text += f"; {no_load_speed(motion, disk):.6f} rad/s without loads"
    return [(name, text)]


MOST_CHANGES = 10
"""Rise and stop times of so many segments are told."""


def rise_row(report: Report, place: int, rise: RiseTime) -> tuple[str, str]:
    """Rise or stop time of a segment (from 1), or that the segment ends before the change does."""
    slower = abs(rise.final) < abs(rise.initial)
    path = path_text(rise.initial, rise.final)
    since = f"after {rise.begin:.{report.decimals}f} s"
    first, last = (with_prefix(time, "s") for time in (rise.to_1_e, rise.to_95))
    text = f"{first} to 1 − 1/e, {last} to 95 % of the way {path}, {since}"
    if not rise.ended:
        end = report.segments[place - 1].segment.end
        why = "the segment ends"
        if end >= report.end:
            why = "--to cuts it" if report.source.is_cut_off else "the recording ends"
        text = f"not over at {end:.{report.decimals}f} s, where {why}: {path} so far"
    return f"{'stop' if slower else 'rise'} time, segment {place}", text


def path_text(initial: float, final: float) -> str:
    """From one speed to another, rad/s; what is a rounding error of the larger one is 0."""
    least = 1e-9 * max(abs(initial), abs(final))
    first, last = (0.0 if abs(speed) <= least else speed for speed in (initial, final))
    return f"from {first:.5g} to {last:.5g} rad/s"


def _estimates(report: Report) -> Pairs:
    chosen = report.chosen
    disk = chosen.segment.disk if chosen and known(chosen.segment.disk) else None
    in_force = [f"; in force {v:g}" if disk else "" for v in (disk or ())[1:3]] or ["", ""]
    return [
        ("restitution ε", estimate_text(report.restitution, "impacts") + in_force[0]),
        ("friction μ", estimate_text(report.friction, "impacts") + in_force[1]),
    ]


def estimate_text(estimate: Estimate, of: str, unit: str = "") -> str:
    """A value with its interval, or why there is none."""
    value, low, high, count, note = estimate
    value = 0.0 if abs(value) < sys.float_info.min else value
    if math.isnan(value):
        bound = ""
        if low > 0.0 and math.isinf(high):
            bound = f"; at least {low:.4g}{unit}"
        return (note or "not identifiable") + bound
    half = max(high - value, value - low)
    narrow = half < 1e-6 * abs(value)
    interval = f"± {half:.1g}" if narrow else f"[{low:.5g}, {high:.5g}]"
    return f"{value:.6g}{unit} {interval} ({count} {of}{'; ' + note if note else ''})"


def transient_text(transient: Transient) -> str:
    """A transient in one line."""
    note = f" ({transient.note})" if transient.note else ""
    path = path_text(transient.initial, transient.final)
    match transient.kind:
        case TransientKind.EXPONENTIAL if transient.finished and not transient.is_known:
            return "no curve fitted: too few speeds on the way to tell its shape"
        case TransientKind.EXPONENTIAL:
            constant = estimate_text(transient.time_constant, "points", " s")
            return f"exponential {path}, time constant T {constant}{note}"
        case TransientKind.LINEAR if transient.finished and transient.rate.impacts < FEWEST:
            return f"{path} within {transient.rate.impacts + 1} impacts{note}"
        case TransientKind.LINEAR:
            rate = estimate_text(transient.rate, "points", " rad/s²")
            ends = "" if math.isnan(transient.end) else f", locked at {transient.end:.4g} s"
            path = path if ends else f"from {transient.initial:.5g} rad/s"
            return f"linear {path}, rate {rate}{ends}{note}"
        case TransientKind.NONE:
            return f"none: {transient.final:.5g} rad/s throughout{note}"
    return f"unresolved{note}"


# ------------------------------------------------------------------------------------------------
# A report as lines for a terminal, and its list of segments.


MOST_LINES = 20
"""Segments listed on the terminal."""
HEADINGS = ("#", "from (s)", "to (s)", "begins with", "Γ", "impacts", "orbit", "α̇ (rad/s)")


def lines(report: Report) -> list[str]:
    """The whole report for a terminal."""
    parts = tables(report)
    width = max(len(name) for table in parts for name, _ in table.rows)
    text = []
    for table in parts:
        if table.title.startswith("Segment "):
            text += ["", "Segments", *_columns(segment_rows(report))]
        text += ["", table.title, *(f"  {name:{width}}  {value}" for name, value in table.rows)]
    return text[1:]


def segment_rows(report: Report, most: int = MOST_LINES) -> list[tuple[str, ...]]:
    """The list of segments with its headings; of many, the last ones and the one shown."""
    numbered = list(enumerate(report.segments))
    keep = {place for place, _ in numbered[-most:]} | {report.shown}
    cells = [_segment_cells(report, place, part) for place, part in numbered if place in keep]
    left = len(numbered) - len(cells)
    more = [("", "", "", f"({left} earlier segments not listed)", "", "", "", "")] if left else []
    return [HEADINGS, *more, *cells]


def _segment_cells(report: Report, place: int, part: SegmentReport) -> tuple[str, ...]:
    segment = part.segment
    axial_forcing = "?"
    if segment.motion is not None and part.is_confirmed and known(segment.disk):
        axial_forcing = f"{axial_forcing_of(segment.motion, segment.disk):.4f}"
    return (
        str(place + 1),
        f"{segment.begin:.{report.decimals}f}",
        f"{segment.end:.{report.decimals}f}",
        segment.began_by,
        axial_forcing,
        str(part.impacts),
        part.orbit.name if part.orbit else "not worked out",
        "" if math.isnan(part.settled.value) else f"{part.settled.value:.4f}",
    )


def _columns(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(terminal_width(row[place]) for row in rows) for place in range(len(rows[0]))]
    texts = {3, 6}
    return [
        "  "
        + "  ".join(
            cell + " " * (width - terminal_width(cell))
            if place in texts
            else " " * (width - terminal_width(cell)) + cell
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]

"""A report as tables of words: what stands on the terminal and in the page, written once."""

from __future__ import annotations

import math
from typing import NamedTuple

from bouncing_disk_ros.analysis.period_one import period_one
from bouncing_disk_ros.analysis.recorded.run_record import SETTLED_SECONDS
from bouncing_disk_ros.analysis.recorded.segments import known
from bouncing_disk_ros.analysis.report.estimate_text import Pairs, estimate_text, transient_text
from bouncing_disk_ros.analysis.report.run_quality import energy, real_time
from bouncing_disk_ros.analysis.report.run_report import ABSENT, Report
from bouncing_disk_ros.analysis.scales import axial_forcing_of


class Table(NamedTuple):
    """A heading and its lines: what, and its value in words."""

    title: str
    rows: Pairs


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
    chatter = f", {summed} of chatters in {len(rows) - single} rows" if summed else ""
    impacts = f"{single + summed}{chatter}" if len(rows) else f"none {_absent(report)}"
    found = [
        ("bag", f"{source.name}, simulator {source.namespace}{run}"),
        ("simulated time", f"{report.begin:.3f} s to {report.end:.3f} s"),
        ("impacts", impacts),
    ]
    found += [("version", source.version)] if source.version else []
    found += [(ABSENT, ", ".join(source.missing))] if source.missing else []
    found += [("left out", limit) for limit in source.limits]
    return [*found, *(("damage", remark) for remark in source.remarks)]


def _absent(report: Report) -> str:
    return f"({ABSENT})" if "disk/impacts" in report.source.missing else "recorded"


def _drive(report: Report) -> Pairs:
    if report.chosen is None:
        return [("nothing", "the bag holds no time")]
    segment = report.chosen.segment
    found = [
        ("time", (f"{segment.begin:.3f} s to {segment.end:.3f} s, begins with {segment.began_by}"))
    ]
    if motion := segment.motion:
        found.append(
            (
                "platform",
                (
                    f"A {1e3 * motion.axial_amplitude:.6g} mm, Φ "
                    f"{motion.angular_amplitude:.6g} rad, f {motion.frequency:.6g} Hz, θ "
                    f"{motion.phase_lag:.6g} rad"
                ),
            )
        )
    else:
        found.append(("platform", f"platform/motion is {ABSENT}"))
    if not known(segment.disk):
        return [*found, ("disk", f"its parameters (disk/inputs) are {ABSENT}")]
    disk = segment.disk
    loads = f", P {disk.preload:g} N" if disk.preload else ""
    loads += f", T_L {disk.load_torque:g} N·m" if disk.load_torque else ""
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
    if motion:
        found.append(("axial forcing Γ", f"{axial_forcing_of(motion, disk):.6f}"))
    return found


def _orbit(report: Report) -> Pairs:
    part = report.chosen
    if part is None or part.orbit is None:
        return [("orbit found", "unresolved: no impacts")]
    orbit, segment = part.orbit, part.segment
    found = [("orbit found", f"{orbit.name}, from {part.rows} rows of impacts")]
    if orbit.exponent is not None:
        exponent = estimate_text(orbit.exponent, "impacts", " per impact")
        found.append(("Lyapunov exponent", exponent))
    theory = None
    if segment.motion and known(segment.disk):
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
    if part is None or part.transient is None or math.isnan(part.settled):
        absent = report.source.absence("disk/impacts", "joint_states")
        return [("rotor speed", f"not known: impacts and joint_states are {absent}")]
    segment = part.segment
    found = [("at the end", f"{part.settled:.6f} rad/s, mean of the last {SETTLED_SECONDS:g} s")]
    theory = segment.motion and period_one(segment.motion, segment.disk)
    if theory and known(segment.disk) and not segment.disk.load_torque:
        predicted = theory.angular_velocity
        if part.orbit and part.orbit.is_period_one:
            found.append(
                (
                    "eq. 4, ωΦ cos(τ_imp + θ)",
                    (f"{predicted:.6f} rad/s, difference {part.settled - predicted:+.1e} rad/s"),
                )
            )
    return [*found, ("transient", transient_text(part.transient))]


def _estimates(report: Report) -> Pairs:
    chosen = report.chosen
    disk = chosen.segment.disk if chosen and known(chosen.segment.disk) else None
    in_force = [f"; in force {v:g}" if disk else "" for v in (disk or ())[1:3]] or ["", ""]
    return [
        ("restitution ε", estimate_text(report.restitution, "impacts") + in_force[0]),
        ("friction μ", estimate_text(report.friction, "impacts") + in_force[1]),
    ]

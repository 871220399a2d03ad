"""What the two pages of a report share: colours, ticks of phases, the headline."""

from __future__ import annotations

import math
from pathlib import Path

from bouncing_disk_ros.analysis.recorded.segments import known
from bouncing_disk_ros.analysis.report.run_report import Report
from bouncing_disk_ros.analysis.scales import axial_forcing_of
from bouncing_disk_ros.plots.style import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, GREY, PURPLE)
"""Okabe and Ito's; a series gives its place."""
PHASE_TICKS = [k * math.pi / 2.0 for k in range(5)]
PHASE_TEXTS = ["0", "π/2", "π", "3π/2", "2π"]


def headline(report: Report) -> tuple[str, str]:
    """The title of a report and a line under it."""
    source = report.source
    name = Path(source.name).name + ("" if source.namespace == "/" else f", {source.namespace}")
    name += f", run {source.run} of {source.runs}" if source.runs > 1 else ""
    part = report.chosen
    if part is None:
        return name, "nothing recorded"
    words = [f"segment {report.shown + 1} of {len(report.segments)}"]
    segment = part.segment
    if segment.motion and known(segment.disk):
        axial_forcing = axial_forcing_of(segment.motion, segment.disk)
        words.append(f"axial forcing Γ = {axial_forcing:.4f}")
        words.append(f"restitution ε = {segment.disk.restitution:g}")
        words.append(f"θ = {segment.motion.phase_lag:.3f} rad")
    words.append(f"orbit found: {part.orbit.name if part.orbit else 'none'}")
    return name, ", ".join(words)

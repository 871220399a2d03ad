"""What the two pages of a report share: colours, ticks of phases, the headline."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.report.panel import Panel
from bouncing_disk_ros.report.run_report import Report
from bouncing_disk_ros.report.spans import known
from bouncing_disk_ros.report.style import BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILION

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, GREY, PURPLE)
"""Okabe and Ito's; a series gives its place."""
PHASE_TICKS = [k * math.pi / 2.0 for k in range(5)]
PHASE_TEXTS = ["0", "π/2", "π", "3π/2", "2π"]


INDEXED = re.compile(
    r"(?<![^\W_])(w|τ|α|a|T|φ)_(?:\((n\+1)\)|(A|T|n|e|g|L|B|imp|sep)(?![^\W_]))(?!\w)"
)
"""Symbols with an index, as panels and tables write them: w_A, τ_(n+1); no parts of names."""
LEAST_RANGE = 1e-6
"""Values that differ by less than this part of their size are drawn as equal."""


def absent(report: Report, panel: Panel) -> str:
    """Why a panel is empty, in words."""
    return f"{', '.join(panel.topics)}: {report.source.absence(*panel.topics)}"


def value_range(panel: Panel) -> tuple[float, float] | None:
    """The range of y of a panel whose values are nearly equal; None: its axis may choose."""
    drawn = [part.y[np.isfinite(part.y)] for part in panel.series]
    values = np.concatenate([part for part in drawn if len(part)] or [np.zeros(0)])
    if not len(values) or panel.y_is_log or panel.y_is_phase:
        return None
    low, high = float(np.min(values)), float(np.max(values))
    size = max(abs(low), abs(high))
    if high - low > LEAST_RANGE * size or size == 0.0:
        return None
    return low - 0.05 * size, high + 0.05 * size


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
    if segment.motion and part.is_confirmed and known(segment.disk):
        axial_forcing = axial_forcing_of(segment.motion, segment.disk)
        words.append(f"axial forcing Γ = {axial_forcing:.4f}")
        words.append(f"restitution ε = {segment.disk.restitution:g}")
        words.append(f"θ = {segment.motion.phase_lag:.3f} rad")
    words.append(f"orbit found: {part.orbit.name if part.orbit else 'none'}")
    return name, ", ".join(words)

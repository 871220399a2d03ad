"""A report as lines for a terminal, and its list of segments."""

from __future__ import annotations

import math

from bouncing_disk_ros.maps.scales import axial_forcing_of
from bouncing_disk_ros.report.report_tables import tables
from bouncing_disk_ros.report.run_report import Report, SegmentReport
from bouncing_disk_ros.report.spans import known

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
    widths = [max(_width(row[place]) for row in rows) for place in range(len(rows[0]))]
    texts = {3, 6}
    return [
        "  "
        + "  ".join(
            cell + " " * (width - _width(cell))
            if place in texts
            else " " * (width - _width(cell)) + cell
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def _width(text: str) -> int:
    """Columns on a terminal: combining marks take none."""
    return sum(1 for letter in text if not "\u0300" <= letter <= "\u036f")

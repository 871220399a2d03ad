"""Rows of the impact log as text for people and as CSV, and the count of lost rows."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import IMPACT_DTYPE, ImpactKind
from bouncing_disk_ros.running_numbers import Gaps

_COLUMNS = (
    # title, unit, width, format of the value
    ("index", "", 8, "{:.0f}"),
    ("time", "s", 13, "{:.6f}"),
    ("cycles", "", 9, "{:.0f}"),
    ("τ/2π", "1", 9, "{:.5f}"),
    ("w_A", "m/s", 12, "{:.4e}"),
    ("w_T", "rad/s", 12, "{:.4e}"),
    ("F̂", "N·s", 12, "{:.4e}"),
    ("Ĥ", "N·m·s", 12, "{:.4e}"),
    ("α̇", "rad/s", 11, "{:.5g}"),
    ("count", "", 6, "{:d}"),
)


def terminal_width(text: str) -> int:
    """Columns on a terminal: combining marks take none."""
    return sum(1 for letter in text if not "\u0300" <= letter <= "\u036f")


def _cell(text: str, width: int) -> str:
    """Right-justified; at least one space keeps columns apart whatever the value."""
    return " " * max(1, width - terminal_width(text)) + text


def heading() -> str:
    """Two lines: the symbols of the columns and their units."""
    titles = "".join(_cell(title, width) for title, _, width, _ in _COLUMNS)
    units = "".join(_cell(unit, width) for _, unit, width, _ in _COLUMNS)
    return f"{titles}  kind\n{units}"


def line(row: np.void) -> str:
    """One impact for people; τ/2π in [0, 1), velocities just before the impact, α̇ after it."""
    values = (
        row["index"],
        row["time"],
        row["cycles"],
        row["forcing_phase"] / math.tau,
        row["axial_impact_velocity"],
        row["angular_impact_velocity"],
        row["axial_impulse"],
        row["angular_impulse"],
        row["angular_velocity"],
        int(row["count"]),
    )
    cells = (
        _cell(form.format(value), width)
        for value, (_, _, width, form) in zip(values, _COLUMNS, strict=True)
    )
    return f"{''.join(cells)}  {ImpactKind(int(row['kind'])).name.lower()}"


def csv_heading() -> str:
    """The names of all fields."""
    return ",".join(_names())


def csv_line(row: np.void) -> str:
    """All fields of one impact, floats in round-trip form."""
    return ",".join(str(row[name].item()) for name in _names())


def _names() -> Sequence[str]:
    names = IMPACT_DTYPE.names
    assert names is not None
    return names


def lost_rows(gaps: Gaps, rows: NDArray[np.void]) -> str:
    """Take the next rows (IMPACT_DTYPE, not empty); what is wrong with their index, or ''."""
    first, last = int(rows["index"][0]), int(rows["index"][-1])
    missing = gaps.take(first, last, len(rows))
    if missing < 0:
        return f"the index starts again at {first}: another run"
    return f"{missing} row(s) lost up to index {last}, {gaps.lost} in all" if missing else ""

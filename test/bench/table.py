"""The one table of a run of the bench, and its file."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.processor import scalar_c, vectors


class Row(NamedTuple):
    """One measured quantity: median and spread (10th to 90th percentile), with its aim, if any."""

    part: str
    name: str
    unit: str
    median: float
    low: float
    high: float
    runs: int
    least: float
    most: float
    aim: str = ""
    met: bool | None = None


class Aim(NamedTuple):
    """A bound that the median is to keep."""

    at_most: float | None = None
    at_least: float | None = None

    def text(self, unit: str) -> str:
        """In words."""
        sign, bound = ("≤", self.at_most) if self.at_most is not None else ("≥", self.at_least)
        return f"{sign} {bound:.3g} {unit}"

    def met_by(self, value: float) -> bool:
        """Whether a value keeps it."""
        if self.at_most is not None:
            return value <= self.at_most
        return self.at_least is not None and value >= self.at_least


def row(part: str, name: str, unit: str, values: Sequence[float], aim: Aim | None = None) -> Row:
    """Median and spread of what was measured."""
    low, median, high = (float(v) for v in np.percentile(values, [10, 50, 90]))
    return Row(
        part,
        name,
        unit,
        median,
        low,
        high,
        len(values),
        float(min(values)),
        float(max(values)),
        aim.text(unit) if aim else "",
        aim.met_by(median) if aim else None,
    )


def compared(
    part: str,
    what: str,
    unit: str,
    times: Mapping[str, NDArray[np.float64]],
    ratios: Sequence[tuple[str, str, str, Aim | None]],
) -> list[Row]:
    """A row for each of `times`, and for each ratio whose two are there, round by round.

    A ratio: the names above and below, what it is called, and its aim.
    """
    rows = [row(part, f"{name}, {what}", unit, list(found)) for name, found in times.items()]
    for above, below, name, aim in ratios:
        if above in times and below in times:
            quotients = list(times[above] / times[below])
            rows.append(row(part, f"{name}, {what}", "×", quotients, aim))
    return rows


def machine() -> dict[str, object]:
    """What the figures depend on."""
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    model = next((line.split(":")[1].strip() for line in lines if "model name" in line), "unknown")
    return {
        "processor": model,
        "vectors": vectors(),
        "scalar C (ns an impact)": round(scalar_c(), 1),
        "processors": os.cpu_count(),
        "load over the last minute": round(os.getloadavg()[0], 2),
        "kernel": platform.release(),
        "python": platform.python_version(),
    }


def number(value: float) -> str:
    """Three or four digits, without an exponent where that is readable."""
    if value == 0.0 or 1e-3 <= abs(value) < 1e6:
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"
    return f"{value:.3g}"


def table(rows: Sequence[Row]) -> str:
    """The rows as Markdown; min and max besides the spread, for the tails."""
    head = ("what", "unit", "median", "p10 … p90", "min … max", "runs", "aim")
    lines = []
    for r in rows:
        met = {None: "", True: ": met", False: ": MISSED"}[r.met]
        spread = f"{number(r.low)} … {number(r.high)}"
        ends = f"{number(r.least)} … {number(r.most)}"
        name = f"{r.part}: {r.name}"
        lines.append((name, r.unit, number(r.median), spread, ends, str(r.runs), r.aim + met))
    widths = [max(len(line[i]) for line in [head, *lines]) for i in range(len(head))]
    rule = tuple("-" * width for width in widths)
    cells = (
        " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True))
        for line in [head, rule, *lines]
    )
    return "\n".join(f"| {line} |" for line in cells)


def write(file: Path, rows: Sequence[Row], notes: Sequence[str], load: float) -> None:
    """Machine, notes and rows as JSON; `load` is that of the machine before the run."""
    file.parent.mkdir(parents=True, exist_ok=True)
    found = {
        "machine": {**machine(), "load before the run": round(load, 2)},
        "notes": list(notes),
        "rows": [r._asdict() for r in rows],
    }
    file.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n")

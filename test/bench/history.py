"""What changed since the last version: ratios of this run beside the committed ones."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bench.table import Row, number

LAST = Path(__file__).parent / "results.json"
"""The results of the last version, committed with it (`python -m bench.page` puts them there)."""


def changes(rows: Sequence[Row], last: Path = LAST) -> list[str]:
    """One line for each ratio that left the spread of the last version's, or is no longer measured.

    Only ratios are compared: times are those of another hour, or of another machine. New ones are
    counted, for there is nothing to compare them with.
    """
    if not last.is_file():
        return [f"no results of a last version ({last.name})"]
    old_rows = [old for old in json.loads(last.read_text())["rows"] if old["unit"] == "×"]
    before = {(old["part"], old["name"]): old for old in old_rows}
    now = {(row.part, row.name): row for row in rows if row.unit == "×"}
    lines = []
    for key, row in now.items():
        old = before.get(key)
        if old is not None and _apart(row, old):
            change = f"{number(old['median'])} → {number(row.median)}"
            lines.append(f"changed since the last version: {row.part}: {row.name}: {change}")
    lines = lines or ["no ratio has left the spread of the last version"]
    lines += [
        f"no longer measured: {part}: {name}" for part, name in before if (part, name) not in now
    ]
    if new := len(now.keys() - before.keys()):
        lines.append(f"new since the last version: {new} ratios")
    return lines


def _apart(row: Row, old: dict[str, Any]) -> bool:
    """Whether the spreads (10th to 90th percentile) do not overlap."""
    return bool(row.low > old["high"] or row.high < old["low"])

"""`python -m bench.page [output/bench.json]`: take a run of the bench as that of this version.

Copies it to test/bench/results.json, and writes the tables of docs/performance.md anew: each lies
between two marks that name its part.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bench.history import LAST
from bench.table import number

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "performance.md"
SKIPPED = "Not measured in this run."
MARKED = re.compile(r"(<!-- bench: (?P<part>.+?) -->\n).*?(<!-- end of bench -->)", re.DOTALL)


def with_tables(page: str, found: dict[str, Any]) -> str:
    """The page with the tables of a run; a part that was skipped says so.

    ValueError for a part of the run that has no place on the page: it would be lost.
    """
    parts: dict[str, list[dict[str, Any]]] = {}
    for row in found["rows"]:
        parts.setdefault(row["part"], []).append(row)
    places = {match["part"] for match in MARKED.finditer(page)}
    if lost := parts.keys() - places:
        raise ValueError(f"no place on the page for {', '.join(sorted(lost))}")

    def filled(match: re.Match[str]) -> str:
        part = match["part"]
        if part == "machine":
            text = machine_text(found)
        else:
            text = table_of(parts[part]) if part in parts else SKIPPED
        return f"{match[1]}{text}\n{match[3]}"

    return MARKED.sub(filled, page)


def table_of(rows: Sequence[dict[str, Any]]) -> str:
    """One part as Markdown."""
    lines = ["| | median | p10 … p90 | aim |", "|---|---|---|---|"]
    for row in rows:
        met = {None: "", True: ": met", False: ": **missed**"}[row["met"]]
        unit = "" if row["unit"] == "1" else f" {row['unit']}"
        middle = f"{number(row['median'])}{unit}"
        spread = f"{number(row['low'])} … {number(row['high'])}"
        lines.append(f"| {row['name']} | {middle} | {spread} | {row['aim']}{met} |")
    return "\n".join(lines)


def machine_text(found: dict[str, Any]) -> str:
    """Where and under which load the run was made, and what was skipped."""
    machine = found["machine"]
    text = (
        f"Measured on a virtual machine: {machine['processor']}, {machine['processors']} "
        f"processors, Python {machine['python']}; load before the run "
        f"{machine['load before the run']}."
    )
    return "\n".join([text, "", *(f"- {note}" for note in found["notes"])])


def main(file: Path) -> None:
    """Write page and results."""
    text = file.read_text()
    PAGE.write_text(with_tables(PAGE.read_text(), json.loads(text)))
    LAST.write_text(text)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "output" / "bench.json")

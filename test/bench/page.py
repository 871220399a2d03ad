"""`python -m bench.page [output/bench.json]`: take a run of the bench as that of this version.

Copies it to test/bench/results.json, and writes the table of docs/performance.md anew: the rows
that have an aim.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

from bench.history import LAST
from bench.table import number

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "performance.md"
MARKED = re.compile(r"(<!-- bench -->\n).*?(<!-- end of bench -->)", re.DOTALL)


def with_table(page: str, found: dict[str, Any]) -> str:
    """The page with the table of a run."""
    text = f"{machine_text(found)}\n\n{table_of(found['rows'])}"
    return MARKED.sub(lambda match: f"{match[1]}{text}\n{match[2]}", page)


def table_of(rows: list[dict[str, Any]]) -> str:
    """The rows with an aim as Markdown."""
    lines = ["| part | quantity | median | aim |", "|---|---|---|---|"]
    for row in rows:
        if row["aim"]:
            unit = "" if row["unit"] == "1" else f" {row['unit']}"
            aim = row["aim"].removesuffix(" 1") + ("" if row["met"] else ": **missed**")
            lines.append(
                f"| {row['part']} | {row['name']} | {number(row['median'])}{unit} | {aim} |"
            )
    return "\n".join(lines)


def machine_text(found: dict[str, Any]) -> str:
    """Where and under which load the run was made, and what was skipped."""
    machine = found["machine"]
    text = (
        f"Measured on a virtual machine: {machine['processor']}, {machine['processors']} "
        f"processors, widest vectors {machine['vectors']}, {machine['scalar C (ns an impact)']} ns "
        f"for an impact in scalar C, Python {machine['python']}; load before the run "
        f"{machine['load before the run']}. Aims that were missed are marked."
    )
    return "\n".join([text, "", *(f"- {note}" for note in found["notes"])])


def main(file: Path) -> None:
    """Write page and results."""
    text = file.read_text()
    PAGE.write_text(with_table(PAGE.read_text(), json.loads(text)))
    LAST.write_text(text)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "output" / "bench.json")

"""What `make bench` says of its rows: beside those of the last version, and on the page."""

from __future__ import annotations

import json
from pathlib import Path

from bench.history import LAST, changes
from bench.page import PAGE, with_table
from bench.table import Aim, Row, row


def ratio(name: str, value: float, part: str = "lanes") -> Row:
    return row(part, name, "×", [0.99 * value, value, 1.01 * value])


def test_ratios_are_told_beside_those_of_the_last_version(tmp_path: Path) -> None:
    last = tmp_path / "results.json"
    assert changes([], last) == ["no results of a last version (results.json)"]
    before = [ratio("same", 2.0), ratio("other", 2.0), ratio("gone", 2.0)]
    rows = [*before, row("lanes", "gone time", "s", [1.0])]
    last.write_text(json.dumps({"rows": [r._asdict() for r in rows]}))
    assert changes(before, last) == ["no ratio has left the spread of the last version"]
    now = [ratio("same", 2.01), ratio("other", 3.0), ratio("new", 1.0), ratio("same", 9.0, "C")]
    assert changes(now, last) == [
        "changed since the last version: lanes: other: 2 → 3",
        "no longer measured: lanes: gone",
        "new since the last version: 2 ratios",
    ]


def test_the_page_has_the_rows_with_an_aim() -> None:
    aimed = row("lanes", "aimed", "×", [2.0], Aim(at_most=1.0))._asdict()
    found = {**json.loads(LAST.read_text("utf-8")), "rows": [ratio("same", 2.0)._asdict(), aimed]}
    page = with_table("a\n<!-- bench -->\nold\n<!-- end of bench -->\nb\n", found)
    assert "| lanes | aimed | 2 × | ≤ 1 ×: **missed** |" in page
    assert "same" not in page
    assert "old" not in page
    assert with_table(page, found) == page


def test_the_page_is_that_of_the_stored_run() -> None:
    page = PAGE.read_text("utf-8")
    assert with_table(page, json.loads(LAST.read_text("utf-8"))) == page

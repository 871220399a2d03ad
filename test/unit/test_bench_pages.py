"""What `make bench` says of its rows: beside those of the last version, and on the page."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from bench.history import LAST, changes
from bench.page import PAGE, SKIPPED, with_tables
from bench.table import Row, row


def ratio(name: str, value: float, part: str = "lanes") -> Row:
    return row(part, name, "×", [0.99 * value, value, 1.01 * value])


@pytest.fixture
def last(tmp_path: Path) -> Path:
    file = tmp_path / "results.json"
    rows = [
        ratio("same", 2.0),
        ratio("other", 2.0),
        ratio("gone", 2.0),
        row("lanes", "gone time", "s", [1.0]),
    ]
    file.write_text(json.dumps({"rows": [r._asdict() for r in rows]}))
    return file


def test_changed_vanished_and_new_ratios_are_told(last: Path) -> None:
    now = [ratio("same", 2.01), ratio("other", 3.0), ratio("new", 1.0), ratio("same", 9.0, "C")]
    assert changes(now, last) == [
        "changed since the last version: lanes: other: 2 → 3",
        "no longer measured: lanes: gone",
        "new since the last version: 2 ratios",
    ]


def test_nothing_changed(last: Path) -> None:
    now = [ratio("same", 2.0), ratio("other", 2.0), ratio("gone", 2.0)]
    assert changes(now, last) == ["no ratio has left the spread of the last version"]


def test_without_a_last_version(tmp_path: Path) -> None:
    assert changes([], tmp_path / "results.json") == ["no results of a last version (results.json)"]


PLACES = "a\n<!-- bench: {} -->\nold\n<!-- end of bench -->\nb\n"


def test_a_table_takes_its_place_on_the_page() -> None:
    found = {"rows": [ratio("same", 2.0)._asdict()]}
    page = with_tables(PLACES.format("lanes") + PLACES.format("C"), found)
    assert "| same | 2 × | 1.984 … 2.016 |  |" in page
    assert "old" not in page
    assert SKIPPED in page
    assert with_tables(page, found) == page


def test_a_part_without_a_place_is_refused() -> None:
    with pytest.raises(ValueError, match="no place on the page for lanes"):
        with_tables(PLACES.format("C"), {"rows": [ratio("same", 2.0)._asdict()]})


def test_the_page_has_a_place_for_every_part() -> None:
    places = PAGE.read_text()
    named = {
        part
        for file in LAST.parent.glob("*.py")
        for part in re.findall(r'^\w*PART\w* = "(.+)"$', file.read_text("utf-8"), re.MULTILINE)
    }
    measured = {row["part"] for row in json.loads(LAST.read_text("utf-8"))["rows"]}
    assert {"resilience", "refusals", "cold start"} <= named | measured
    for part in named | measured:
        assert f"<!-- bench: {part} -->" in places

"""`make bench`: measure everything in one run, print one table, write output/bench.json.

Only agreement and clean ends are asserted. Whether an aim is met says the table: the figures are
those of the machine, and of what else it did meanwhile.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from bench.history import changes
from bench.table import Row, table, write
from support.processes import Starter

OUTPUT = Path(__file__).resolve().parents[2] / "output" / "bench.json"


@pytest.mark.bench
@pytest.mark.timeout(3600)
def test_bench(start: Starter, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # here: `make test` collects this file too, and these load most of the package
    from bench import (
        bags,
        beside,
        ceiling,
        first_results,
        long_runs,
        many,
        motor,
        node,
        per_impact,
        refusals,
        resilience_bench,
        start_views,
        studies,
        widths,
        workbench_page,
    )

    load = os.getloadavg()[0]
    folders = (tmp_path / f"new-{i}" for i in itertools.count())
    plain: tuple[Callable[[], list[Row]], ...] = (
        lambda: node.measure_starts(start, lambda: next(folders)),
        lambda: first_results.measure(tmp_path, lambda: next(folders)),
        lambda: node.measure_rates(start),
        lambda: refusals.measure(start),
        ceiling.measure,
        beside.measure,
        motor.measure,
        resilience_bench.measure,
        start_views.measure,
        lambda: workbench_page.measure(start, tmp_path),
        lambda: bags.measure(start, tmp_path),
    )
    noted: tuple[Callable[[], tuple[list[Row], list[str]]], ...] = (
        lambda: per_impact.measure(tmp_path),
        lambda: many.measure(tmp_path),
        lambda: long_runs.measure(tmp_path),
        lambda: widths.measure(tmp_path),
        studies.measure,
    )
    rows: list[Row] = []
    notes: list[str] = []
    for part in plain:
        rows += part()
        write(OUTPUT, rows, notes, load)  # after each: what follows may fail or be interrupted
    for part_with_notes in noted:
        part_rows, part_notes = part_with_notes()
        rows += part_rows
        notes += part_notes
        write(OUTPUT, rows, notes, load)
    with capsys.disabled():
        text = "\n".join([table(rows), *notes, *changes(rows), f"written: {OUTPUT}"])
        print(f"\n{text}")

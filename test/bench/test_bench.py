"""`make bench`: measure everything in one run, print one table, write output/bench.json.

Only agreement and clean ends are asserted. Whether an aim is met says the table: the figures are
those of the machine, and of what else it did meanwhile.
"""

from __future__ import annotations

import itertools
import os
from pathlib import Path

import pytest

from bench.history import changes
from bench.table import table, write
from support.processes import Starter

OUTPUT = Path(__file__).resolve().parents[2] / "output" / "bench.json"


@pytest.mark.bench
@pytest.mark.timeout(1200)
def test_bench(start: Starter, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # here: `make test` collects this file too, and these load most of the package
    from bench import (
        bags,
        beside,
        ceiling,
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
    folders = (tmp_path / f"cache-{i}" for i in itertools.count())
    rows = node.measure_starts(start, lambda: next(folders))
    rows += node.measure_rates(start)
    rows += refusals.measure(start)
    rows += ceiling.measure()
    per, notes = per_impact.measure(tmp_path)
    rows += per
    many_rows, many_notes = many.measure(tmp_path)
    rows += many_rows
    notes += many_notes
    width_rows, width_notes = widths.measure(tmp_path)
    rows += width_rows
    notes += width_notes
    rows += beside.measure()
    study_rows, study_notes = studies.measure()
    rows += study_rows
    notes += study_notes
    rows += motor.measure()
    rows += resilience_bench.measure()
    rows += start_views.measure()
    rows += workbench_page.measure(start, tmp_path)
    rows += bags.measure(start, tmp_path)
    write(OUTPUT, rows, notes, load)
    with capsys.disabled():
        told = "\n".join([table(rows), *notes, *changes(rows), f"written: {OUTPUT}"])
        print(f"\n{told}")

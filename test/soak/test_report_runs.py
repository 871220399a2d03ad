"""Every number and sentence of reports on 2000 random runs, against the runs themselves."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from support import random_reports

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]

FIRST, RUNS = 1000, 2000


def test_reports_say_what_the_runs_did(tmp_path: Path) -> None:
    made = 0
    for seed in range(FIRST, FIRST + RUNS):
        folder = tmp_path / f"run_{seed}"
        made += random_reports.check(seed, folder)
        shutil.rmtree(folder)
    assert made > RUNS // 2

"""Every number and sentence of reports on runs drawn at random, against the runs themselves."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from support import random_reports
from support.coverage import in_soak

AT_ONCE = 10
FIRSTS = [0, *in_soak(10, *range(1_000, 3_000, AT_ONCE))]
FOUND = {
    "a reset that a bag without disk/inputs does not tell from a change": (1155, 1328),
    "an impact at the instant of such a reset": (2067,),
    "a cross-fade that only a report on /diagnostics came to": (2194,),
    "a record of one instant": (1255,),
    "two runs, the second one heard late": (1690, 1707),
    "two runs, and a motion of the second has the next number of the first": (995,),
    "two means of the rotor speed, others between them without a time": (5124,),
    "a record that ends 1 ns before a reset": (5086,),  # the check was wrong
}
"""Seeds whose reports were wrong once."""


@pytest.mark.parametrize("first", FIRSTS)
def test_a_report_says_what_the_run_did(first: int, tmp_path: Path) -> None:
    made = 0
    for seed in range(first, first + AT_ONCE):
        made += random_reports.check(seed, tmp_path / f"run_{seed}")
        shutil.rmtree(tmp_path / f"run_{seed}")
    assert made >= AT_ONCE // 2, "too few bags are worth a report"


@pytest.mark.parametrize("what", FOUND)
def test_a_report_that_was_wrong_is_right(what: str, tmp_path: Path) -> None:
    for seed in FOUND[what]:
        random_reports.check(seed, tmp_path / f"run_{seed}")

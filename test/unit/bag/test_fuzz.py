"""Thirty random damages to bags, guided by coverage (`make soak`: ten thousand)."""

from __future__ import annotations

from pathlib import Path

import pytest
from mcap.summary import Summary

from bouncing_disk_ros import bag
from bouncing_disk_ros.bag import source
from bouncing_disk_ros.bag.records import RegularFile
from reference.cases import FIRST, examples
from support.fuzz import Fuzz

SEED, DAMAGES = 1, examples(30, 10_000)


def test_damaged_bags_are_read_or_refused(tmp_path: Path) -> None:
    fuzz = Fuzz(FIRST or SEED, tmp_path / "run")
    fuzz.run(DAMAGES)
    print(fuzz)
    assert fuzz.refused >= DAMAGES // 10
    assert len(fuzz.seen) > fuzz.whole, "no damage reached other code than whole bags do"


def test_an_exception_that_is_no_refusal_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    true = source.summary_of

    def faulty(file: RegularFile) -> Summary | str:
        try:
            return true(file)
        except bag.BagError:
            raise ZeroDivisionError from None

    monkeypatch.setattr(source, "summary_of", faulty)
    with pytest.raises(AssertionError, match=r"(?s)seed 1, input \d+, .*ZeroDivisionError"):
        Fuzz(SEED, tmp_path / "run").run(1000)

"""A hundred random damages to bags, guided by coverage (`make soak`: ten thousand)."""

from __future__ import annotations

from pathlib import Path

import pytest

from bouncing_disk_ros.bag import fields
from support.fuzz import Fuzz

SEED = 1


def test_damaged_bags_are_read_or_refused(tmp_path: Path) -> None:
    fuzz = Fuzz(SEED, tmp_path / "run")
    fuzz.run(100)
    print(fuzz)
    assert fuzz.refused > 10
    assert len(fuzz.seen) > fuzz.whole, "no damage reached other code than whole bags do"


def test_an_exception_that_is_no_refusal_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    true = fields.statistics

    def faulty(content: fields.Content) -> fields.Statistics:
        found = true(content)
        if not found.attachments:
            raise ZeroDivisionError
        return found

    monkeypatch.setattr(fields, "statistics", faulty)
    with pytest.raises(AssertionError, match=r"(?s)seed 1, input \d+, .*ZeroDivisionError"):
        Fuzz(SEED, tmp_path / "run").run(1000)

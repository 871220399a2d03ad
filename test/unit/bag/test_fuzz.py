"""Thirty random damages to bags, guided by coverage (`make soak`: ten thousand)."""

from __future__ import annotations

from pathlib import Path

from reference.cases import FIRST, examples
from support.fuzz import Fuzz

SEED, DAMAGES = 1, examples(30, 10_000)


def test_damaged_bags_are_read_or_refused(tmp_path: Path) -> None:
    fuzz = Fuzz(FIRST or SEED, tmp_path / "run")
    fuzz.run(DAMAGES)
    print(fuzz)
    assert fuzz.refused >= DAMAGES // 10
    assert len(fuzz.seen) > fuzz.whole, "no damage reached other code than whole bags do"

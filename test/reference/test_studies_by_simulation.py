"""Studies at random options beside single runs of the simulator, which know nothing of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from reference.cases import examples
from support.coverage import in_soak
from support.study_attacks import ATTACKS

DRAWS = {"bifurcation": 2, "motor": 6, "toss_map": 3}
"""So many (else 1) of each, for they take up to a second of CPU."""
STUDIES = [
    (name, seed)
    for name in ATTACKS
    for seed in (*range(examples(DRAWS.get(name, 1))), *in_soak(*range(10_000, 10_050)))
]


@pytest.mark.parametrize(("name", "seed"), STUDIES)
def test_a_study_agrees_with_the_simulator(name: str, seed: int, tmp_path: Path) -> None:
    said = ATTACKS[name](np.random.default_rng(seed), tmp_path)
    assert not said, "\n".join(said)

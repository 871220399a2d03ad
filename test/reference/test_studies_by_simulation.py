"""Studies at random options beside single runs of the simulator, which know nothing of them.

A diagram follows the map step by step: its steps have the stepper's bits (test_map_kernels.py),
and its results are pinned. Tosses are in test_toss.py. Of the resilience studies, fatal changes are
beside the simulator in test_fatal_changes.py, manifolds beside basins in test_manifolds.py, and
curves beside Newton's method in test_curve_reference.py.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from reference.cases import examples
from support import studied
from support.coverage import in_soak
from support.studied_motor import attack_motor

ATTACKS: dict[str, Callable[[np.random.Generator, Path], list[str]]] = {
    "basins": studied.attack_basins,
    "basin_shares": studied.attack_basin_shares,
    "parameter_map": studied.attack_parameter_map,
    "motor": attack_motor,
}
"""Study -> what differs at one draw of its options, nothing if all agrees."""
DRAWS = {"motor": 6}
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

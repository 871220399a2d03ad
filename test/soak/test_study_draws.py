"""A thousand draws of each study beside single runs of the simulator."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from reference.cases import examples
from support.study_attacks import ATTACKS

pytestmark = pytest.mark.soak
DRAWS = 50
"""Times EXAMPLES (20): a thousand."""


@pytest.mark.parametrize("name", list(ATTACKS))
def test_studies_agree_with_the_simulator(name: str, tmp_path: Path) -> None:
    said = []
    for seed in range(examples(DRAWS)):
        said += ATTACKS[name](np.random.default_rng(10_000 + seed), tmp_path / str(seed))
    assert not said, "\n".join(said)

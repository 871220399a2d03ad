"""Random commands, right and wrong, leave a session alive, finite and replayable.

Two thousand, and a million in `make soak`; there a hundred thousand have offset trajectories.
"""

from __future__ import annotations

import pytest

from reference.cases import FIRST, examples
from support.storms import COMMANDS, check_storm


# even: within the limits of every day; odd: to all ends
@pytest.mark.parametrize("seed", range(FIRST, FIRST + examples(2, 1_000)))
def test_a_session_outlives_a_storm_and_its_record_replays(seed: int) -> None:
    assert len(check_storm(seed).rows) > 0


@pytest.mark.parametrize("seed", range(FIRST + 7, FIRST + 7 + examples(1, 100)))
def test_a_session_withstands_random_trajectories(seed: int) -> None:
    commands = examples(300, COMMANDS)
    found = check_storm(seed, commands, offsets=True)
    assert sum(record["kind"] == "trajectory" for record in found.records) > commands // 10

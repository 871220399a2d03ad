"""Two thousand random commands, right and wrong, leave a session alive, finite and replayable.

`make soak` takes a million: test/soak/test_hostile.py.
"""

from __future__ import annotations

import pytest

from support.storms import check_storm


@pytest.mark.parametrize("seed", [0, 1])  # within the limits of every day, and to all ends
def test_a_session_outlives_a_storm_and_its_record_replays(seed: int) -> None:
    found = check_storm(seed)
    assert len(found.rows) > 0


def test_a_session_withstands_random_trajectories() -> None:
    found = check_storm(7, 300, offsets=True)
    assert sum(record["kind"] == "trajectory" for record in found.records) > 30

"""A million random commands, and ten thousand requests to each node from five clients at once.

`make test` takes a hundredth of each: test/unit/nodes/simulator/test_storms.py,
test/integration/test_requests.py, test/integration/test_hostile_commands.py.
"""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from support import requests
from support.processes import Starter
from support.requests import Clients
from support.storms import COMMANDS, check_storm

IN_PROCESS = 1_000_000
REQUESTS = 10_000
SEED = 20_261_122

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]


def test_a_million_random_commands_in_process() -> None:
    accepted = refused = rows = 0
    for seed in range(SEED, SEED + IN_PROCESS // COMMANDS):
        found = check_storm(seed)
        accepted, refused = accepted + found.accepted, refused + found.refused
        rows += len(found.rows)
    print(f"\nseeds from {SEED}: {accepted} accepted, {refused} refused, {rows} rows replayed")
    assert accepted + refused == IN_PROCESS


@pytest.mark.parametrize("node", ["simulator", "recorder"])
def test_ten_thousand_requests_of_five_clients_are_answered(
    start: Starter, tmp_path: Path, node: str
) -> None:
    print(f"\nseed {SEED}")
    if node == "simulator":
        process = start(node, "--ros-args", "-p", "crossfade_duration:=0.1")
        clients = Clients("bouncing_disk", requests.OF_SIMULATOR)
    else:
        process = start(node, str(tmp_path / "run"))
        clients = Clients(node, requests.OF_RECORDER)
    try:
        answers = clients.ask(SEED, REQUESTS)
    finally:
        clients.close()
    assert sum(map(len, answers.values())) == REQUESTS
    requests.check_answers(answers)
    assert process.running, process.output
    assert process.end(signal.SIGINT) == 0
    assert "Traceback" not in process.output

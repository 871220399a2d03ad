"""A million random commands in process and 10⁵ over DDS; 10⁴ requests of five clients to each node.

`make test` takes a hundredth of most: test/unit/nodes/simulator/test_storms.py,
test/integration/test_requests.py, test/integration/test_hostile_commands.py.
"""

from __future__ import annotations

import signal
from collections.abc import Mapping
from pathlib import Path

import pytest

from support import requests
from support.barrage import FAST, withstand
from support.live import LiveSimulators
from support.processes import Starter
from support.requests import Clients
from support.ros_peer import Peer
from support.storms import COMMANDS, check_storm
from support.twins import NAMES, PAUSED, Twin, compare

IN_PROCESS = 1_000_000
WITH_OFFSETS = 100_000
OVER_DDS, OF_ONE = 100_000, 10_000
"""Commands in all, and of one simulator."""
ROWS = 100_000
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


def test_a_hundred_thousand_random_trajectories_and_commands_in_process() -> None:
    accepted = refused = 0
    for seed in range(SEED, SEED + WITH_OFFSETS // COMMANDS):
        found = check_storm(seed, offsets=True)
        accepted, refused = accepted + found.accepted, refused + found.refused
    print(f"\nseeds from {SEED}: {accepted} accepted, {refused} refused")
    assert accepted + refused == WITH_OFFSETS


def arguments(values: Mapping[str, float]) -> list[str]:
    """The command line of parameters."""
    given = [part for name, value in values.items() for part in ("-p", f"{name}:={value}")]
    return ["--ros-args", *given]


@pytest.mark.parametrize("seed", range(SEED, SEED + OVER_DDS // OF_ONE))
def test_a_hundred_thousand_random_commands_over_dds(start: Starter, seed: int) -> None:
    process, peer = start("simulator", *arguments(FAST)), Peer()
    try:
        print("\n" + withstand(peer, seed, OF_ONE))
    finally:
        peer.close()
    assert process.end(signal.SIGINT) == 0
    assert "Traceback" not in process.output


def test_what_is_refused_changes_no_bit(live: LiveSimulators) -> None:
    peers = [Peer(name) for name in NAMES]
    for peer, name in zip(peers, NAMES, strict=True):
        live(peer, namespace=name, **PAUSED)
    try:
        calm, disturbed = map(Twin, peers)
        values = compare(calm, disturbed, SEED, ROWS)
    finally:
        for peer in peers:
            peer.close()
    print(f"\n{values['accepted']} accepted, {values['refused']} refused")
    assert values["commands lost on the way"] == "0"


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

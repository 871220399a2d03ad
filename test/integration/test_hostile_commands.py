"""A simulator under commands of every kind over DDS: alive, finite, replayable, undisturbed.

`make soak` sends a hundred times as many: test/soak/test_hostile.py.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest

from support.barrage import FAST, withstand
from support.processes import Starter
from support.ros_peer import Peer
from support.twins import NAMES, Twin, compare, paused_in

SEED = 20_261_122
COMMANDS = 1000
ROWS = 10_000

Peers = Callable[..., Peer]


@pytest.fixture
def peers(ros_domain: int) -> Iterator[Peers]:
    """Make peers, closed at the end."""
    made: list[Peer] = []

    def make(namespace: str = "") -> Peer:
        made.append(Peer(namespace))
        return made[-1]

    yield make
    for peer in made:
        peer.close()


def test_a_simulator_withstands_random_commands(start: Starter, peers: Peers) -> None:
    process = start("simulator", *FAST)
    print(withstand(peers(), SEED, COMMANDS))
    assert process.end() == 0
    assert "Traceback" not in process.output


def test_what_is_refused_changes_no_bit(start: Starter, peers: Peers) -> None:
    for name in NAMES:
        start("simulator", *paused_in(name))
    calm, disturbed = (Twin(peers(name)) for name in NAMES)
    values = compare(calm, disturbed, SEED, ROWS)
    assert int(values["refused"]) > 100
    assert values["commands lost on the way"] == "0"

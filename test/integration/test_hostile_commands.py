"""A simulator under commands of every kind over DDS: alive, finite, replayable, undisturbed.

`make soak` sends a hundred times as many to a process: test/soak/test_hostile.py.
"""

from __future__ import annotations

from support.barrage import FAST, withstand
from support.live import LiveSimulators
from support.ros_peer import Peer
from support.twins import NAMES, PAUSED, Twin, compare

SEED = 20_261_122
COMMANDS = 150
ROWS = 1500


def test_a_simulator_withstands_random_commands(live: LiveSimulators) -> None:
    peer = Peer()
    live(peer, **FAST)
    print(withstand(peer, SEED, COMMANDS))
    peer.close()


def test_what_is_refused_changes_no_bit(live: LiveSimulators) -> None:
    """Each of two in the executor of its own peer."""
    peers = [Peer(name) for name in NAMES]
    for peer, name in zip(peers, NAMES, strict=True):
        live(peer, namespace=name, **PAUSED)
    calm, disturbed = map(Twin, peers)
    values = compare(calm, disturbed, SEED, ROWS)
    assert int(values["refused"]) > 15
    assert values["commands lost on the way"] == "0"
    for peer in peers:
        peer.close()

"""Wrong commands of every kind over DDS leave a run undisturbed, to the bit.

`make soak` sends many more, and random ones to a process: test/soak/test_hostile.py. In this
process storms of them are test/unit/nodes/simulator/test_storms.py.
"""

from __future__ import annotations

from support.live import LiveSimulators
from support.ros_peer import Peer
from support.twins import NAMES, PAUSED, Twin, compare

SEED = 20_261_122
ROWS = 1500


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

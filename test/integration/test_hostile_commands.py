"""Wrong commands of every kind over DDS leave a run undisturbed, to the bit.

`make soak` sends many more, and random ones to a process. In this process storms of them are
test/unit/nodes/simulator/test_storms.py.
"""

from __future__ import annotations

import signal

import pytest

from reference.cases import FIRST, examples
from support.barrage import FAST, withstand
from support.live import LiveSimulators
from support.processes import Starter
from support.ros_peer import Peer
from support.twins import NAMES, PAUSED, Twin, compare

SEED = FIRST or 20_261_122
ROWS = examples(1_500, 100_000)
OF_ONE = 10_000
"""Commands of one simulator."""


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


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(SEED, SEED + 10))
def test_a_hundred_thousand_random_commands_over_dds(start: Starter, seed: int) -> None:
    given = [part for name, value in FAST.items() for part in ("-p", f"{name}:={value}")]
    process, peer = start("simulator", "--ros-args", *given), Peer()
    try:
        print("\n" + withstand(peer, seed, OF_ONE))
    finally:
        peer.close()
    assert process.end(signal.SIGINT) == 0
    assert "Traceback" not in process.output

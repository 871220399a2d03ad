"""Random commands over DDS, right and wrong: all are counted, and the record replays to the bit.

`make soak` sends a hundred thousand. In this process storms of them are
test/unit/nodes/simulator/test_storms.py.
"""

from __future__ import annotations

import signal

import pytest

from reference.cases import FIRST, examples
from support.barrage import FAST, withstand
from support.coverage import in_soak
from support.processes import Starter
from support.ros_peer import Peer

SEED = FIRST or 20_261_122
OF_ONE = examples(300, 10_000)
"""Commands of one simulator."""


@pytest.mark.parametrize("seed", [SEED, *in_soak(*range(SEED + 1, SEED + 10))])
def test_random_commands_over_dds_leave_a_run_that_replays(start: Starter, seed: int) -> None:
    given = [part for name, value in FAST.items() for part in ("-p", f"{name}:={value}")]
    process, peer = start("simulator", "--ros-args", *given), Peer()
    try:
        print("\n" + withstand(peer, seed, OF_ONE))
    finally:
        peer.close()
    assert process.end(signal.SIGINT) == 0
    assert "Traceback" not in process.output

"""Lockstep for long: the same inputs whatever the machine does, and many gates without a deadlock.

make soak
"""

from __future__ import annotations

import hashlib
import os
import sys
from pathlib import Path

import pytest

from support.processes import Starter
from support.ros_peer import Peer

CONTROLLER = str(Path(__file__).resolve().parents[1] / "support" / "lockstep_controller.py")
RUNS = int(os.environ.get("BOUNCING_DISK_LOCKSTEP_RUNS", "100"))
GATES = int(os.environ.get("BOUNCING_DISK_LOCKSTEP_GATES", "100000"))
SECONDS_PER_GATE = 150.0 / 100_000
INPUTS = 30
DIGESTS: set[str] = set()
"""Of all runs, by whatever transport."""
SIMULATOR = ("simulator", "--ros-args", "-p", "real_time_factor:=0.0", "-p")

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]


@pytest.mark.parametrize("transport", ["shared memory", "UDP"])
def test_runs_under_varying_load_have_one_digest(start: Starter, transport: str) -> None:
    env: dict[str, str | None] = (
        {"FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"} if transport == "UDP" else {}
    )
    digests = DIGESTS
    for k in range(RUNS // 2):
        executor = ("single", "multi", "events")[k % 3]
        load = (0.0, 0.002, 0.02)[k % 3]
        peer = Peer()
        simulator = start(*SIMULATOR, "lockstep:=impact", env=env)
        arguments = (CONTROLLER, "1", str(2 * INPUTS), executor, str(load))
        controller = start.command([sys.executable, "-P", *arguments], env=env)
        peer.spin_until(
            lambda: (
                sum('"kind":"trajectory"' in one.data for one in peer.heard["disk/inputs"])  # noqa: B023
                >= INPUTS
            ),
            timeout=60.0,
        )
        inputs = [one.data for one in peer.heard["disk/inputs"] if '"trajectory"' in one.data]
        digests.add(hashlib.sha256("".join(inputs[:INPUTS]).encode()).hexdigest())
        controller.end()
        simulator.end()
        peer.close()
    assert len(digests) == 1


def test_many_gates_without_a_deadlock(start: Starter) -> None:
    start(*SIMULATOR, "lockstep:=tick", "-p", "axial_amplitude:=0.0")
    controller = start.command([sys.executable, "-P", CONTROLLER, "1", str(GATES), "single", "0"])
    found = controller.wait_for(r"answered (\d+) gates in ([\d.]+) s", timeout=600.0)
    print(found.group(0))
    assert float(found.group(2)) <= SECONDS_PER_GATE * GATES


def test_a_controller_that_is_killed_is_reported_and_replaced(start: Starter) -> None:
    simulator = start(*SIMULATOR, "lockstep:=tick")
    arguments = (CONTROLLER, "1", "1000000", "single", "0")
    first = start.command([sys.executable, "-P", *arguments])
    peer = Peer()
    peer.spin_until(lambda: len(peer.heard["joint_states"]) > 50)
    first.kill()
    simulator.wait_for(r"controller 1 has said nothing", timeout=1.5)
    peer.heard["joint_states"].clear()
    start.command([sys.executable, "-P", *arguments])
    peer.spin_until(lambda: len(peer.heard["joint_states"]) > 50, timeout=30.0)
    peer.close()

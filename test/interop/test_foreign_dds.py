"""A subscriber of another make, without ROS: Cyclone DDS reads and commands the simulator."""

from __future__ import annotations

import time

import pytest

from support.processes import PATIENCE, Starter

pytestmark = pytest.mark.interop


def test_another_middleware_reads_and_commands_the_simulator(
    start: Starter, ros_domain: int
) -> None:
    pytest.importorskip("cyclonedds")
    from support.cyclone_peer import CyclonePeer

    node = start("simulator", "--ros-args", "-p", "preset:=pizza_single_toss")
    peer = CyclonePeer(ros_domain)
    deadline = time.monotonic() + PATIENCE
    asked = 7.5  # rad; no preset has it
    while not (peer.largest("platform_rotation") > 0.9 * asked):
        assert node.running
        assert time.monotonic() < deadline, "the command did not change joint_states"
        peer.command(asked)
        time.sleep(0.05)  # the pace of the command, not a wait for its effect

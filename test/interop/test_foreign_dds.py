"""A subscriber of another make, without ROS: Cyclone DDS reads and commands the simulator."""

from __future__ import annotations

import time

import pytest

from support.processes import Starter, wait_until

pytestmark = pytest.mark.interop


def test_another_middleware_reads_and_commands_the_simulator(
    start: Starter, ros_domain: int
) -> None:
    pytest.importorskip("cyclonedds")
    from support.cyclone_peer import CyclonePeer

    node = start("simulator", "--ros-args", "-p", "preset:=pizza_single_toss")
    peer = CyclonePeer(ros_domain)
    asked = 7.5  # rad; no preset has it

    def command() -> None:
        peer.command(asked)
        time.sleep(0.05)  # its pace, not a wait for its effect

    wait_until(
        lambda: peer.largest("platform_rotation") > 0.9 * asked,
        command,
        lambda: f"the command did not change joint_states:\n{node.output}",
    )

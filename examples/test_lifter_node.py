"""The test of lifter_node.py: `pytest examples/test_lifter_node.py`; it needs ROS 2.

Time stands while nothing is asked of the simulator, so a loaded machine changes no result.
"""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from lifter_node import HEIGHT, SECONDS, Lifter
from rclpy.qos import DurabilityPolicy, QoSProfile
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros.testing import SteppedSimulator

Make = Callable[..., SteppedSimulator]

START = {"axial_amplitude": 0.0, "initial_height": 0.05}
"""A disk that falls on a platform at rest."""


def test_the_platform_is_lifted_after_an_impact(stepped_simulator: Make) -> None:
    """Within the process of the test: exact, the same bits in each run."""
    simulator = stepped_simulator(**START)
    node = Lifter(context=simulator.context)
    node.listen()
    simulator.add_node(node)
    simulator.run_to_impact()
    simulator.run(SECONDS)
    assert simulator.state.platform_position == HEIGHT
    simulator.close_node(node)


def test_the_node_answers_from_a_process_of_its_own(stepped_simulator: Make) -> None:
    """As a user starts it: over the middleware, so conditions are waited for."""
    simulator = stepped_simulator(**START)
    offsets: list[JointTrajectory] = []
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    simulator.node.create_subscription(JointTrajectory, "platform/offset", offsets.append, latched)
    node = subprocess.Popen([sys.executable, Path(__file__).with_name("lifter_node.py")])
    try:
        simulator.wait_for_subscriber("disk/impacts")
        simulator.advance(0.105)  # the disk falls 5 cm in 0.101 s
        simulator.spin_until(lambda: bool(offsets))  # its trajectory has come
        simulator.advance(SECONDS)
        assert simulator.state.platform_position == HEIGHT
    finally:
        node.terminate()
        node.wait()

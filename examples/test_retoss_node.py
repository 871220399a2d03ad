"""The test of retoss_node.py: `pytest examples/test_retoss_node.py` (a clone: `make setup` first).

`stepped_simulator` comes with the installed package (a pytest plugin). Time moves only where the
test says so, so that the test is as fast as the machine and never waits for a clock.
"""

from collections.abc import Callable

from bouncing_disk_ros.testing import SteppedSimulator
from retoss_node import AMPLITUDE, Retoss


def test_the_disk_is_tossed_whenever_it_rests(
    stepped_simulator: Callable[..., SteppedSimulator],
) -> None:
    """Three times from rest into the air and back."""
    simulator = stepped_simulator(axial_amplitude=0.0, angular_amplitude=0.0, restitution=0.3)
    node = Retoss(context=simulator.context)
    simulator.add_node(node)
    simulator.wait_for_subscriber("joint_states")
    for toss in (1, 2, 3):
        simulator.advance(0.1)  # both are at rest ...
        simulator.spin_until(lambda: simulator.motion.axial_amplitude == AMPLITUDE)
        assert node.tosses == toss
        while simulator.state.gap < 0.01:  # ... then the disk flies ...
            simulator.advance(0.05)
        simulator.spin_until(lambda: simulator.motion.axial_amplitude == 0.0)
        simulator.advance(5.0)  # ... and comes to rest
        assert simulator.state.gap == 0.0
    node.destroy_node()

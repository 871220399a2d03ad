"""A node that tosses the disk again whenever it has come to rest.

    python -m bouncing_disk_ros simulator --ros-args -p axial_amplitude:=0.0
    python examples/retoss_node.py      (in another terminal)

It needs ROS 2 (where the package is built with colcon, `ros2 run bouncing_disk_ros simulator`
starts the simulator too). Its test is test_retoss_node.py.
"""

import contextlib
from typing import Any

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

AMPLITUDE = 0.07
"""Axial amplitude of a toss, m: at 3 Hz the platform falls faster than the disk."""
CLEARLY = 0.005
"""The disk has left the platform when it is so far above it, m."""


class Retoss(Node):
    """Starts the platform when disk and platform are at rest, stops it when the disk flies."""

    def __init__(self, **settings: Any) -> None:
        super().__init__("retoss", **settings)
        self.tosses = 0
        self.tossing = False
        self.amplitude = self.create_publisher(Float64, "platform/axial_amplitude", 10)
        self.create_subscription(JointState, "joint_states", self.on_state, 10)

    def on_state(self, state: JointState) -> None:
        """Decide by one sample of positions and velocities."""
        disk, platform = (state.name.index(name) for name in ("disk_axial", "platform_axial"))
        height = state.position[disk] - state.position[platform]
        at_rest = height == 0.0 and state.velocity[disk] == state.velocity[platform] == 0.0
        if not self.tossing and at_rest:
            self.tossing = True
            self.tosses += 1
            self.amplitude.publish(Float64(data=AMPLITUDE))
        elif self.tossing and height > CLEARLY:
            self.tossing = False
            self.amplitude.publish(Float64(data=0.0))


def main() -> None:
    """Run the node until Ctrl-C."""
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt):
        rclpy.spin(Retoss())


if __name__ == "__main__":
    main()

"""A ROS 2 node of one's own: it lifts the platform a little after each cloud of impacts.

    python -m bouncing_disk_ros simulator --ros-args -p preset:=pizza_multiple_toss
    python examples/lifter_node.py

(the second line in another terminal, with the same ROS environment). Needs only rclpy and messages.
Its test, test_lifter_node.py, runs it within the test and as a process of its own.
"""

import contextlib
import sys

if "--help" in sys.argv:  # before the imports, which need ROS 2
    print(__doc__)
    sys.exit()

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import PointCloud2
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

HEIGHT, SECONDS = 0.01, 0.05


class Lifter(Node):
    """Moves the platform up and down by turns, each time SECONDS after the impact."""

    def __init__(self, **settings: object) -> None:
        super().__init__("lifter", **settings)
        self.lifts = 0
        self.out = self.create_publisher(JointTrajectory, "platform/joint_trajectory", 10)

    def listen(self) -> None:
        """Begin to answer impacts."""
        self.create_subscription(PointCloud2, "disk/impacts", self.on_impacts, 10)

    def on_impacts(self, _: PointCloud2) -> None:
        """Answer with a smooth step; the stamp 0 means now."""
        self.lifts += 1
        point = JointTrajectoryPoint(positions=[HEIGHT * (self.lifts % 2)], velocities=[0.0])
        point.time_from_start.nanosec = round(SECONDS * 1e9)
        self.out.publish(JointTrajectory(joint_names=["platform_axial"], points=[point]))


def main() -> None:
    """Run until Ctrl-C."""
    rclpy.init()
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        node = Lifter()
        while not node.out.get_subscription_count():  # an answer before this would be lost
            rclpy.spin_once(node, timeout_sec=0.1)
        node.listen()
        while True:  # not rclpy.spin: a signal that comes between two of its waits is lost
            rclpy.spin_once(node, timeout_sec=0.1)


if __name__ == "__main__":
    main()

"""A node that subscribes to all topics of a simulator and builds a `RunRecord`."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.report.run_record import RunRecord
from bouncing_disk_ros.report.run_record_builder import RunRecordBuilder
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.topics import TOPICS

_TYPES = {
    kind.__name__: kind
    for kind in (DiagnosticArray, JointState, JointTrajectory, PointCloud2, String, TwistStamped)
}


class DemoWatcher(Node):
    """Builds `record` from what arrives; times are simulated seconds."""

    def __init__(self, name: str, disk: Disk) -> None:
        super().__init__(name)
        self.record = RunRecord(disk)
        self._builder = RunRecordBuilder(self.record, self.get_namespace())
        for topic, callback in self._builder.handlers.items():
            row = TOPICS[topic]
            kind = _TYPES[row.type.rpartition("/")[2]]
            self.create_subscription(kind, topic, callback, profile_of(row))

    @property
    def phase(self) -> str:
        """Phase of motion of the disk, or paused."""
        return self._builder.phase

    @property
    def time(self) -> float:
        """Simulated time of the newest sample, s."""
        return self.record.states[-1].time if self.record.states else 0.0

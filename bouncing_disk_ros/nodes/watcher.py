"""A node that hears everything a simulator says and keeps it as a `RunRecord`."""

from __future__ import annotations

import json

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import TwistStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory

from bouncing_disk_ros.analysis.impact_text import LossCounter
from bouncing_disk_ros.analysis.run_record import Health, RunRecord, State
from bouncing_disk_ros.core.model import Disk
from bouncing_disk_ros.ros.conversions import (
    impacts_from_msg,
    msg_to_joints,
    msg_to_motion,
    msg_to_speed,
    time_to_ns,
)
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.run.clock import NS
from bouncing_disk_ros.topics import TOPICS

_REPORTED = (
    ("real time", "simulated time (s)"),
    ("real time", "lateness p50 (s)"),
    ("real time", "lateness p99 (s)"),
    ("real time", "lateness max (s)"),
    ("energy", "residual / throughput"),
)
"""Task and key of each field of `Health` behind its stamp."""


class Watcher(Node):
    """Keeps what it hears in `record`; times are simulated seconds, at real-time factor 1."""

    def __init__(self, name: str, disk: Disk) -> None:
        super().__init__(name)
        self.record = RunRecord(disk)
        self.phase = ""
        self._losses = LossCounter()
        self._offset_ns: int | None = None  # simulated time = ROS time + offset
        for topic, kind, callback in (
            ("platform/motion", JointTrajectory, self._on_motion),
            ("disk/phase", String, self._on_phase),
            ("disk/inputs", String, self._on_input),
            ("disk/impacts", PointCloud2, self._on_impacts),
            ("disk/rotor_speed", TwistStamped, self._on_speed),
            ("joint_states", JointState, self._on_joints),
            ("/diagnostics", DiagnosticArray, self._on_diagnostics),
        ):
            self.create_subscription(kind, topic, callback, profile_of(TOPICS[topic]))

    @property
    def time(self) -> float:
        """Simulated time of the newest sample, s."""
        return self.record.states[-1].time if self.record.states else 0.0

    def _simulated(self, stamp_ns: int) -> float:
        return (stamp_ns + (self._offset_ns or 0)) / NS

    def _on_motion(self, msg: JointTrajectory) -> None:
        motion = msg_to_motion(msg)
        self._offset_ns = motion.begin_ns - time_to_ns(msg.header.stamp)
        if not self.record.motions or self.record.motions[-1] != motion:
            self.record.motions.append(motion)

    def _on_phase(self, msg: String) -> None:
        self.phase = msg.data

    def _on_input(self, msg: String) -> None:
        # run.inputs would read it too, but loads the core: kernels compiled twice at a cold start
        self.record.inputs += json.loads(msg.data)["kind"] not in ("snapshot", "pause")

    def _on_impacts(self, cloud: PointCloud2) -> None:
        rows = impacts_from_msg(cloud)
        if len(rows):
            self._losses.note(rows)
            self.record.lost = self._losses.lost
            self.record.chunks.append(rows)

    def _on_speed(self, msg: TwistStamped) -> None:
        if self._offset_ns is not None:
            time = self._simulated(time_to_ns(msg.header.stamp))
            self.record.speeds.append((time, msg_to_speed(msg)[1]))

    def _on_joints(self, msg: JointState) -> None:
        if self._offset_ns is None:  # platform/motion says where simulated time stands
            return
        joints = msg_to_joints(msg)
        self.record.states.append(
            State(
                self._simulated(time_to_ns(msg.header.stamp)),
                joints["disk_axial"][0],
                joints["platform_axial"][0],
                joints["disk_rotation"][1],
            )
        )

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        tasks = {
            status.name.split(": ")[-1]: {value.key: value.value for value in status.values}
            for status in msg.status
        }
        try:
            values = [float(tasks[task][key]) for task, key in _REPORTED]
        except (KeyError, ValueError):  # of another node, or not running yet
            return
        self.record.health.append(Health(time_to_ns(msg.header.stamp) / NS, *values))

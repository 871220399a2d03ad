"""The node of `juggle`: impacts in, offset trajectories out, and a status that is latched."""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header, String
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.analysis.scales import axial_forcing_of, velocity_scale
from bouncing_disk_ros.core.model import Disk, Motion
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.juggling.juggler import Controller, Juggler, OffsetTrajectory
from bouncing_disk_ros.juggling.loop_settings import (
    Limits,
    Sensor,
    check_strategy,
    period_one_points,
)
from bouncing_disk_ros.juggling.loop_verdict import Watch
from bouncing_disk_ros.juggling.own_controller import Setup, controller_of
from bouncing_disk_ros.juggling.simulated_loop import hear_row, heard_of
from bouncing_disk_ros.nodes.shared.node_tool import options
from bouncing_disk_ros.parameters import Spec
from bouncing_disk_ros.ros.conversions import ns_to_duration, ns_to_time
from bouncing_disk_ros.ros.from_messages import impacts_from_msg, msg_to_motion, time_to_ns
from bouncing_disk_ros.ros.qos import profile_of
from bouncing_disk_ros.topics import OFFSET_JOINTS, TOPICS
from bouncing_disk_ros.units import NS

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class JuggleNode(Node):
    """Answers impacts as a controller of `juggling` says. Attributes: `status`, `sent`."""

    def __init__(self, table: Mapping[str, Spec], **settings: Any) -> None:
        super().__init__("juggle", **settings)
        values = options(self, table)
        self._values = values
        self._strategy, self._file = str(values["strategy"]), str(values["controller"])
        check_strategy(self._strategy)
        delay, jitter, missed = (float(values[name]) for name in ("delay", "jitter", "missed"))
        self._sensor = Sensor(delay, jitter, missed, int(values["seed"]))
        self.sent = 0
        self.status = ""
        self._controller: Controller | None = None
        self._motion: Motion | None = None
        self._setup: Setup | None = None
        self._watch: Watch | None = None
        topic = TOPICS["platform/joint_trajectory"]
        self._out = self.create_publisher(JointTrajectory, topic.name, profile_of(topic))
        self._status = self.create_publisher(String, "~/status", LATCHED)
        for name, kind, callback in (
            ("platform/motion", JointTrajectory, self._on_motion),
            ("disk/impacts", PointCloud2, self._on_impacts),
        ):
            self.create_subscription(kind, name, callback, profile_of(TOPICS[name]))
        self._say("waiting for platform/motion")

    def _say(self, text: str) -> None:
        """A new status: latched, and a line in the log."""
        if text != self.status:
            self.status = text
            self.get_logger().info(text)
            self._status.publish(String(data=text))

    # --- what is heard ----------------------------------------------------------------------------
    def _on_motion(self, msg: JointTrajectory) -> None:
        try:
            motion = msg_to_motion(msg)
            if motion.begin_ns != motion.end_ns:  # a cross-fade: the steady motion comes next
                self._controller = None
                self._say("waiting for a steady motion")
                return
            self._begin(motion.target, motion.forcing_phase, motion.begin_ns)
        except InputError as error:
            self._controller = None
            self._say(f"cannot juggle: {error.line}")

    def _begin(self, motion: Motion, forcing_phase: float, at_ns: int) -> None:
        """Start anew under a steady motion."""
        values = self._values
        restitution, gravity = float(values["restitution"]), float(values["gravity"])
        disk = Disk(1.0, restitution, 0.0, 1.0, 1.0, gravity)
        phase = forcing_phase - math.tau * motion.frequency * at_ns / NS
        limits = Limits(*(float(values[f"{name}_limit"]) for name in Limits.__dataclass_fields__))
        setup = Setup(motion, disk, limits, phase)
        orbit = period_one_points(axial_forcing_of(motion, disk), restitution)
        self._controller = controller_of(
            self._strategy, self._file, setup, learns=bool(values["learn"])
        )
        self._setup = setup
        self._watch = Watch(orbit, float(values["tolerance"]), int(values["streak"]))
        self._say(f"{self._file or self._strategy}: not captured")

    def _on_impacts(self, cloud: PointCloud2) -> None:
        controller, setup, watch = self._controller, self._setup, self._watch
        if controller is None or setup is None or watch is None:
            return
        try:
            rows = impacts_from_msg(cloud)
        except InputError as error:
            self.get_logger().warning(error.line, once=True)
            return
        last_ns = round(float(rows["time"][-1]) * NS)
        lead_ns = round(float(self._values["lead"]) * NS)
        scale = velocity_scale(setup.motion, setup.disk)
        for row in rows:
            watched = watch.learnt(controller.orbit) if isinstance(controller, Juggler) else watch
            velocity = float(row["axial_velocity"]) / scale
            watched.note(float(row["forcing_phase"]), velocity, rests=heard_of(row).rests)
            heard = hear_row(row, self._sensor, setup.motion.frequency, 0, int(row["index"]))
            if heard is None:
                continue
            known_ns, impact = heard
            answer = controller.on_impact(impact, known_ns + lead_ns)
            if answer is not None:
                stamp_ns = time_to_ns(cloud.header.stamp)
                factor = float(self._values["real_time_factor"]) or 1.0
                late_ns = answer.begin_ns - last_ns
                self._send(answer, stamp_ns + round(late_ns / factor), factor)
        self._say(f"{self._file or self._strategy}: {watch.text}")

    # --- what is commanded ------------------------------------------------------------------------
    def _send(self, answer: OffsetTrajectory, stamp_ns: int, factor: float) -> None:
        points = [
            JointTrajectoryPoint(
                positions=array("d", [point.position]),
                velocities=array("d", [point.velocity]),
                accelerations=array("d", [point.acceleration]),
                time_from_start=ns_to_duration(round((point.at_ns - answer.begin_ns) / factor)),
            )
            for point in answer.points
        ]
        header = Header(stamp=ns_to_time(stamp_ns))
        names = [OFFSET_JOINTS[0]]
        self._out.publish(JointTrajectory(header=header, joint_names=names, points=points))
        self.sent += 1

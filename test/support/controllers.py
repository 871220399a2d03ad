"""Controllers of closed loops for tests: nodes that answer impacts, samples or gates."""

from __future__ import annotations

from array import array
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import Float64, UInt64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.ros.from_messages import impacts_from_msg, time_to_ns
from bouncing_disk_ros.ros.to_messages import ns_to_duration, ns_to_time

GATES = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MOVE_NS = 50_000_000


def move(joint: str, position: float, after_ns: int = MOVE_NS) -> JointTrajectory:
    """A smooth move of the offset from now on."""
    point = JointTrajectoryPoint(
        positions=array("d", [position]),
        velocities=array("d", [0.0]),
        accelerations=array("d", [0.0]),
        time_from_start=ns_to_duration(after_ns),
    )
    return JointTrajectory(joint_names=[joint], points=[point])


class ImpactAnswerer(Node):
    """Answers each impact by an offset that depends on its speed."""

    def __init__(self, name: str = "answerer", **settings: Any) -> None:
        super().__init__(name, **settings)
        self.heard = 0
        self._offsets = self.create_publisher(JointTrajectory, "platform/joint_trajectory", 100)
        self.create_subscription(PointCloud2, "disk/impacts", self.on_impacts, 1000)

    def on_impacts(self, cloud: PointCloud2) -> None:
        """One answer for each message."""
        rows = impacts_from_msg(cloud)
        self.heard += len(rows)
        speed = float(rows["axial_impact_velocity"][-1])
        answer = move("platform_axial", -1e-3 * speed)
        if self.heard % 2:  # now, or by the stamp of the impact
            answer.header.stamp = ns_to_time(time_to_ns(cloud.header.stamp) + MOVE_NS)
        self._offsets.publish(answer)


class SampleAnswerer(Node):
    """Turns the platform by an offset that depends on the disk's height, at each tenth sample."""

    def __init__(self, name: str = "turner", **settings: Any) -> None:
        super().__init__(name, **settings)
        self.heard = 0
        self._offsets = self.create_publisher(JointTrajectory, "platform/joint_trajectory", 100)
        self._lag = self.create_publisher(Float64, "platform/phase_lag", 100)
        self.create_subscription(JointState, "joint_states", self.on_state, 100)

    def on_state(self, state: JointState) -> None:
        """An answer now and then."""
        self.heard += 1
        if self.heard % 10 == 0:
            self._offsets.publish(move("platform_rotation", float(state.position[0])))
        if self.heard % 35 == 0:
            self._lag.publish(Float64(data=float(state.position[2])))


class GateController(Node):
    """Answers each gate, and each impact since the last one by an input."""

    def __init__(self, number: int = 1, **settings: Any) -> None:
        super().__init__(f"controller_{number}", **settings)
        self.number, self.gates, self._rows, self._asked = number, 0, 0, (-1, 0, 0)
        self._inputs = 0
        self.silent = False
        self._first: int | None = None  # row that it may answer
        self._amplitude = self.create_publisher(Float64, "platform/axial_amplitude", 100)
        self._offsets = self.create_publisher(JointTrajectory, "platform/joint_trajectory", 100)
        self._proceed = self.create_publisher(UInt64MultiArray, "/bouncing_disk/proceed", 100)
        self.create_subscription(PointCloud2, "disk/impacts", self.on_impacts, 1000)
        self.create_subscription(UInt64MultiArray, "/bouncing_disk/gate", self.on_gate, GATES)

    def on_impacts(self, cloud: PointCloud2) -> None:
        """One input for each row."""
        if self.silent:
            return
        rows = impacts_from_msg(cloud)
        self._rows = int(rows["index"][-1]) + 1
        for row in rows:
            sign = 1.0 if self.number % 2 else -1.0
            if self._first is not None and row["index"] >= self._first:
                self.send(move("platform_axial", sign * 1e-3 * float(row["axial_impact_velocity"])))
        self.answer()

    def send(self, message: JointTrajectory) -> None:
        """Publish an input and count it."""
        self._offsets.publish(message)
        self._inputs += 1

    def fade(self, amplitude: float) -> None:
        """Command an amplitude, before the next answer."""
        self._amplitude.publish(Float64(data=amplitude))
        self._inputs += 1

    @property
    def is_matched(self) -> bool:
        """Whether somebody hears what is published."""
        outputs = (self._offsets, self._proceed, self._amplitude)
        return all(one.get_subscription_count() for one in outputs)

    def on_gate(self, msg: UInt64MultiArray) -> None:
        """A gate is closed."""
        self._asked = tuple(msg.data)
        if self._first is None:  # what came before this controller it may not have heard
            self._rows = self._first = self._asked[2]
        self.answer()

    def answer(self) -> None:
        """Answer once all rows that the gate speaks of are here."""
        gate, _, rows = self._asked
        if gate < 0 or self._rows < rows or self.silent or not self.is_matched:
            return
        self.gates += 1
        self._asked = (-1, 0, 0)
        answer = (self.number, gate, self._inputs)
        self._inputs = 0
        self._proceed.publish(UInt64MultiArray(data=array("Q", answer)))

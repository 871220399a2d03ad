"""The tables of topics and services: name, type, quality of service, direction, meaning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType


class Direction(StrEnum):
    """Which way a topic goes, seen from the simulator."""

    IN = "in"
    OUT = "out"


@dataclass(frozen=True)
class Qos:
    """Quality of service: history depth (0: all), reliable or best effort, latched or volatile."""

    depth: int
    reliable: bool = True
    latched: bool = False

    def __str__(self) -> str:
        words = ["reliable" if self.reliable else "best effort"]
        words += ["transient local"] if self.latched else []
        return ", ".join([*words, f"depth {self.depth}" if self.depth else "keep all"])


@dataclass(frozen=True)
class Topic:
    """One topic of the simulator; names are relative but for /diagnostics, /clock, /tf."""

    name: str
    type: str
    qos: Qos
    direction: Direction
    meaning: str
    example: str = ""


@dataclass(frozen=True)
class Service:
    """One service of the simulator (private names)."""

    name: str
    type: str
    meaning: str
    example: str


MOTION_NAMES = ("axial_amplitude", "angular_amplitude", "frequency", "phase_lag")
"""Names of the four numbers of a platform motion, in the order of `core.model.Motion`."""
MOTION_UNITS = MappingProxyType(dict(zip(MOTION_NAMES, ("m", "rad", "Hz", "rad"), strict=True)))
OFFSET_JOINTS = ("platform_axial", "platform_rotation")
"""Joints of platform/joint_trajectory: the axial offset, m, and the angular one, rad."""
JOINT_NAMES = ("disk_axial", "disk_rotation", "platform_axial", "platform_rotation")
MAX_ROWS = 1000
"""Largest number of impact rows in one message."""
WORLD_FRAME = "world"
IMPACT_FRAME = "next_collision"

IMPACT_REQUIRED = ("count", "index", "time", "kind")
"""Fields without which a message of disk/impacts cannot be read; others may be missing."""

_COMMAND_QOS = Qos(100)


def _value_topic(name: str) -> Topic:
    unit = MOTION_UNITS[name]
    example = f"ros2 topic pub --once /platform/{name} std_msgs/msg/Float64 '{{data: 0.03}}'"
    meaning = f"one new value ({unit}), from now on; the rules of platform/command apply"
    return Topic(f"platform/{name}", "std_msgs/msg/Float64", _COMMAND_QOS, Direction.IN, meaning,
                 example)  # fmt: skip


_TOPICS = (
    Topic("platform/command", "trajectory_msgs/msg/JointTrajectory", _COMMAND_QOS, Direction.IN,
          "a programme of platform motions. joint_names: any of axial_amplitude (m), "
          "angular_amplitude (rad), frequency (Hz), phase_lag (rad). Cross-fades lead to the "
          "positions of each point at header.stamp + time_from_start; stamp 0: now",
          "ros2 topic pub --once /platform/command trajectory_msgs/msg/JointTrajectory "
          "'{joint_names: [axial_amplitude, frequency], "
          "points: [{positions: [0.05, 2.5], time_from_start: {sec: 1}}]}'"),
    *(_value_topic(name) for name in MOTION_NAMES),
    Topic("platform/joint_trajectory", "trajectory_msgs/msg/JointTrajectory", _COMMAND_QOS,
          Direction.IN, "a trajectory added to the sinusoid, from header.stamp on (0: now). "
          "joint_names: any of platform_axial (m), platform_rotation (rad). Points with positions "
          "alone give lines, with velocities cubics, with accelerations too quintics",
          "ros2 topic pub --once /platform/joint_trajectory trajectory_msgs/msg/JointTrajectory "
          "'{joint_names: [platform_axial], "
          "points: [{positions: [0.02], velocities: [0.0], time_from_start: {sec: 1}}]}'"),
    Topic("disk/impulse", "geometry_msgs/msg/WrenchStamped", _COMMAND_QOS, Direction.IN,
          "an impulse on the disk at header.stamp (0: now). force.z: axial impulse (N·s). "
          "torque.z: angular impulse (N·m·s). The other components must be 0",
          "ros2 topic pub --once /disk/impulse geometry_msgs/msg/WrenchStamped "
          "'{wrench: {force: {z: 0.1}}}'"),
    Topic("platform/motion", "trajectory_msgs/msg/JointTrajectory", Qos(1, latched=True),
          Direction.OUT, "the platform's motion now. points[0]: at the begin of the cross-fade. "
          "points[1]: at its end. Without a cross-fade both are equal",
          "ros2 topic echo /platform/motion"),
    Topic("platform/offset", "trajectory_msgs/msg/JointTrajectory", Qos(1, latched=True),
          Direction.OUT, "the present offset, published from the first trajectory on. points[0]: "
          "at the begin of the present segment. points[1]: at the begin of the next segment. At a "
          "constant offset both are equal",
          "ros2 topic echo /platform/offset"),
    Topic("disk/inputs", "std_msgs/msg/String", Qos(1000, latched=True), Direction.OUT,
          "the record of the inputs of the run, one JSON object for each accepted input. The first "
          "object, and one every few seconds, is a snapshot of the full state. A replay needs this "
          "topic alone",
          "ros2 topic echo /disk/inputs"),
    Topic("joint_states", "sensor_msgs/msg/JointState", Qos(10), Direction.OUT,
          "position and velocity of disk_axial, disk_rotation, platform_axial, platform_rotation; "
          "as effort, the contact force or torque on this body. Angles grow beyond 2π",
          "ros2 topic echo /joint_states"),
    Topic("disk/phase", "std_msgs/msg/String", Qos(1, latched=True), Direction.OUT,
          "flight, sticking, sliding, held (by a brake) or paused; published at each change",
          "ros2 topic echo /disk/phase"),
    Topic("disk/impacts", "sensor_msgs/msg/PointCloud2", Qos(1000), Direction.OUT,
          "every impact, in a row of its own or counted in a row that several slow impacts share; "
          "x, y, z: its point in the next-collision section; index rises by 1 from row to row",
          "ros2 run bouncing_disk_ros echo_impacts"),
    Topic("disk/rotor_speed", "geometry_msgs/msg/TwistStamped", Qos(10), Direction.OUT,
          "mean speeds since the last message: angular.z (rad/s), linear.z (m/s)",
          "ros2 topic echo /disk/rotor_speed"),
    Topic("disk/run_state", "sensor_msgs/msg/JointState", Qos(10), Direction.OUT,
          "numbers to plot, once a second: pending inputs, refusals, the energy ledger and more. "
          "name[k] is the name of position[k]",
          "ros2 topic echo /disk/run_state"),
    Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", Qos(10), Direction.OUT,
          "once a second: real-time factor, lateness, impacts, energy balance, refused inputs",
          "ros2 topic echo /diagnostics"),
    Topic("/clock", "rosgraph_msgs/msg/Clock", Qos(1, reliable=False), Direction.OUT,
          "only with publish_clock: the time of all stamps, which is the wall time at activation "
          "plus simulated time",
          "ros2 run bouncing_disk_ros simulator --ros-args -p publish_clock:=true"),
)  # fmt: skip

TOPICS: Mapping[str, Topic] = MappingProxyType({topic.name: topic for topic in _TOPICS})

_TRANSFORM_TOPICS = (
    Topic("/tf", "tf2_msgs/msg/TFMessage", Qos(100), Direction.OUT,
          "only with publish_tf: the frames of platform, disk and next-collision section, with "
          "each sample", "ros2 topic echo /tf"),
    Topic("robot_description", "std_msgs/msg/String", Qos(1, latched=True), Direction.OUT,
          "only with publish_tf: the URDF of platform and disk. Its links have the frames' names",
          "ros2 topic echo /robot_description"),
)  # fmt: skip
TRANSFORM_TOPICS: Mapping[str, Topic] = MappingProxyType(
    {row.name: row for row in _TRANSFORM_TOPICS}
)
"""Topics for viewers, with publish_tf only; the type of /tf is not on every machine."""

_LOCKSTEP_TOPICS = (
    Topic("~/gate", "std_msgs/msg/UInt64MultiArray", Qos(1, latched=True), Direction.OUT,
          "with lockstep: simulated time waits at this gate. The number of the gate, the simulated "
          "time since the start (ns, not a stamp), and the number of rows of disk/impacts "
          "published until then. Published again while answers are missing",
          "ros2 topic echo /bouncing_disk/gate"),
    Topic("~/proceed", "std_msgs/msg/UInt64MultiArray", Qos(0), Direction.IN,
          "with lockstep: the answer of a controller to a gate. The number of the controller, the "
          "number of the gate, and how many inputs the controller has published since its last "
          "answer (refused inputs count)",
          "ros2 topic pub --once /bouncing_disk/proceed std_msgs/msg/UInt64MultiArray "
          "'{data: [1, 0, 0]}'"),
)  # fmt: skip
LOCKSTEP_TOPICS: Mapping[str, Topic] = MappingProxyType({row.name: row for row in _LOCKSTEP_TOPICS})
"""Topics with the parameter lockstep only (private names)."""

_STUDY_TOPICS = (
    Topic("~/progress", "std_msgs/msg/Float32", Qos(1, latched=True), Direction.OUT,
          "share of the parts that are done, 0 to 1"),
    Topic("~/figure/compressed", "sensor_msgs/msg/CompressedImage", Qos(1, latched=True),
          Direction.OUT, "the main figure, PNG"),
    Topic("~/result", "sensor_msgs/msg/Image", Qos(1, latched=True), Direction.OUT,
          "of a study of a map: the map"),
)  # fmt: skip
STUDY_TOPICS: Mapping[str, Topic] = MappingProxyType({row.name: row for row in _STUDY_TOPICS})
"""Topics of the node of a study (private names)."""

JUGGLE_STATUS = Topic(
    "~/status", "std_msgs/msg/String", Qos(1, latched=True), Direction.OUT,
    "of the node juggle: what it waits for, whether the orbit is captured, or why it cannot juggle",
)  # fmt: skip

_SERVICES = (
    Service("~/pause", "std_srvs/srv/SetBool", "pause (true) or resume (false)",
            "ros2 service call /bouncing_disk/pause std_srvs/srv/SetBool '{data: true}'"),
    Service("~/step", "std_srvs/srv/Trigger", "while paused: simulate step_periods periods, "
            "or as step_until says",
            "ros2 service call /bouncing_disk/step std_srvs/srv/Trigger"),
    Service("~/reset", "std_srvs/srv/Trigger", "back to the initial state; time continues",
            "ros2 service call /bouncing_disk/reset std_srvs/srv/Trigger"),
)  # fmt: skip

SERVICES: Mapping[str, Service] = MappingProxyType({row.name: row for row in _SERVICES})

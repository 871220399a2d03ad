"""Core values as standard ROS messages: x_to_msg of each x.

Every function raises `InputError` on content it does not know, and nothing else; none loops over
impact rows. The way back is in `from_messages`, and of the commands in `command_bytes`, which reads
their bytes.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import TwistStamped, Vector3, Wrench, WrenchStamped
from numpy.typing import NDArray
from sensor_msgs.msg import JointState, PointCloud2, PointField
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.core.model import IMPACT_DTYPE, MotionInForce, Sample
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros.from_messages import MOTION_COLUMNS, impact_fields
from bouncing_disk_ros.run.command_validation import ImpulseRequest, ProgrammeRequest
from bouncing_disk_ros.run.trajectory_validation import TrajectoryRequest
from bouncing_disk_ros.topics import IMPACT_FRAME, JOINT_NAMES, OFFSET_JOINTS, WORLD_FRAME
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from bouncing_disk_ros.core.simulation import Simulation

LAST_STAMP_NS = 2**31 * NS - 1
"""The last stamp a message can hold; a free run may pass it."""


def ns_to_time(stamp_ns: int) -> Time:
    """Whole nanoseconds as a stamp; held at the ends of the message's range (1901 and 2038)."""
    sec, nanosec = divmod(min(max(stamp_ns, -LAST_STAMP_NS - 1), LAST_STAMP_NS), NS)
    return Time(sec=sec, nanosec=nanosec)


def ns_to_duration(interval_ns: int) -> Duration:
    """Whole nanoseconds as a duration."""
    sec, nanosec = divmod(interval_ns, NS)
    return Duration(sec=sec, nanosec=nanosec)


def named_numbers_to_msg(values: Mapping[str, float], stamp_ns: int) -> JointState:
    """Numbers by name as the message of disk/run_state."""
    header = Header(stamp=ns_to_time(stamp_ns))
    return JointState(header=header, name=list(values), position=array("d", values.values()))


# --- commands -------------------------------------------------------------------------------------
def trajectory_to_msg(request: ProgrammeRequest | TrajectoryRequest) -> JointTrajectory:
    """A request as the message of platform/command, or of platform/joint_trajectory."""
    points = [_point(point.after_ns, *point.stated) for point in request.points]
    header = Header(stamp=ns_to_time(request.stamp_ns))
    return JointTrajectory(header=header, joint_names=list(request.names), points=points)


def _point(after_ns: int, *stated: Sequence[float]) -> JointTrajectoryPoint:
    """A point with positions, and velocities and accelerations where given."""
    names = ("positions", "velocities", "accelerations")
    values = {name: array("d", one) for name, one in zip(names, stated, strict=False)}
    return JointTrajectoryPoint(time_from_start=ns_to_duration(after_ns), **values)


def impulse_to_msg(request: ImpulseRequest) -> WrenchStamped:
    """An impulse as the message of disk/impulse."""
    (fx, fy, fz), (tx, ty, tz) = request.force, request.torque
    wrench = Wrench(force=Vector3(x=fx, y=fy, z=fz), torque=Vector3(x=tx, y=ty, z=tz))
    return WrenchStamped(header=Header(stamp=ns_to_time(request.stamp_ns)), wrench=wrench)


# --- impacts --------------------------------------------------------------------------------------
IMPACT_FIELDS = [
    PointField(name=name, offset=offset, datatype=datatype, count=count)
    for name, offset, datatype, count in impact_fields()
]
"""The fields of a message of disk/impacts, in the order of the offsets."""


def impacts_to_msg(rows: NDArray[np.void], stamp_ns: int, frame: str = IMPACT_FRAME) -> PointCloud2:
    """Rows of IMPACT_DTYPE as a cloud; not empty."""
    if rows.dtype != IMPACT_DTYPE or rows.ndim != 1 or len(rows) == 0:
        raise InputError(
            "rows", f"{rows.shape} of {rows.dtype}", "a nonempty array of IMPACT_DTYPE"
        )
    data = array("B")
    data.frombytes(rows.tobytes())
    return PointCloud2(
        header=Header(stamp=ns_to_time(stamp_ns), frame_id=frame),
        height=1,
        width=len(rows),
        fields=IMPACT_FIELDS,
        is_bigendian=False,
        point_step=IMPACT_DTYPE.itemsize,
        row_step=IMPACT_DTYPE.itemsize * len(rows),
        data=data,
        is_dense=True,
    )


# --- states ---------------------------------------------------------------------------------------
def motion_to_msg(
    motion: MotionInForce, stamp_ns: int, frame: str = WORLD_FRAME
) -> JointTrajectory:
    """The motion in force as the message of platform/motion; the stamp is that of its beginning."""
    interval_ns = motion.end_ns - motion.begin_ns
    # the frequency blends symmetrically, so the forcing gains the mean frequency times the duration
    mean = 0.5 * (motion.start.frequency + motion.target.frequency)
    gained = motion.forcing_phase / math.tau + mean * (interval_ns / NS)
    begin = (*motion.start, motion.forcing_phase, float(motion.cycles), motion.begin_ns / NS)
    end = (
        *motion.target,
        math.tau * (gained % 1.0),
        float(motion.cycles + math.floor(gained)),
        motion.end_ns / NS,
    )
    points = [_point(0, begin), _point(interval_ns, end)]
    header = Header(stamp=ns_to_time(stamp_ns), frame_id=frame)
    return JointTrajectory(header=header, joint_names=list(MOTION_COLUMNS), points=points)


def offset_to_msg(
    simulation: Simulation, stamp_ns: int, frame: str = WORLD_FRAME
) -> JointTrajectory:
    """The offset in force as the message of platform/offset; the stamp is that of its beginning."""
    begin, end = simulation.offset_begin_ns, simulation.offset_end_ns
    lanes = simulation.offset
    first = [segment.at(begin) for segment in simulation.offset_in_force]
    last = first if end is None else [lane.spliced_state(end) for lane in lanes]
    after = 0 if end is None else end - begin
    points = [_point(0, *zip(*first, strict=True)), _point(after, *zip(*last, strict=True))]
    header = Header(stamp=ns_to_time(stamp_ns), frame_id=frame)
    return JointTrajectory(header=header, joint_names=list(OFFSET_JOINTS), points=points)


def new_joint_state() -> JointState:
    """A message of joint_states to be filled in place by `fill_joint_state`."""
    zeros = [array("d", [0.0] * len(JOINT_NAMES)) for _ in range(3)]
    return JointState(name=list(JOINT_NAMES), position=zeros[0], velocity=zeros[1], effort=zeros[2])


def fill_joint_state(msg: JointState, sample: Sample, stamp_ns: int) -> JointState:
    """Put a sample into a message made by `new_joint_state` (much cheaper than a new one)."""
    msg.header.stamp = ns_to_time(stamp_ns)
    position, velocity, effort = msg.position, msg.velocity, msg.effort
    position[0], position[1] = sample.axial_position, sample.unwrapped_angle
    position[2], position[3] = sample.platform_position, sample.platform_angle
    velocity[0], velocity[1] = sample.axial_velocity, sample.angular_velocity
    velocity[2], velocity[3] = sample.platform_velocity, sample.platform_angular_velocity
    effort[0], effort[1] = sample.axial_force, sample.friction_torque
    effort[2], effort[3] = 0.0 - sample.axial_force, 0.0 - sample.friction_torque  # no -0.0
    return msg


def speed_to_msg(speeds: Sequence[float], stamp_ns: int, frame: str = WORLD_FRAME) -> TwistStamped:
    """Mean speeds as the message of disk/rotor_speed."""
    msg = TwistStamped(header=Header(stamp=ns_to_time(stamp_ns), frame_id=frame))
    msg.twist.linear.z, msg.twist.angular.z = float(speeds[0]), float(speeds[1])
    return msg

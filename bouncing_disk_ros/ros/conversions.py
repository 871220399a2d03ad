"""Pairs of x_to_msg and msg_to_x: core values on one side, standard ROS messages on the other.

Every function raises `InputError` on content it does not know, and nothing else; none loops over
impact rows. The other half of the commands is in `serialized`, which reads their bytes.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Mapping, Sequence

import numpy as np
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import TwistStamped
from numpy.typing import NDArray
from sensor_msgs.msg import JointState, PointCloud2, PointField
from std_msgs.msg import Header
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from bouncing_disk_ros.core.model import IMPACT_DTYPE, ImpactKind, Motion, MotionInForce, Sample
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.run.command_validation import ProgrammeRequest
from bouncing_disk_ros.topics import IMPACT_FRAME, JOINT_NAMES, MOTION_NAMES, WORLD_FRAME
from bouncing_disk_ros.units import NS

_FIELD_TYPES = {"f4": PointField.FLOAT32, "f8": PointField.FLOAT64, "u4": PointField.UINT32,
                "u1": PointField.UINT8}  # fmt: skip
MOTION_COLUMNS = (*MOTION_NAMES, "forcing_phase", "cycles", "simulated_time")
"""joint_names of platform/motion: the motion, and where the forcing stood."""


_ROW_LIMITS = {"index": 2.0**53, "time": 1e10, "kind": len(ImpactKind)}
LAST_STAMP_NS = 2**31 * NS - 1
"""The last stamp a message can hold; a free run may pass it."""
LARGEST = 1e18
"""The largest number that makes sense in platform/motion (cycles of a century at 10 MHz: 3e16)."""


def ns_to_time(stamp_ns: int) -> Time:
    """Whole nanoseconds as a stamp; held at the ends of the message's range (1901 and 2038)."""
    sec, nanosec = divmod(min(max(stamp_ns, -LAST_STAMP_NS - 1), LAST_STAMP_NS), NS)
    return Time(sec=sec, nanosec=nanosec)


def time_to_ns(time: Time | Duration) -> int:
    """A stamp or duration as whole nanoseconds."""
    return int(time.sec) * NS + int(time.nanosec)


def ns_to_duration(interval_ns: int) -> Duration:
    """Whole nanoseconds as a duration."""
    sec, nanosec = divmod(interval_ns, NS)
    return Duration(sec=sec, nanosec=nanosec)


def named_numbers_to_msg(values: Mapping[str, float], stamp_ns: int) -> JointState:
    """Numbers by name as the message of disk/run_state."""
    header = Header(stamp=ns_to_time(stamp_ns))
    return JointState(header=header, name=list(values), position=array("d", values.values()))


# --- commands -------------------------------------------------------------------------------------
def programme_to_msg(request: ProgrammeRequest) -> JointTrajectory:
    """A programme of platform motions as the message of platform/command."""
    points = [
        JointTrajectoryPoint(
            positions=array("d", point.positions), time_from_start=ns_to_duration(point.after_ns)
        )
        for point in request.points
    ]
    header = Header(stamp=ns_to_time(request.stamp_ns))
    return JointTrajectory(header=header, joint_names=list(request.names), points=points)


# --- impacts --------------------------------------------------------------------------------------
def _point_fields() -> list[PointField]:
    fields = []
    assert IMPACT_DTYPE.fields is not None
    for name, (kind, offset, *_) in IMPACT_DTYPE.fields.items():
        datatype = _FIELD_TYPES[kind.str[1:]]
        fields.append(PointField(name=name, offset=int(offset), datatype=datatype, count=1))
    return fields


IMPACT_FIELDS = _point_fields()
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


def impacts_from_msg(cloud: PointCloud2) -> NDArray[np.void]:
    """The rows of a message of disk/impacts as IMPACT_DTYPE, a read-only view without a copy.

    Raises InputError when the cloud has another layout, or rows that count or time cannot follow.
    """
    given = [(f.name, f.offset, f.datatype, f.count) for f in cloud.fields]
    wanted = [(f.name, f.offset, f.datatype, f.count) for f in IMPACT_FIELDS]
    if given != wanted:
        names = ", ".join(f"{name}@{offset}" for name, offset, *_ in given)
        hint = "Is this disk/impacts of the same package version?"
        raise InputError("cloud fields", names, "the fields of disk/impacts", hint)
    if cloud.is_bigendian or cloud.point_step != IMPACT_DTYPE.itemsize:
        layout = f"point_step {cloud.point_step}, is_bigendian {cloud.is_bigendian}"
        raise InputError("cloud layout", layout, f"{IMPACT_DTYPE.itemsize}, false")
    count = cloud.width * cloud.height
    if len(cloud.data) != count * IMPACT_DTYPE.itemsize:
        raise InputError("cloud data", f"{len(cloud.data)} bytes", f"{count} rows of "
                         f"{IMPACT_DTYPE.itemsize} bytes")  # fmt: skip
    rows = np.frombuffer(cloud.data, dtype=IMPACT_DTYPE)
    rows.flags.writeable = False
    _check_rows(rows)
    return rows


def _check_rows(rows: NDArray[np.void]) -> None:
    """InputError where an index, a time or a kind is none."""
    for name, limit in _ROW_LIMITS.items():
        column = rows[name]
        wrong = ~((column >= 0) & (column < limit))  # NaN is neither
        if wrong.any():
            given = column[wrong][0]
            raise InputError(f"cloud {name}", given, f"numbers from 0 to below {limit:g}")


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
    points = [
        JointTrajectoryPoint(positions=array("d", begin)),
        JointTrajectoryPoint(
            positions=array("d", end), time_from_start=ns_to_duration(interval_ns)
        ),
    ]
    header = Header(stamp=ns_to_time(stamp_ns), frame_id=frame)
    return JointTrajectory(header=header, joint_names=list(MOTION_COLUMNS), points=points)


def msg_to_motion(msg: JointTrajectory) -> MotionInForce:
    """The motion in force of a message of platform/motion."""
    if tuple(msg.joint_names) != MOTION_COLUMNS or len(msg.points) != 2:
        given = ", ".join(msg.joint_names) + f"; {len(msg.points)} points"
        raise InputError("platform/motion", given, ", ".join(MOTION_COLUMNS) + "; 2 points")
    begin, end = (tuple(point.positions) for point in msg.points)
    if not len(begin) == len(end) == len(MOTION_COLUMNS):
        given = f"{len(begin)} and {len(end)} positions"
        raise InputError("platform/motion", given, f"{len(MOTION_COLUMNS)} of each point")
    for number in (*begin, *end):
        if not abs(number) <= LARGEST:  # nor is NaN
            raise InputError("platform/motion", number, f"numbers up to {LARGEST:g}")
    if not min(begin[2], end[2]) > 0.0:
        raise InputError("platform/motion frequency", min(begin[2], end[2]), "> 0 Hz")
    begin_ns = round(begin[6] * NS)
    interval_ns = time_to_ns(msg.points[1].time_from_start)
    return MotionInForce(
        begin_ns, begin_ns + interval_ns, Motion(*begin[:4]), Motion(*end[:4]), int(begin[5]),
        begin[4],
    )  # fmt: skip


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


def msg_to_joints(msg: JointState) -> dict[str, tuple[float, float, float]]:
    """Position, velocity and effort of each joint of a message of joint_states."""
    if not len(msg.name) == len(msg.position) == len(msg.velocity) == len(msg.effort):
        raise InputError("joint_states", f"{len(msg.name)} names", "as many values of each kind")
    rows = zip(msg.position, msg.velocity, msg.effort, strict=True)
    return dict(zip(msg.name, rows, strict=True))


def mean_speed(first: Sample, second: Sample) -> tuple[float, float]:
    """Mean axial (m/s) and angular (rad/s) speed of the disk between two samples."""
    seconds = (second.time_ns - first.time_ns) / NS
    turned = math.tau * (second.turns - first.turns) + (second.angle - first.angle)
    return (second.axial_position - first.axial_position) / seconds, turned / seconds


def speed_to_msg(speeds: Sequence[float], stamp_ns: int, frame: str = WORLD_FRAME) -> TwistStamped:
    """Mean speeds as the message of disk/rotor_speed."""
    msg = TwistStamped(header=Header(stamp=ns_to_time(stamp_ns), frame_id=frame))
    msg.twist.linear.z, msg.twist.angular.z = float(speeds[0]), float(speeds[1])
    return msg


def msg_to_speed(msg: TwistStamped) -> tuple[float, float]:
    """Axial (m/s) and angular (rad/s) speed of a message of disk/rotor_speed."""
    return msg.twist.linear.z, msg.twist.angular.z

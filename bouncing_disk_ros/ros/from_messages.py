"""Standard ROS messages as core values: x of each msg_to_x; needs no ROS.

The messages are those of rclpy, or objects with the same fields that a bag was decoded into. Every
function raises `InputError` on content it does not know, and nothing else; none loops over impact
rows. The way back is in `to_messages`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.core.model import IMPACT_DTYPE, ImpactKind, Motion, MotionInForce
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.topics import IMPACT_REQUIRED, MOTION_NAMES
from bouncing_disk_ros.units import NS

if TYPE_CHECKING:
    from builtin_interfaces.msg import Duration, Time
    from geometry_msgs.msg import TwistStamped
    from sensor_msgs.msg import JointState, PointCloud2
    from trajectory_msgs.msg import JointTrajectory

FIELD_TYPES = {"f4": 7, "f8": 8, "u4": 6, "u1": 2}
"""Kind of a number -> its datatype in sensor_msgs/msg/PointField."""
MOTION_COLUMNS = (*MOTION_NAMES, "forcing_phase", "cycles", "simulated_time")
"""joint_names of platform/motion: the motion, and where the forcing stood."""
LARGEST = 1e18
"""The largest number that makes sense in platform/motion (cycles of a century at 10 MHz: 3e16)."""
_ROW_LIMITS = {"index": 2.0**53, "time": 1e10, "kind": len(ImpactKind)}


def impact_fields() -> list[tuple[str, int, int, int]]:
    """Name, offset, datatype and count of each field of a message of disk/impacts."""
    assert IMPACT_DTYPE.fields is not None
    return [
        (name, int(offset), FIELD_TYPES[kind.str[1:]], 1)
        for name, (kind, offset, *_) in IMPACT_DTYPE.fields.items()
    ]


_FIELDS = impact_fields()
_OFFSETS = {name: offset for name, offset, *_ in _FIELDS}


def time_to_ns(time: Time | Duration) -> int:
    """A stamp or duration as whole nanoseconds."""
    return int(time.sec) * NS + int(time.nanosec)


def impacts_from_msg(cloud: PointCloud2) -> NDArray[np.void]:
    """Rows of a message of disk/impacts as IMPACT_DTYPE, read-only.

    Fields are found by their names: another version may have more, which are ignored, or fewer,
    which are nan here (`lacking_fields`). Of this version's layout it is a view without a copy.
    Raises InputError when one of IMPACT_REQUIRED is missing, or count or time cannot follow.

    >>> impacts_from_msg(cloud)["axial_impact_velocity"]
    """
    offsets = _offsets(cloud)
    if not offsets.keys() >= {*IMPACT_REQUIRED}:
        names = ", ".join(f"{one.name}@{one.offset}" for one in cloud.fields)
        hint = "Is this disk/impacts?"
        raise InputError("cloud fields", names, f"with {', '.join(IMPACT_REQUIRED)}", hint)
    if cloud.is_bigendian:
        raise InputError("cloud layout", "is_bigendian true", "false")
    count, step = cloud.width * cloud.height, cloud.point_step
    if len(cloud.data) != count * step:
        given = f"{len(cloud.data)} bytes"
        raise InputError("cloud data", given, f"{count} rows of {step} bytes")
    if offsets == _OFFSETS and step == IMPACT_DTYPE.itemsize:
        rows = np.frombuffer(cloud.data, dtype=IMPACT_DTYPE)
    else:
        formats = [IMPACT_DTYPE[name] for name in offsets]
        layout = {"names": [*offsets], "formats": formats, "offsets": [*offsets.values()]}
        kind: np.dtype[np.void] = np.dtype({**layout, "itemsize": step})  # type: ignore[call-overload, unused-ignore]
        stored = np.frombuffer(cloud.data, kind)
        rows = np.zeros(count, IMPACT_DTYPE)
        for name in IMPACT_DTYPE.names or ():
            rows[name] = stored[name] if name in offsets else np.nan
    rows.flags.writeable = False
    _check_rows(rows)
    return rows


def lacking_fields(cloud: PointCloud2) -> tuple[str, ...]:
    """The fields of IMPACT_DTYPE that a message of disk/impacts lacks: nan in its rows."""
    offsets = _offsets(cloud)
    return tuple(name for name in _OFFSETS if name not in offsets)


def _offsets(cloud: PointCloud2) -> dict[str, int]:
    """Where the fields of IMPACT_DTYPE, of its types, stand in a row of a cloud."""
    given = {one.name: (one.offset, one.datatype, one.count) for one in cloud.fields}
    return {
        name: given[name][0]
        for name, _, *kind in _FIELDS
        if name in given
        and [*given[name][1:]] == kind
        and given[name][0] + IMPACT_DTYPE[name].itemsize <= cloud.point_step
    }


def _check_rows(rows: NDArray[np.void]) -> None:
    """InputError where an index, a time or a kind is none."""
    for name, limit in _ROW_LIMITS.items():
        column = rows[name]
        wrong = ~((column >= 0) & (column < limit))  # NaN is neither
        if wrong.any():
            given = column[wrong][0]
            raise InputError(f"cloud {name}", given, f"numbers from 0 to below {limit:g}")


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


def msg_to_joints(msg: JointState) -> dict[str, tuple[float, float, float]]:
    """Position, velocity and effort of each joint of a message of joint_states."""
    if not len(msg.name) == len(msg.position) == len(msg.velocity) == len(msg.effort):
        raise InputError("joint_states", f"{len(msg.name)} names", "as many values of each kind")
    rows = zip(msg.position, msg.velocity, msg.effort, strict=True)
    return dict(zip(msg.name, rows, strict=True))


def msg_to_speed(msg: TwistStamped) -> tuple[float, float]:
    """Axial (m/s) and angular (rad/s) speed of a message of disk/rotor_speed."""
    return msg.twist.linear.z, msg.twist.angular.z

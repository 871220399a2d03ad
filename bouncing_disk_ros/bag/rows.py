"""Messages of a bag as rows and columns: points of clouds, and the fields of other messages.

Points of clouds are viewed, not decoded; no Python loop runs over them.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.messages import Decode
from bouncing_disk_ros.errors import BagError, InputError, closest
from bouncing_disk_ros.units import NS

CLOUD = "sensor_msgs/msg/PointCloud2"
_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_PADDED = 1 << 28
"""Texts that would take more bytes as an array of one width are a column of objects."""


# --- columns --------------------------------------------------------------------------------------
def field_names(message: Any, prefix: str = "") -> list[str]:
    """Dotted names of the fields of a message; times and lists of messages count as one."""
    names = []
    for name in message.__dataclass_fields__:
        if name == "__msgtype__":
            continue
        value = getattr(message, name)
        if hasattr(value, "__msgtype__") and value.__msgtype__ not in _TIMES:
            names += field_names(value, f"{prefix}{name}.")
        else:
            names.append(prefix + name)
    return names


def gather(messages: Iterable[Any], fields: Sequence[str] | None) -> dict[str, NDArray[Any]]:
    """Columns of messages of one type, by dotted names; None: all fields."""
    values: dict[str, list[Any]] = {name: [] for name in fields or ()}
    getters: list[tuple[Callable[[Any], Any], list[Any]]] = []
    for message in messages:
        if not getters:
            names = field_names(message)
            if fields is None:
                values = {name: [] for name in names}
            getters = [(_getter(message, name, names), column) for name, column in values.items()]
        for get, column in getters:
            column.append(get(message))
    return {name: as_column(column) for name, column in values.items()}


def _getter(message: Any, name: str, names: Sequence[str]) -> Callable[[Any], Any]:
    get = attrgetter(name)
    try:
        value = get(message)
    except AttributeError:
        hint = closest(name, names)
        raise InputError("field", name, ", ".join(names), hint) from None
    if getattr(value, "__msgtype__", "") not in _TIMES:
        return get

    def nanoseconds(message: Any) -> int:
        time = get(message)
        return int(time.sec) * NS + int(time.nanosec)

    return nanoseconds


def as_column(values: Sequence[Any]) -> NDArray[Any]:
    """Values as an array: numbers and texts 1-D, arrays of one length 2-D, all else objects."""
    first = values[0] if values else None
    if isinstance(first, str) and 4 * max(map(len, values)) * len(values) > _PADDED:
        return np.array(values, dtype=object)
    if isinstance(first, (bool, int, float, str)):
        return np.array(values)
    if isinstance(first, np.ndarray) and len({value.shape for value in values}) == 1:
        return np.stack(values)
    column = np.empty(len(values), dtype=object)
    for place, value in enumerate(values):
        column[place] = value
    return column


# --- points of clouds -----------------------------------------------------------------------------
_FORMATS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
_POINT = 1 << 20
"""Bytes of a point, at most."""
_END = 4
"""A message ends at most so many bytes after its points: a flag, and what fills up a word."""


def cloud_dtype(cloud: Any) -> np.dtype[np.void]:
    """The dtype of the points of a cloud, from its own list of fields; BagError: untrue."""
    order = ">" if cloud.is_bigendian else "<"
    step = int(cloud.point_step)
    if not 0 < step <= _POINT or len(cloud.fields) > limits.CLOUD_FIELDS:
        given = f"{step} bytes and {len(cloud.fields)} fields"
        raise BagError(f"a cloud of points of {given}: at most {_POINT} and {limits.CLOUD_FIELDS}")
    names, formats, offsets = [], [], []
    for field in cloud.fields:
        one = _FORMATS.get(field.datatype)
        count = max(field.count, 1)
        if one is None or field.offset + count * int(one[1]) > step:
            given = f"type {field.datatype}, {field.count} times from byte {field.offset}"
            raise BagError(f"a field of a cloud, {field.name!r}, not within a point: {given}")
        names.append(field.name)
        formats.append(order + one if count == 1 else (order + one, (count,)))
        offsets.append(field.offset)
    if len({*names}) < len(names) or not all(name.isprintable() and name for name in names):
        raise BagError("a cloud whose fields have equal, empty or unprintable names")
    layout = {"names": names, "formats": formats, "offsets": offsets, "itemsize": step}
    return np.dtype(layout)  # type: ignore[call-overload, no-any-return, unused-ignore]


class CloudRows:
    """Points of the clouds of one topic, gathered into one structured array."""

    def __init__(self, decode: Decode) -> None:
        self._decode = decode
        self._frame, self._layout = b"", b""  # the bytes that two clouds of one layout share
        self._places = (0, 0)  # of height and of the points; 0: not known
        self.dtype: np.dtype[np.void] | None = None  # of the points; None before the first message
        self._points = bytearray()

    def add(self, data: bytes) -> int:
        """Take the points of one message; how many they are. BagError when it is damaged."""
        height_at, points_at = self._places
        known = (
            points_at > 0
            and data[12:height_at] == self._frame
            and data[height_at + 8 : points_at - 8] == self._layout
            and data[:4] == b"\0\1\0\0"
            and len(data) > points_at
        )
        if not known:
            return self._learn(data)
        row_step, length = struct.unpack_from("<II", data, points_at - 8)
        height, width = struct.unpack_from("<II", data, height_at)
        assert self.dtype is not None
        step = self.dtype.itemsize
        fits = 0 <= len(data) - points_at - length <= _END
        if row_step != width * step or length != height * row_step or not fits:
            return self._learn(data)
        self._points += memoryview(data)[points_at : points_at + length]
        return int(height * width)

    def _learn(self, data: bytes) -> int:
        """Decode a message in full and remember where its parts stand."""
        cloud = self._decode(data)
        dtype, points = cloud_dtype(cloud), cloud.data.tobytes()
        if self.dtype not in (None, dtype):
            raise BagError("the clouds of this topic have different fields; read them one by one")
        if (
            cloud.row_step != cloud.width * cloud.point_step
            or len(points) != cloud.height * cloud.row_step
        ):
            raise BagError("a cloud with gaps between its rows; read it with `decoded`")
        self.dtype = dtype
        self._remember(data, points)
        self._points += points
        return int(cloud.width * cloud.height)

    def _remember(self, data: bytes, points: bytes) -> None:
        """Where height and points stand, if they stand where a cloud has them."""
        (length,) = struct.unpack_from("<I", data, 12)  # of the name of the frame
        height_at = 4 + (12 + length + 3) // 4 * 4
        points_at = (len(data) - 1 - len(points)) // 4 * 4
        self._places = (0, 0)
        if data[points_at - 4 : points_at + len(points)] == struct.pack("<I", len(points)) + points:
            self._places = (height_at, points_at)
            self._frame = data[12:height_at]
            self._layout = data[height_at + 8 : points_at - 8]

    def array(self) -> NDArray[np.void]:
        """All points, in the order of the messages; writable, and nobody else's."""
        if self.dtype is None:
            return np.zeros(0, np.dtype([]))
        return np.frombuffer(self._points, self.dtype)

    def take(self) -> NDArray[np.void]:
        """The points since the last call, and forget them."""
        points = self.array()
        self._points = bytearray()
        return points

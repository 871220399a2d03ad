"""Messages of a bag as objects and as columns; types come from the bag itself, by `rosbags`.

Rows of point clouds are viewed, not decoded: no Python loop runs over them.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.bag.formats import BagError
from bouncing_disk_ros.errors import InputError, closest

CLOUD = "sensor_msgs/msg/PointCloud2"
_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_CLOUD_FORMATS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def decoder(kind: str, definition: str, encoding: str) -> Callable[[bytes], Any]:
    """A function from the CDR of one message to an object with its fields; InputError: unknown."""
    if encoding != "ros2msg":
        allowed = "ros2msg (that is what rosbag2 writes for .msg types)"
        raise InputError(f"definition of {kind}", encoding, allowed)
    try:  # here: who only records or recovers can do without it
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore
    except ImportError:
        raise BagError("decoding messages needs rosbags: pip install rosbags") from None
    store = get_typestore(Stores.EMPTY)
    try:
        store.register(get_types_from_msg(definition, kind))
    except Exception as error:  # noqa: BLE001 (whatever the parser does not understand)
        raise BagError(f"definition of {kind}: cannot be used: {error}") from None

    def decode(data: bytes) -> Any:
        try:
            return store.deserialize_cdr(data, kind)
        except Exception as error:  # noqa: BLE001
            raise BagError(f"a message of {kind} cannot be decoded: {error}") from None

    return decode


# --- point clouds ---------------------------------------------------------------------------------
def cloud_dtype(cloud: Any) -> np.dtype[np.void]:
    """The dtype of the points of a cloud, from its own list of fields."""
    order = ">" if cloud.is_bigendian else "<"
    names, formats, offsets = [], [], []
    for field in cloud.fields:
        one = f"{order}{_CLOUD_FORMATS[field.datatype]}"
        names.append(field.name)
        formats.append(one if field.count in (0, 1) else (one, (field.count,)))
        offsets.append(field.offset)
    layout = {"names": names, "formats": formats, "offsets": offsets, "itemsize": cloud.point_step}
    return np.dtype(layout)  # type: ignore[call-overload, no-any-return, unused-ignore]


class CloudRows:
    """Points of the clouds of one topic, gathered into one structured array."""

    def __init__(self, decode: Callable[[bytes], Any]) -> None:
        self._decode = decode
        self._frame, self._layout = b"", b""  # the bytes that two clouds of one layout share
        self._places = (0, 0)  # of height and of the points
        self._dtype: np.dtype[np.void] | None = None
        self._points = bytearray()

    def add(self, data: bytes) -> int:
        """Take the points of one message; how many they are."""
        height_at, points_at = self._places
        known = (
            self._dtype is not None
            and data[12:height_at] == self._frame
            and data[height_at + 8 : points_at - 8] == self._layout
        )
        if not known:
            return self._learn(data)
        row_step, length = struct.unpack_from("<II", data, points_at - 8)
        height, width = struct.unpack_from("<II", data, height_at)
        assert self._dtype is not None
        step = self._dtype.itemsize
        if row_step != width * step or length != height * row_step:
            return self._learn(data)
        self._points += memoryview(data)[points_at : points_at + length]
        return int(height * width)

    def _learn(self, data: bytes) -> int:
        """Decode a message in full and remember where its parts stand."""
        cloud = self._decode(data)
        dtype, size = cloud_dtype(cloud), len(cloud.data)
        if self._dtype not in (None, dtype):
            raise BagError("the clouds of this topic have different fields; read them one by one")
        self._dtype = dtype
        if (
            cloud.row_step != cloud.width * cloud.point_step
            or size != cloud.height * cloud.row_step
        ):
            raise BagError("a cloud with gaps between its rows; read it with `decoded`")
        points_at = next(at for at in range(len(data) - 1 - size, 0, -1) if at % 4 == 0)
        height_at = _height(data)
        if data[:2] == b"\x00\x01" and struct.unpack_from("<I", data, points_at - 4)[0] == size:
            self._places = (height_at, points_at)
            self._frame = data[12:height_at]
            self._layout = data[height_at + 8 : points_at - 8]
        self._points += cloud.data.tobytes()
        return int(cloud.width * cloud.height)

    def array(self) -> NDArray[np.void]:
        """All points, in the order of the messages; writable, and nobody else's."""
        if self._dtype is None:
            return np.zeros(0, np.dtype([]))
        return np.frombuffer(self._points, self._dtype)

    def take(self) -> NDArray[np.void]:
        """The points since the last call, and forget them."""
        points = self.array()
        self._points = bytearray()
        return points


def _height(data: bytes) -> int:
    """Where the height of a cloud stands: after the stamp and the frame's name."""
    (length,) = struct.unpack_from("<I", data, 12)
    return int(4 + (12 + length + 3) // 4 * 4)


# --- other messages -------------------------------------------------------------------------------
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
        return int(time.sec) * 1_000_000_000 + int(time.nanosec)

    return nanoseconds


def as_column(values: Sequence[Any]) -> NDArray[Any]:
    """Values as an array: numbers and texts 1-D, arrays of one length 2-D, all else objects."""
    first = values[0] if values else None
    if isinstance(first, (bool, int, float, str)):
        return np.array(values)
    if isinstance(first, np.ndarray) and len({value.shape for value in values}) == 1:
        return np.stack(values)
    column = np.empty(len(values), dtype=object)
    for place, value in enumerate(values):
        column[place] = value
    return column

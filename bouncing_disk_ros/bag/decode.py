"""Messages of a bag as objects and as columns; types come from the bag itself, by `rosbags`.

`rosbags` makes code of a definition, so each is checked before (`message_type`).
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bouncing_disk_ros.bag.bag_topic import Form
from bouncing_disk_ros.bag.formats import BagError
from bouncing_disk_ros.bag.message_type import MessageType, message_type
from bouncing_disk_ros.bag.schema import schema_of
from bouncing_disk_ros.errors import InputError, closest
from bouncing_disk_ros.units import NS

CLOUD = "sensor_msgs/msg/PointCloud2"
_TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
_ENCAPSULATION = 4
"""Bytes before the fields of a message; the first two say that it is CDR, and its byte order."""
_PADDED = 1 << 28
"""Texts that would take more bytes as an array of one width are a column of objects."""
Decode = Callable[[bytes], Any]


def usable(form: Form) -> MessageType:
    """The type of messages of a form. InputError: not of ROS 2, BagError: it cannot be used."""
    kind = form.type
    if form.encoding != "ros2msg" and not form.fault:
        allowed = "ros2msg (that is what rosbag2 writes for .msg types)"
        raise InputError(f"definition of {kind}", form.encoding, allowed)
    if form.message_encoding != "cdr":
        raise InputError(f"messages of {kind}", form.message_encoding, "cdr")
    if form.fault:
        raise BagError(f"messages of {kind or 'unknown type'} cannot be decoded: {form.fault}")
    return message_type(kind, form.definition)


@functools.lru_cache(maxsize=64)
def decoder(form: Form) -> Decode:
    """A function from the CDR of one message to an object with its fields; raises as `usable`."""
    found = usable(form)
    kind = found.kind
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.EMPTY)
    try:
        store.register(found.types)
        made = store.get_msgdef(kind)
    except Exception as error:  # noqa: BLE001 (whatever the library does not understand)
        raise BagError(f"definition of {kind}: cannot be used: {error}") from None

    readers = {b"\0\0": made.deserialize_cdr_be, b"\0\1": made.deserialize_cdr_le}

    def decode(data: bytes) -> Any:
        found.check(data)
        read = readers.get(data[:2])
        if read is None or len(data) < _ENCAPSULATION:
            raise BagError(f"a message of {kind} cannot be decoded: {data[:4].hex()} is no CDR")
        try:  # rmw_serialize leaves bytes behind a message: those are not looked at
            return read(data[_ENCAPSULATION:], 0, made.cls, store)[0]
        except Exception as error:  # noqa: BLE001
            raise BagError(f"a message of {kind} cannot be decoded: {error}") from None

    return decode


def check_installed(form: Form) -> None:
    """InputError unless messages of a form have just the fields of the type installed here.

    Where no package of that type is installed, those of the type in ROS 2 Jazzy. Raises as
    `usable` for what cannot be decoded at all.
    """
    theirs = usable(form).types
    ours = message_type(form.type, schema_of(form.type).text).types
    if any(name not in theirs or theirs[name][1] != row[1] for name, row in ours.items()):
        allowed = "the fields of the type that is installed here"
        raise InputError(f"definition of {form.type}", "other fields in the bag", allowed)


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

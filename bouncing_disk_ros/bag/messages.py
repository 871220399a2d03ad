"""Messages of a bag as objects: `rosbags` decodes them by the definitions in the bag.

`rosbags` makes code of a definition. Its grammar takes care of names; its sizes it trusts, so they
are checked before: numbers of fields, lengths of arrays, types within types (none within itself).
Of a message of more than a megabyte the strings and messages in it are counted before.
"""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable
from typing import Any, NamedTuple

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.schema import schema_of
from bouncing_disk_ros.errors import BagError, InputError

_BASE, _NESTED, _ARRAY, _SEQUENCE = 1, 2, 3, 4  # rosbags.interfaces.Nodetype
_SIZES = {
    "bool": 1, "byte": 1, "char": 1, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4,
    "uint32": 4, "float32": 4, "int64": 8, "uint64": 8, "float64": 8,
}  # fmt: skip
_LENGTH = {"little": struct.Struct("<I"), "big": struct.Struct(">I")}
Types = dict[str, tuple[list[Any], list[Any]]]


class Form(NamedTuple):
    """The form of the messages of a topic; `fault` says why it cannot be used."""

    type: str = ""
    definition: str = ""
    encoding: str = ""  # of the definition
    message_encoding: str = ""
    fault: str = ""


class MessageType:
    """The type `kind` and those in it. Raises BagError for a definition that cannot be used."""

    def __init__(self, kind: str, text: str) -> None:
        try:  # here: who only records or recovers can do without it
            from rosbags.typesys import get_types_from_msg
        except ImportError:
            raise BagError("decoding messages needs rosbags: pip install rosbags") from None
        self.kind = kind
        self._objects: dict[str, int] = {}  # of each type that was checked
        self._listed = 0  # strings and messages in arrays of fixed length: each is a line of code
        try:
            lines = _lines(text)
            try:
                read: Types = get_types_from_msg(lines, kind)
            except Exception as error:  # noqa: BLE001 (whatever the parser does not understand)
                reason = " ".join(str(error).split())[-120:]
                raise BagError(f"it cannot be read: {reason}") from None
            self.types: Types = {
                name: (constants, [(one, _unsigned(form)) for one, form in members])
                for name, (constants, members) in read.items()
            }
            self._check(kind, 0)
        except BagError as error:
            raise BagError(f"definition of {kind}: {error}") from None

    def _check(self, name: str, depth: int) -> int:
        """Objects that a value of a type becomes, but for sequences in it; BagError: too many."""
        if name in self._objects:
            return self._objects[name]
        if name not in self.types:
            raise BagError(f"the type {name} is not defined in it")
        if depth > limits.DEPTH:
            raise BagError(f"more than {limits.DEPTH} levels, or a type within itself")
        objects = 1
        for _, (kind, content) in self.types[name][1]:
            one, count = content if kind in (_ARRAY, _SEQUENCE) else ((kind, content), 1)
            each = self._check(one[1], depth + 1) if one[0] == _NESTED else 1
            if kind == _ARRAY and count < 1:
                raise BagError(f"an array of length {count}")
            if kind == _ARRAY and not _is_number(one):
                self._listed += count
                each *= count
            objects += each
            if self._listed > limits.ARRAY or objects > limits.OBJECTS:
                raise BagError("it would become too many strings and messages")
        self._objects[name] = objects
        return objects

    def check(self, data: bytes) -> None:
        """BagError when a message would become too many objects."""
        if len(data) <= limits.OBJECTS:  # each takes a byte at least
            return
        try:
            _Count(self.types, data).take(self.kind, 0)
        except struct.error:  # it ends too early: decoding says so
            return
        except _TooManyError:
            raise BagError(
                f"a message of {self.kind} with more than {limits.OBJECTS} strings and messages"
            ) from None


def _lines(text: str) -> str:
    """A definition without comments of their own lines; BagError when it is too long."""
    lines = [
        line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(lines) > limits.FIELDS:
        raise BagError(f"{len(lines)} lines: at most {limits.FIELDS}")
    return "".join(f"{line}\n" for line in lines)


@functools.lru_cache(maxsize=64)
def message_type(kind: str, text: str) -> MessageType:
    """`MessageType`, made once of each definition; `package/Name` is `package/msg/Name`."""
    return MessageType(kind.replace("/", "/msg/") if kind.count("/") == 1 else kind, text)


def _unsigned(form: Any) -> Any:
    """The form of a field with `byte` as ROS 2 has it, 0 to 255; the library takes it as signed."""
    kind, what = form
    if kind == _BASE:
        return (kind, ("uint8", what[1])) if what[0] == "byte" else form
    return form if kind == _NESTED else (kind, (_unsigned(what[0]), *what[1:]))


def _is_number(description: Any) -> bool:
    return bool(description[0] == _BASE and description[1][0] != "string")


class _TooManyError(Exception):
    """More objects than a message may become."""


class _Count:
    """Counts the strings and messages in the sequences of one message, without decoding it."""

    def __init__(self, types: Types, data: bytes) -> None:
        self._types, self._data = types, memoryview(data)[4:]
        self._length = _LENGTH["little" if data[1:2] == b"\x01" else "big"]
        self._count = 0

    def take(self, name: str, position: int) -> int:
        """Pass over a value of a type; where it ends. struct.error: beyond the message."""
        if position > len(self._data):
            raise struct.error
        for _, description in self._types[name][1]:
            position = self._member(description, position)
        return position if self._types[name][1] else position + 1

    def _member(self, description: Any, position: int) -> int:
        kind, content = description
        if kind == _BASE:
            if content[0] == "string":
                position = -(-position // 4) * 4
                return position + 4 + self._number(position)
            return self._numbers(content[0], 1, position)
        if kind == _NESTED:
            return self.take(content, position)
        count = content[1]
        if kind == _SEQUENCE:
            position = -(-position // 4) * 4
            count = self._number(position)
            position += 4
        if _is_number(content[0]):
            return self._numbers(content[0][1][0], count, position)
        self._count += count
        if self._count > limits.OBJECTS:
            raise _TooManyError
        for _ in range(count):
            position = self._member(content[0], position)
        return position

    def _numbers(self, name: str, count: int, position: int) -> int:
        size = _SIZES[name]
        return -(-position // size) * size + count * size if count else position

    def _number(self, position: int) -> int:
        return int(self._length.unpack_from(self._data, position)[0])


# --- objects --------------------------------------------------------------------------------------
_ENCAPSULATION = 4
"""Bytes before the fields of a message; the first two say that it is CDR, and its byte order."""
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
        if read is None:
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

"""Hostile messages: clouds, other CDR, and times."""

from __future__ import annotations

import functools
import struct
from collections.abc import Callable
from pathlib import Path

from support.hostile.base import (
    IMPACTS,
    content,
    enter_forged,
    entry,
    messages,
    other_data,
    put,
)
from support.mcap_bytes import Sent, forged

TOPICS = ("/diagnostics", "/disk/impacts", "/disk/inputs", "/disk/rotor_speed", "/joint_states",
          "/platform/motion")  # fmt: skip
NUMBERS = ("frame length", "height", "width", "fields", "field name length", "offset", "datatype",
           "count", "is_bigendian", "point_step", "row_step", "data length")  # fmt: skip
"""The numbers of a cloud by which its points are found."""


@functools.cache
def cloud() -> bytes:
    """The CDR of one message of disk/impacts."""
    return next(row.data for row in messages() if row.topic == IMPACTS)


def cloud_place(data: bytes, name: str) -> int:
    """Where one of the NUMBERS stands in the CDR of a cloud."""
    (frame,) = struct.unpack_from("<I", data, 12)
    height = 4 + -(-(12 + frame) // 4) * 4
    field = height + 12
    (length,) = struct.unpack_from("<I", data, field)
    offset = field + 4 + -(-length // 4) * 4
    rows, columns = struct.unpack_from("<II", data, height)
    points = (len(data) - 1 - 112 * rows * columns) // 4 * 4
    places = (12, height, height + 4, height + 8, field, offset, offset + 4, offset + 8,
              points - 16, points - 12, points - 8, points - 4)  # fmt: skip
    return places[NUMBERS.index(name)]


def with_number(data: bytes, name: str, value: int) -> bytes:
    """The CDR of a cloud with another number."""
    at = cloud_place(data, name)
    return data[:at] + struct.pack("<I", value) + data[at + 4 :]


def _enter_number(name: str, value: int) -> None:
    def rows() -> list[Sent]:
        return other_data(IMPACTS, lambda data: with_number(data, name, value))

    enter_forged(f"cloud: {name} {value}", {}, messages=rows)


for _name in NUMBERS:
    for _value in (0, 3, 0xFFFFFFFF):
        _enter_number(_name, _value)


def _enter_impact(field: str, offset: int, value: float) -> None:
    def change(data: bytes) -> bytes:
        at = cloud_place(data, "data length") + 4 + offset
        return data[:at] + struct.pack("<d", value) + data[at + 8 :]

    enter_forged(f"impact: {field} {value}", {}, messages=lambda: other_data(IMPACTS, change))


for _field, _offset in (("index", 16), ("time", 24), ("cycles", 32), ("forcing_phase", 40),
                        ("axial_impact_velocity", 48), ("angular_velocity", 96)):  # fmt: skip
    for _float in (float("nan"), float("inf"), -1.0, 1e300, 1e18):
        _enter_impact(_field, _offset, _float)


def _enter_data(topic: str, name: str, data: bytes) -> None:
    enter_forged(f"{topic}: {name}", {}, messages=lambda: other_data(topic, lambda _: data))


for _topic in TOPICS:
    for _name, _data in (
        ("nothing", b""), ("one byte", b"\0"), ("another encoding", b"\0\7\0\0abcd"),
        ("a length beyond", b"\0\1\0\0" + b"\xff" * 64), ("zeros", bytes(2000)),
        ("the other order", b"\0\0\0\0" + bytes(range(256))),
    ):  # fmt: skip
        _enter_data(_topic, _name, _data)


@entry("clouds of no points, thousands")
def _no_points(folder: Path) -> Path:
    empty = cloud()
    at = cloud_place(empty, "data length") + 4
    for name in ("width", "row_step", "data length"):
        empty = with_number(empty[:at] + bytes(len(cloud()) - at), name, 0)
    one = next(row for row in messages() if row.topic == IMPACTS)
    rows = [*messages(), *[one._replace(data=empty[:at] + b"\1")] * 3000]
    return put(folder, forged({}, content(messages=rows, per_chunk=10_000)))


def _enter_times(name: str, change: Callable[[int, Sent], Sent]) -> None:
    def rows() -> list[Sent]:
        return [change(place, row) for place, row in enumerate(messages())]

    enter_forged(f"times: {name}", {}, messages=rows)


_enter_times("all at once", lambda _, row: row._replace(log_time_ns=5, publish_time_ns=5))
_enter_times("backwards", lambda at, row: row._replace(log_time_ns=10**18 - at * 10**9))
_enter_times("the end of time", lambda _, row: row._replace(log_time_ns=2**63 - 1))
_enter_times("beyond", lambda _, row: row._replace(log_time_ns=2**63))
_enter_times("the largest", lambda _, row: row._replace(log_time_ns=2**64 - 1))
_enter_times("sent beyond", lambda _, row: row._replace(publish_time_ns=2**64 - 1))
_enter_times("never", lambda _, row: row._replace(log_time_ns=0, publish_time_ns=0))
_enter_times("from one end to the other",
             lambda at, row: row._replace(log_time_ns=(2**63 - 1) * (at % 2)))  # fmt: skip

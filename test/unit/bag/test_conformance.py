"""The 416 conformance files of the MCAP format: all in them is read, and none is called damaged."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import pytest
import zstandard
from mcap.opcode import Opcode

from bouncing_disk_ros import bag
from bouncing_disk_ros.bag.bag_topic import Form
from bouncing_disk_ros.bag.decode import decoder
from bouncing_disk_ros.bag.source import Source
from support.conformance import DATA, made, messages_of, variants

ALL = list(variants())


def name(variant: tuple[str, frozenset[str]]) -> str:
    data, features = variant
    return "-".join([data, *sorted(features)])


def not_yet(data: str, features: frozenset[str]) -> str:
    """Why a file is not read as it should be; '' where it is."""
    if data == "OneAttachment" and "pad" in features:
        return "the checksum of an attachment is looked for at its end"
    named = {"OneAttachment": "ax", "OneMetadata": "mdx"}.get(data, "")
    if named and "st" in features and named not in features:
        return "an index that names less than its statistics count is called damaged"
    types = {"rch"} if data == "OneSchemalessMessage" else {"rch", "rsh"}
    if "Message" not in data or features >= {"st", "chx", *types}:
        return ""
    if {"pad", "mx"} <= features:
        return "a message index that was extended is called damaged"
    return "an index without its definitions is called damaged" if {"st", "chx"} <= features else ""


def test_there_are_as_many_as_are_published() -> None:
    assert len(ALL) == len({name(variant) for variant in ALL}) == 416


def check(variant: tuple[str, frozenset[str]], file: Path) -> None:
    data, features = variant
    file.write_bytes(made(data, features))
    with bag.open(file) as run:
        found = [tuple(row) for row in run.messages()]
        expected = [("example", *row) for row in messages_of(data)]
        assert found == [tuple(row) for row in expected]
        attached = {"myFile": b"\x01\x02\x03"} if data == "OneAttachment" else {}
        assert run.attachments == attached
        assert not [remark for remark in run.remarks if "damage" in remark], run.remarks
    notes = [(row.name, row.metadata) for row in Source(file).metadata()]
    assert notes == ([("myMetadata", {"foo": "bar"})] if data == "OneMetadata" else [])


def is_read(variant: tuple[str, frozenset[str]], file: Path) -> bool:
    try:
        check(variant, file)
    except (AssertionError, bag.BagError):
        return False
    return True


@pytest.mark.parametrize("data", DATA)
def test_files_of_the_format_are_read(data: str, tmp_path: Path) -> None:
    """All but those that are known not to be, which are exactly these."""
    files = [variant for variant in ALL if variant[0] == data]
    missed = [name(one) for one in files if not is_read(one, tmp_path / f"{name(one)}.mcap")]
    assert missed == [name(one) for one in files if not_yet(*one)]


FIRST = {why: variant for variant in reversed(ALL) if (why := not_yet(*variant))}
"""One file for each reason."""


@pytest.mark.parametrize(
    "why", [pytest.param(why, marks=pytest.mark.xfail(reason=why, strict=True)) for why in FIRST]
)
def test_a_file_that_is_not_read_yet(why: str, tmp_path: Path) -> None:
    check(FIRST[why], tmp_path / "a.mcap")


# --- what writers of others do --------------------------------------------------------------------
def written(path: Path, inner: bytes, *, stored: bytes | None = None) -> Path:
    """A file of one chunk; `stored`: its compressed records."""
    file = bytearray(made("NoData", frozenset()))
    end = len(file) - 8 - 29 - 13  # magic, footer, end of the data
    records = inner if stored is None else stored
    compression = b"" if stored is None else b"\x04\0\0\0zstd"
    head = struct.pack("<QQQI", 1, 9, len(inner), zlib.crc32(inner))
    head += (compression or b"\0\0\0\0") + struct.pack("<Q", len(records))
    chunk = struct.pack("<BQ", Opcode.CHUNK, len(head) + len(records)) + head + records
    path.write_bytes(bytes(file[:end]) + chunk + bytes(file[end:]))
    return path


def records_of(times: list[int], kind: bytes = b"std_msgs/msg/String") -> bytes:
    """A schema, a channel and messages in the order of storage, numbered."""

    def record(opcode: Opcode, body: bytes) -> bytes:
        return struct.pack("<BQ", opcode, len(body)) + body

    def text(value: bytes) -> bytes:
        return struct.pack("<I", len(value)) + value

    definition = text(b"ros2msg") + text(b"string data\n")
    found = record(Opcode.SCHEMA, struct.pack("<H", 1) + text(kind) + definition)
    topic = text(b"/words") + text(b"cdr") + text(b"")
    found += record(Opcode.CHANNEL, struct.pack("<HH", 1, 1) + topic)
    for number, time in enumerate(times):
        data = b"\0\1\0\0" + struct.pack("<I", 2) + b"%d\0" % (number % 10)
        found += record(Opcode.MESSAGE, struct.pack("<HIQQ", 1, number, time, time) + data)
    return found


def test_equal_times_keep_the_order_of_storage(tmp_path: Path) -> None:
    times = [5, 1, 5, 5, 1, 9, 5]
    with bag.open(written(tmp_path / "a.mcap", records_of(times))) as run:
        found = [(row.log_time_ns, row.sequence) for row in run.messages()]
    assert found == [(1, 1), (1, 4), (5, 0), (5, 2), (5, 3), (5, 6), (9, 5)]


@pytest.mark.parametrize("cut", [100, None])
def test_frames_and_bytes_may_follow_the_first_frame(tmp_path: Path, cut: int | None) -> None:
    inner = records_of([1, 2, 3])
    pack = zstandard.ZstdCompressor().compress
    stored = pack(inner) + b"bytes" if cut is None else pack(inner[:cut]) + pack(inner[cut:])
    with bag.open(written(tmp_path / "a.mcap", inner, stored=stored)) as run:
        assert len(list(run.messages())) == 3


def test_a_type_may_be_named_in_two_parts(tmp_path: Path) -> None:
    inner = records_of([1], b"std_msgs/String")
    with bag.open(written(tmp_path / "a.mcap", inner)) as run:
        assert [row.data for _, row in run.decoded("/words")] == ["0"]


def test_a_byte_is_0_to_255() -> None:
    form = Form("diagnostic_msgs/msg/B", "byte level\n", "ros2msg", "cdr")
    assert decoder(form)(b"\0\1\0\0\xfe").level == 254

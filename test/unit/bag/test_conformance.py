"""The 416 conformance files of the MCAP format: all in them is read, and none is called damaged.

The writer of `mcap` makes them: six kinds of data times the features of the published conformance
suite (github.com/foxglove/mcap, tests/conformance). A feature is named as there.

| feature | the file has |
|---|---|
| ch, mx | chunks; message indexes behind them |
| st, chx, ax, mdx | statistics; indexes of chunks, attachments, metadata in its summary |
| rsh, rch | schemas and channels repeated in its summary |
| sum | offsets of the groups of its summary |
| pad | bytes behind the last field of each record that may grow, attachments excepted |
"""

from __future__ import annotations

import itertools
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from time import process_time
from typing import NamedTuple
from unittest.mock import patch

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.writer import CompressionType, IndexType, Writer

from bouncing_disk_ros import bag, limits
from bouncing_disk_ros.bag.messages import Form, decoder
from bouncing_disk_ros.bag.records import MAGIC
from bouncing_disk_ros.bag.source import Source

DATA = ("NoData", "OneAttachment", "OneMetadata", "OneMessage", "OneSchemalessMessage",
        "TenMessages")  # fmt: skip
FEATURES = ("ch", "mx", "st", "rsh", "rch", "ax", "mdx", "chx", "sum", "pad")
_NEEDS = {"ch": "Message", "mx": "Message", "chx": "Message", "rch": "Message",
          "ax": "Attachment", "mdx": "Metadata"}  # fmt: skip
_INDEXES = {"mx": IndexType.MESSAGE, "chx": IndexType.CHUNK, "ax": IndexType.ATTACHMENT,
            "mdx": IndexType.METADATA}  # fmt: skip
_NOT_PADDED = (Opcode.MESSAGE, Opcode.CHUNK, Opcode.DATA_END, Opcode.FOOTER)
"""Their last field takes all that is left, or their length is fixed."""


class Message(NamedTuple):
    """A message of the suite."""

    log_time: int
    publish_time: int
    sequence: int
    data: bytes


def messages_of(data: str) -> list[Message]:
    """The messages of a kind of data."""
    if data == "TenMessages":
        return [Message(i, i, i, bytes([i]) * i) for i in range(10)]
    return [Message(2, 1, 10, b"\x01\x02\x03")] if "Message" in data else []


def variants() -> Iterator[tuple[str, frozenset[str]]]:
    """Data and features of each file: those that the data can have, and that make a difference."""
    for data in DATA:
        for chosen in itertools.product((False, True), repeat=len(FEATURES)):
            features = frozenset(name for name, on in zip(FEATURES, chosen, strict=True) if on)
            if _is_variant(data, features):
                yield data, features


def _is_variant(data: str, features: frozenset[str]) -> bool:
    if any(name in features and needed not in data for name, needed in _NEEDS.items()):
        return False
    if "rsh" in features and data not in ("OneMessage", "TenMessages"):
        return False
    if features & {"mx", "chx"} and "ch" not in features:
        return False
    return "sum" not in features or bool(features & {"st", "rsh", "rch", "ax", "mdx", "chx"})


class _Padded(RecordBuilder):
    """Adds bytes behind the last field."""

    def start_record(self, opcode: Opcode) -> None:
        self._opcode = opcode
        super().start_record(opcode)

    def finish_record(self) -> None:
        if self._opcode not in _NOT_PADDED:
            self.write(b"\x01\xff\xff")
        super().finish_record()


def made(data: str, features: frozenset[str]) -> bytes:
    """The bytes of one file."""
    builder = _Padded if "pad" in features else RecordBuilder
    out, indexes = BytesIO(), IndexType.NONE
    for name in features & _INDEXES.keys():
        indexes |= _INDEXES[name]
    with (
        patch("mcap.writer.RecordBuilder", builder),
        patch("mcap._chunk_builder.RecordBuilder", builder),
    ):
        writer = Writer(
            out, compression=CompressionType.NONE, index_types=indexes,
            repeat_channels="rch" in features, repeat_schemas="rsh" in features,
            use_chunking="ch" in features, use_statistics="st" in features,
            use_summary_offsets="sum" in features,
        )  # fmt: skip
        writer.start("", "")
        _write(writer, data)
        writer.finish()
    return out.getvalue()


def _write(writer: Writer, data: str) -> None:
    """Write the content of a kind of data."""
    if data == "OneAttachment":
        writer.add_attachment(1, 2, "myFile", "application/octet-stream", b"\x01\x02\x03")
    if data == "OneMetadata":
        writer.add_metadata("myMetadata", {"foo": "bar"})
    if not messages_of(data):
        return
    schema = 0
    if data != "OneSchemalessMessage":
        schema = writer.register_schema("Example", "c", b"\x04\x05\x06")
    channel = writer.register_channel("example", "a", schema, {"foo": "bar"})
    for one in messages_of(data):
        writer.add_message(channel, one.log_time, one.data, one.publish_time, one.sequence)


ALL = list(variants())


def name(variant: tuple[str, frozenset[str]]) -> str:
    data, features = variant
    return "-".join([data, *sorted(features)])


def test_there_are_as_many_as_are_published() -> None:
    assert len(ALL) == len({name(variant) for variant in ALL}) == 416


def read(file: Path, content: bytes) -> tuple[list[tuple[object, ...]], dict[str, bytes]]:
    """The messages and attachments of a file, which is not called damaged."""
    file.write_bytes(content)
    with bag.open(file) as run:
        assert not [remark for remark in run.remarks if "damage" in remark], run.remarks
        return [tuple(row) for row in run.messages()], run.attachments


@pytest.mark.parametrize("data", DATA)
def test_files_of_the_format_are_read(data: str, tmp_path: Path) -> None:
    expected = [("example", *row) for row in messages_of(data)]
    attached = {"myFile": b"\x01\x02\x03"} if data == "OneAttachment" else {}
    noted = [("myMetadata", {"foo": "bar"})] if data == "OneMetadata" else []
    for variant in ALL:
        if variant[0] == data:
            file = tmp_path / f"{name(variant)}.mcap"
            assert read(file, made(*variant)) == (expected, attached), file.name
            assert [(row.name, row.metadata) for row in Source(file).metadata()] == noted


# --- what writers of others do --------------------------------------------------------------------
def record(opcode: Opcode, *parts: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(b"".join(parts))) + b"".join(parts)


def text(value: bytes) -> bytes:
    return struct.pack("<I", len(value)) + value


def filed(path: Path, *rows: bytes) -> Path:
    """A file without an index that has these records."""
    file = made("NoData", frozenset())
    end = len(file) - 8 - 29 - 13  # magic, footer, end of the data
    path.write_bytes(file[:end] + b"".join(rows) + file[end:])
    return path


def written(path: Path, inner: bytes, *, stored: bytes | None = None) -> Path:
    """A file of one chunk; `stored`: its compressed records."""
    head = struct.pack("<QQQI", 1, 9, len(inner), zlib.crc32(inner))
    head += text(b"" if stored is None else b"zstd")
    inner = inner if stored is None else stored
    return filed(path, record(Opcode.CHUNK, head, struct.pack("<Q", len(inner)), inner))


def records_of(times: list[int], kind: bytes = b"std_msgs/msg/String") -> bytes:
    """A schema, a channel and messages in the order of storage, numbered."""

    definition = text(b"ros2msg") + text(b"string data\n")
    found = record(Opcode.SCHEMA, struct.pack("<H", 1) + text(kind) + definition)
    topic = text(b"/words") + text(b"cdr") + text(b"")
    found += record(Opcode.CHANNEL, struct.pack("<HH", 1, 1) + topic)
    for number, time in enumerate(times):
        data = b"\0\1\0\0" + struct.pack("<I", 2) + b"%d\0" % (number % 10)
        found += record(Opcode.MESSAGE, struct.pack("<HIQQ", 1, number, time, time) + data)
    return found


@pytest.mark.parametrize("cut", [100, None])
def test_frames_and_bytes_may_follow_the_first_frame(tmp_path: Path, cut: int | None) -> None:
    inner = records_of([1, 2, 3])
    pack = zstandard.ZstdCompressor().compress
    stored = pack(inner) + b"bytes" if cut is None else pack(inner[:cut]) + pack(inner[cut:])
    with bag.open(written(tmp_path / "a.mcap", inner, stored=stored)) as run:
        assert len(list(run.messages())) == 3


def test_a_type_may_be_named_in_two_parts_and_equal_times_keep_the_order_of_storage(
    tmp_path: Path,
) -> None:
    inner = records_of([1], b"std_msgs/String")
    with bag.open(written(tmp_path / "a.mcap", inner)) as run:
        assert [row.data for _, row in run.decoded("/words")] == ["0"]
    times = [5, 1, 5, 5, 1, 9, 5]
    with bag.open(written(tmp_path / "a.mcap", records_of(times))) as run:
        found = [(row.log_time_ns, row.sequence) for row in run.messages()]
    assert found == [(1, 1), (1, 4), (5, 0), (5, 2), (5, 3), (5, 6), (9, 5)]


def test_topics_may_be_defined_between_messages_outside_of_chunks(tmp_path: Path) -> None:
    other = record(
        Opcode.CHANNEL, struct.pack("<HH", 2, 1) + text(b"/other") + text(b"cdr"), text(b"")
    )
    last = record(Opcode.MESSAGE, struct.pack("<HIQQ", 2, 0, 3, 3), b"\0\1\0\0")
    with bag.open(filed(tmp_path / "a.mcap", records_of([1, 2]), other, last)) as run:
        assert [(row.topic, row.log_time_ns) for row in run.messages()] == [
            ("/words", 1),
            ("/words", 2),
            ("/other", 3),
        ]


@pytest.mark.parametrize(
    "bad",
    [
        record(Opcode.MESSAGE, bytes(21)),
        record(Opcode.MESSAGE, struct.pack("<HIQQ", 1, 0, limits.TIME_NS + 1, 2)),
        record(Opcode.MESSAGE, struct.pack("<HIQQ", 1, 0, 2, limits.TIME_NS + 1)),
    ],
)
def test_a_damaged_message_outside_of_chunks_costs_no_other(tmp_path: Path, bad: bytes) -> None:
    definitions = records_of([])
    rows = [records_of([time]).removeprefix(definitions) for time in (1, 2, 3)]
    with bag.open(filed(tmp_path / "a.mcap", definitions, *rows[:2], bad, rows[2])) as run:
        assert "damaged: a message too short for its fields, or beyond" in "".join(run.remarks)
        assert [row.log_time_ns for row in run.messages()] == [1, 2, 3]
    (tmp_path / "b.mcap").write_bytes(MAGIC + b"".join([definitions, *rows])[:-1])
    with bag.open(tmp_path / "b.mcap") as run:
        assert "cut off" in "".join(run.remarks)
        assert [row.log_time_ns for row in run.messages()] == [1, 2]


def test_a_byte_is_0_to_255() -> None:
    form = Form("diagnostic_msgs/msg/B", "byte level\n", "ros2msg", "cdr")
    assert decoder(form)(b"\0\1\0\0\xfe").level == 254


def test_what_a_sequence_claims_beyond_its_message_is_not_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ten thousand values of eight thousand numbers each, in a message of 20 kB."""
    monkeypatch.setattr(limits, "OBJECTS", 10_000)
    numbers = "".join(f"uint8 a{n}\n" for n in range(2000))
    wide = "".join(f"B b{n}\n" for n in range(4))
    line = "=" * 80
    text = f"A[] a\n{line}\nMSG: a/A\n{wide}{line}\nMSG: a/B\n{numbers}"
    read = decoder(Form("a/msg/Wide", text, "ros2msg", "cdr"))
    began = process_time()
    with pytest.raises(bag.BagError, match="cannot be decoded"):
        read(b"\0\1\0\0" + struct.pack("<I", 10_000) + bytes(20_000))
    assert process_time() - began < 10.0


def padded_chunks() -> list[bytes]:
    """Two chunks from the time 0 on, each with an index that has bytes behind its entries."""
    whole = made("TenMessages", frozenset({"ch", "mx", "pad"}))
    begin, size = 8 + 9 + 8 + 3, struct.Struct("<BQ").size
    length = size + struct.unpack_from("<BQ", whole, begin)[1]
    index = size + struct.unpack_from("<BQ", whole, begin + length)[1]
    return [whole[begin : begin + length], whole[begin + length : begin + length + index]] * 2


def padded_attachment() -> list[bytes]:
    """Zeros, their checksum, and bytes behind it."""
    body = struct.pack("<QQ", 2, 1) + text(b"zeros") + text(b"a/b") + struct.pack("<Q", 64)
    body += bytes(64)
    return [record(Opcode.ATTACHMENT, body, struct.pack("<I", zlib.crc32(body)), b"more")]


@pytest.mark.parametrize("rows", [padded_chunks(), padded_attachment()])
def test_bytes_behind_the_fields_hide_no_damage(rows: list[bytes], tmp_path: Path) -> None:
    """A record that may be longer than its fields passes for nothing else, and is not cut short."""

    def read() -> tuple[object, ...]:
        with bag.open(file) as run:
            return [tuple(row) for row in run.messages()], run.attachments, len(run.remarks)

    file = filed(tmp_path / "a.mcap", *rows)
    whole, right = file.read_bytes(), read()
    begin = whole.rindex(rows[-2:][0])
    for place, bit in itertools.product(range(begin, begin + 9 + 40), range(8)):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << bit
        file.write_bytes(damaged)
        with suppress(bag.BagError):
            found = read()
            assert found == right or found[-1] != right[-1], (place, bit)

"""Cut, damaged and unfinished bags: what is whole is read, nothing is read wrong."""

from __future__ import annotations

import errno
import os
import random
import re
import resource
import shutil
import struct
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from mcap.opcode import Opcode
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import Reader

from bouncing_disk_ros import bag, limits, regular_file
from bouncing_disk_ros.bag import chunk_reader, metadata, walk
from bouncing_disk_ros.bag.messages import decoder, message_type
from bouncing_disk_ros.bag.schema import schema_of
from bouncing_disk_ros.bag.source import Source
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.regular_file import RegularFile, read_text
from bouncing_disk_ros.report import bag_recover
from reference.cases import examples
from support.bags import START_NS, TYPES, Sent, make, messages, read, write
from support.checks import refused
from support.hostile.base import IMPACTS, content, other_data
from support.hostile.base import messages as messages_of_a_run
from support.hostile.floods import flood
from support.hostile.messages import with_number
from support.mcap_bytes import MAGIC, Content, forged
from support.reading import read_all

CHUNK = 1500


@pytest.fixture(scope="module")
def sent() -> list[Sent]:
    return list(messages(120))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory, sent: list[Sent]) -> bytes:
    """A file without compression: nothing but our checksums sees its damage."""
    folder = tmp_path_factory.mktemp("bag") / "run"
    make(folder, sent, chunk_size=CHUNK, compression="none")
    return (folder / "run_0.mcap").read_bytes()


def put(folder: Path, content: bytes) -> Path:
    """A folder with one file of this content and no metadata.yaml."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    (folder / "run_0.mcap").write_bytes(content)
    return folder


def all_of(path: Path) -> tuple[list[Sent], dict[str, bytes], dict[str, str]]:
    with bag.open(path) as run:
        return list(run.messages()), run.attachments, run.notes


def rosbags_count(folder: Path) -> int:
    with Reader(folder) as reader:
        return sum(1 for _ in reader.messages())


def test_a_cut_file_gives_all_whole_chunks(tmp_path: Path, whole: bytes, sent: list[Sent]) -> None:
    counts = []
    for length in sorted(random.Random(1).sample(range(200, len(whole)), examples(25, 5000))):
        folder = put(tmp_path / "run", whole[:length])
        with bag.open(folder) as run:
            assert not run.complete
            found = list(run.messages())
        assert found == sent[: len(found)]
        counts.append(len(found))
        shutil.rmtree(tmp_path / "mended", ignore_errors=True)
        report = bag.recover(folder, tmp_path / "mended")
        assert report.saved == len(found)
        with bag.open(tmp_path / "mended") as run:
            assert run.complete
            assert list(run.messages()) == found
    assert rosbags_count(tmp_path / "mended") == counts[-1]
    assert counts == sorted(counts)
    assert counts[-1] > 100


def test_a_killed_writer_leaves_all_but_the_open_chunk(tmp_path: Path, sent: list[Sent]) -> None:
    writer = bag.Writer(tmp_path / "run", bag.Options(chunk_period=1e-9))
    write(writer, sent)
    shutil.copytree(tmp_path / "run", tmp_path / "killed")
    writer.close()
    assert read(tmp_path / "killed") == sent
    with bag.open(tmp_path / "killed") as run:
        assert set(run.topics) == set(TYPES)  # also the one without messages
        assert "metadata.yaml is missing" in run.remarks[0]
    report = bag.recover(tmp_path / "killed")
    assert (report.saved, report.lost, report.exact) == (len(sent), 0, True)
    assert rosbags_count(tmp_path / "killed_recovered") == len(sent)


@pytest.mark.parametrize("end", [None, -8], ids=["whole", "unfinished"])
def test_a_flipped_bit_is_never_read_wrong_and_costs_one_chunk(
    tmp_path: Path, whole: bytes, sent: list[Sent], end: int | None
) -> None:
    """All is read, or the damage is told: by a refusal, or by remarks where there is no index."""
    content = whole[:end]
    right = all_of(put(tmp_path / "run", content))
    dice, told, mended = random.Random(2), list[str](), tmp_path / "mended"
    for number in range(examples(30, 20_000)):
        place, bit = dice.randrange(len(content)), dice.randrange(8)
        damaged = bytearray(content)
        damaged[place] ^= 1 << bit
        folder = put(tmp_path / "run", bytes(damaged))
        try:
            found, attached, notes = all_of(folder)
            assert found == [row for row in sent if row in found], f"bit {bit} of byte {place}"
            assert attached.items() <= right[1].items()
            assert notes.items() <= right[2].items()
            if end is None:
                assert (found, attached, notes) == right, f"bit {bit} of byte {place}"
            elif found != sent:
                with bag.open(folder) as run:
                    told.append(next(remark for remark in run.remarks if "bytes" in remark))
        except (bag.BagError, InputError) as error:
            told.append(str(error))
        if number % 4 == 0:
            shutil.rmtree(mended, ignore_errors=True)
            report = bag.recover(folder, mended)
            found = read(mended)
            assert set(found) <= set(sent)
            assert report.saved == len(found)
            assert len(found) >= len(sent) - 30  # the messages of a chunk and some
            assert not report.exact or report.saved + report.lost == len(sent)
    assert len(told) > 3
    assert not any("\n" in line for line in told)


def test_no_other_record_becomes_a_message(tmp_path: Path, sent: list[Sent]) -> None:
    """One bit lies between the kinds of a message and of a message index, a channel, a header."""
    few = sent[:25]
    folder = make(tmp_path / "whole", few, chunk_size=CHUNK, compression="none")
    whole = (folder / "whole_0.mcap").read_bytes()
    places: dict[int, list[int]] = {}
    position = 8
    while whole[position] != Opcode.DATA_END:
        places.setdefault(whole[position], []).append(position)
        position += 9 + int.from_bytes(whole[position + 1 : position + 9], "little")
    assert places.keys() >= {Opcode.MESSAGE_INDEX, Opcode.CHANNEL, Opcode.CHUNK}
    for place in (at for found in places.values() for at in found[:1] + found[-1:]):
        for bit in range(8):
            damaged = bytearray(whole[:position])
            damaged[place] ^= 1 << bit
            assert read(put(tmp_path / "run", bytes(damaged))) == few, f"bit {bit} of byte {place}"


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        *((f"statistics.{kind}_count", lambda true: true + 1, "it has no complete index")
          for kind in ("chunk", "attachment", "metadata", "message")),
        ("footer.crc", 0, "its index has no checksum; read from beginning to end"),
    ],
)  # fmt: skip
def test_an_index_that_counts_other_records_or_has_no_checksum_is_not_taken(
    tmp_path: Path, field: str, value: Any, said: str
) -> None:
    indexed = short(summary=True)
    with bag.open(put(tmp_path / "whole", forged({}, indexed))) as run:
        expected = list(run.messages())
        assert "index" not in "".join(run.remarks)
    with bag.open(put(tmp_path / "forged", forged({field: value}, indexed))) as run:
        assert said in "".join(run.remarks)
        assert list(run.messages()) == expected


def told(path: Path) -> str:
    """Every refusal when all of a bag is read, and its remarks, a line each."""
    lines = read_all(path)
    with suppress(bag.BagError, InputError), bag.open(path) as run:
        lines += run.remarks
    return "\n".join(lines)


def short(**changes: Any) -> Content:
    """A few messages in three chunks, without an index."""
    return content(**{"messages": messages_of_a_run()[:12], "per_chunk": 5, "summary": False,
                      **changes})  # fmt: skip


def record(opcode: int, data: bytes) -> bytes:
    """The bytes of one record."""
    return struct.pack("<BQ", opcode, len(data)) + data


ANOTHER_CLOUD = (
    b"uint8[3] fields\nuint8 height\nuint8 width\nuint8 point_step\nuint8 row_step\n"
    b"bool is_bigendian\nuint8 data\n"
)


@pytest.mark.parametrize(
    ("forge", "said"),
    [
        ({"chunk.record_length": lambda true: true + 1}, "its lengths contradict each other"),
        ({"chunk.size": limits.CHUNK + 1}, f"at most {limits.CHUNK >> 20} MiB can be read"),
        ({"chunk.records": lambda data: data + bytes(5)}, "a record goes beyond the end"),
        ({"chunk.records": lambda data: data + record(Opcode.MESSAGE, bytes(21))},
         "a message is too short for its fields"),
        ({"chunk.records": lambda data: data if b"snapshot" in data
          else data.replace(b"inputs", b"outset")},
         "its definition of number 0 differs from an earlier one"),
        ({"message.opcode": Opcode.MESSAGE_INDEX}, "a record of kind 7 is not allowed in a chunk"),
        ({"message.log_time": limits.TIME_NS + 1}, "a message of a time beyond the year 2262"),
        ({"schema.id": 0}, "a message type with the number 0"),
        ({"schema.encoding": "ros2idl"}, "definition of .*: got 'ros2idl', allowed: ros2msg"),
        ({"schema.data": b"string data \xff\n"},
         "messages of std_msgs/msg/String cannot be decoded: its definition is not UTF-8"),
        ({"channel.schema_id": 0},
         "messages of unknown type cannot be decoded: its type is not in the bag"),
        ({"schema.data": b"wstring data\n"},
         "definition of std_msgs/msg/String: the type std_msgs/msg/wstring is not defined"),
        ({"schema.data": b"uint8[-5] data\n"}, "an array of length -5"),
        ({"schema.data": ANOTHER_CLOUD, "message.data": b"\0\1\0\0" + b"\1" * 20},
         "definition of sensor_msgs/msg/PointCloud2: got 'other fields in the bag'"),
        ({"channel.message_encoding": "ros1"}, "messages of .*: got 'ros1', allowed: cdr"),
        ({"channel.topic": "/disk/inputs"}, "it has messages of two forms"),
        ({"channel.topic": ""}, "a topic without a name"),
        ({"channel.topic": "/\x1b[31m"}, "a name with characters that cannot be shown"),
        ({"channel.topic": "x" * (limits.NAME + 1)}, rf"1025 bytes \(at most {limits.NAME}\)"),
        ({"attachment.name": b"\xff"}, "a text that is not UTF-8"),
        ({"metadata.opcode": Opcode.HEADER}, "a header in the middle of the file"),
        ({"message.data": b"\0\7\0\0abcd"}, "cannot be decoded: 00070000 is no CDR"),
    ],
)  # fmt: skip
def test_what_no_writer_writes_is_refused_or_told(
    tmp_path: Path, forge: dict[str, Any], said: str
) -> None:
    assert re.search(said, told(put(tmp_path / "run", forged(forge, short()))))


@pytest.mark.parametrize(
    ("forge", "said"),
    [
        ({"magic": b"\x89MCAP1\r\n"}, "the first bytes are not those of an .mcap file"),
        ({"end_magic": b"\x89MCAP1\r\n"}, "it has no index"),
        ({"attachment_index.name": b"\xff"}, "its index is damaged .'utf-8' codec"),
        ({"footer.crc": lambda true: true ^ 1}, "its index is damaged .its checksum is wrong"),
        ({"footer.summary_start": 1 << 62}, r"its index is damaged \(damaged: -\d+ bytes"),
        ({"chunk_index.offset": 8}, "it has no complete index"),
        ({"chunk_index.length": 8}, "damaged: -1 bytes at byte"),
        ({"chunk_index.uncompressed_size": 0}, "its size differs from that in the index"),
        ({"chunk_index.start_time": lambda true: true + 1}, "of other times than the index says"),
        ({"chunk_index.end_time": lambda true: true - 1}, "of other times than the index says"),
        ({"attachment_index.length": lambda true: true - 1}, "attachment at byte .*: damaged: "),
        ({"metadata_index.length": 1 << 62}, "metadata at byte .*: damaged: "),
        ({"metadata_index.offset": (1 << 64) - 1}, f"metadata at byte {(1 << 64) - 1}: damaged: "),
    ],
)
def test_an_index_that_is_not_true_is_told(
    tmp_path: Path, forge: dict[str, Any], said: str
) -> None:
    assert re.search(said, told(put(tmp_path / "run", forged(forge, short(summary=True)))))


@pytest.mark.parametrize(
    ("before", "opcode", "said"),
    [
        (b"", Opcode.CHUNK, "a chunk of 1001 bytes: at most 1000"),
        (b"", Opcode.MESSAGE, "a message of 1001 bytes (at most 1000)"),
        (record(Opcode.MESSAGE, bytes(22)), Opcode.MESSAGE, "a message of 1001 bytes"),
        (b"", Opcode.METADATA, "a record of more than 991 bytes"),
    ],
)
def test_a_record_of_more_bytes_than_is_allowed_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, before: bytes, opcode: int, said: str
) -> None:
    monkeypatch.setattr(walk, "_BLOCK", 1000)
    monkeypatch.setattr(chunk_reader, "MOST_CHUNK", 1000)
    monkeypatch.setattr(limits, "CHUNK", 1000)
    monkeypatch.setattr(limits, "RECORD", 1000 - 9)
    file = tmp_path / "run.mcap"
    for size in (1000, 1001):
        file.write_bytes(MAGIC + before + record(opcode, bytes(size - 9)))
        assert (said in told(file)) == (size > 1000)


ANOTHER_TYPE = record(Opcode.SCHEMA, struct.pack("<H", 99) + bytes(12))
LINE = "=" * 80
STRINGS = b"\0\1\0\0" + struct.pack("<I", 50) + bytes(400)


@pytest.mark.parametrize(
    ("limit", "most", "forge", "said"),
    [
        ("DEFINED", 10, {}, "too damaged: more than 9 definitions"),
        ("DEFINED", 11, {"chunk.records": lambda data: data + ANOTHER_TYPE},
         "damaged: more than 10 definitions"),
        ("RECORDS", 2, {}, "more than 1 attachments and metadata"),
        ("DAMAGES", 3, {"chunk.crc": 1}, "more than 2 places"),
        ("NOTE", 5, {}, "the note 'version' is too long"),
        ("DEFINITION", 50, {"schema.data": b"#" * 50}, "its definition of 50 bytes: at most 49"),
        ("FIELDS", 2, {"schema.data": b"string a\nstring b\n"}, "2 lines: at most 1"),
        ("DEPTH", 1, {"schema.data": f"a/A x\n{LINE}\nMSG: a/A\nint8 y\n".encode()},
         "more than 0 levels, or a type within itself"),
        ("ARRAY", 3, {"schema.data": b"string[3] three\n"}, "too many strings and messages"),
        ("OBJECTS", 50, {"schema.data": b"string[] many\n", "message.data": STRINGS},
         "with more than 49 strings and messages"),
        ("OBJECTS", 4, {"schema.data": b"int8 a\nint8 b\nint8 c\n"},
         "it would become too many strings and messages"),
        ("CLOUD_FIELDS", 16, {}, "at most 1048576 and 15"),
    ],
)  # fmt: skip
def test_more_of_a_thing_than_is_allowed_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, limit: str, most: int, forge: dict[str, Any],
    said: str,
) -> None:  # fmt: skip
    folder = put(tmp_path / "run", forged(forge, short()))
    for allowed in (most - 1, most):  # what is read once is not checked again
        monkeypatch.setattr(limits, limit, allowed)
        assert (said in told(folder)) == (allowed < most)


def number(name: str, value: int) -> Callable[[bytes], bytes]:
    """A change of one number of a cloud."""
    return lambda data: with_number(data, name, value)


def renamed(name: bytes) -> Callable[[bytes], bytes]:
    """A change of the field y of a cloud."""
    return lambda data: data.replace(b"\2\0\0\0y\0", b"\2\0\0\0" + name + b"\0")


@pytest.mark.parametrize(
    ("first", "change", "said"),
    [
        (0, number("point_step", 0), "a cloud of points of 0 bytes"),
        (0, number("point_step", (1 << 20) + 1), "a cloud of points of 1048577 bytes"),
        (0, number("datatype", 9), "'x', not within a point: type 9, 1 times from byte 0"),
        (0, number("count", 29), "'x', not within a point: type 7, 29 times from byte 0"),
        (0, renamed(b"x"), "a cloud whose fields have equal, empty or unprintable names"),
        (0, renamed(b"\0"), "a cloud whose fields have equal, empty or unprintable names"),
        (0, renamed(b"\1"), "a cloud whose fields have equal, empty or unprintable names"),
        (1, renamed(b"w"), "the clouds of this topic have different fields"),
        *((first, number(name, 3), "a cloud with gaps between its rows")
          for first in (0, 1) for name in ("height", "width", "row_step")),
    ],
)  # fmt: skip
def test_a_cloud_that_contradicts_itself_or_others_has_no_rows(
    tmp_path: Path, first: int, change: Callable[[bytes], bytes], said: str
) -> None:
    rows = other_data(IMPACTS, change, first)
    with (
        bag.open(put(tmp_path / "run", forged({}, content(messages=rows)))) as run,
        pytest.raises(bag.BagError, match=said),
    ):
        run.rows(IMPACTS)


def test_what_looks_like_a_chunk_and_is_none_is_not_tried_for_long(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "run.mcap"
    file.write_bytes(flood("chunks that claim all", 1 << 14))
    said = "too many places look like chunks"
    assert said not in told(file)
    monkeypatch.setattr(limits, "SEARCHED", 0)
    assert said in told(file)


def test_chunks_of_more_bytes_at_one_time_are_not_brought_into_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = [row._replace(log_time_ns=5) for row in messages_of_a_run()[:12]]
    folder = put(tmp_path / "run", forged({}, short(messages=rows)))
    size = sum(row.uncompressed_size for row in Source(folder / "run_0.mcap").index.chunks)
    for allowed in (size, size - 1):
        monkeypatch.setattr(limits, "OVERLAP", allowed)
        assert ("MiB overlap in time" in told(folder)) == (allowed < size)


@pytest.mark.parametrize(
    ("more", "said"), [(-1, "it holds more data than its header says"), (1, "the size is wrong")]
)
@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_of_another_size_than_it_says_is_refused(
    tmp_path: Path, compression: str, more: int, said: str
) -> None:
    """It has no checksum that would say so."""
    forge = {"chunk.size": lambda true: true + more, "chunk.crc": 0}
    assert said in told(put(tmp_path / "run", forged(forge, short(compression=compression))))


def test_recovery_says_what_was_lost(tmp_path: Path, whole: bytes) -> None:
    source = Source(put(tmp_path / "run", whole) / "run_0.mcap")
    place, damaged = source.index.chunks[3].chunk_start_offset + 100, bytearray(whole)
    damaged[place : place + 40] = bytes(40)
    folder = put(tmp_path / "run", bytes(damaged))
    with bag.open(folder) as run, pytest.raises(bag.BagError, match="bag_recover"):
        list(run.messages())
    report = bag.recover(folder)
    assert report.lost > 0
    (folder / "run_0.mcap").write_bytes(bytes(damaged[:-8]))
    with bag.open(folder) as run:
        (told,) = [line for line in run.remarks if ": the checksum is wrong: lost " in line]
    assert sum(int(count) for count in re.findall(r"(\d+) of /", told)) == report.lost
    assert any("run_0.mcap: bytes" in line for line in report.lines)
    assert f"{report.lost} lost" in report.summary
    with bag.open(report.output) as run:
        assert f"{report.lost} lost" in run.notes["recovered"]


@pytest.mark.parametrize("has_index", [True, False])
def test_recovery_names_attachments_and_notes_that_are_lost(
    tmp_path: Path, sent: list[Sent], has_index: bool
) -> None:
    """They have no messages, but they were written; metadata.yaml has the notes once more."""
    folder = make(tmp_path / "run", sent, chunk_size=CHUNK)
    file = folder / "run_0.mcap"
    notes = [row.offset for row in Source(file).index.metadata if row.name == "bouncing_disk_ros"]
    damaged = bytearray(file.read_bytes())
    damaged[damaged.index(b"friction: 0.6")] ^= 1
    for note in notes:
        damaged[damaged.index(b"1", note + 40)] ^= 1
    file.write_bytes(bytes(damaged if has_index else damaged[:-20]))
    report = bag.recover(folder)
    assert report.lost == 0
    assert "no message that was written is lost; lost: " in report.summary
    assert set(report.lost_records) == {"attachment parameters.yaml", "note bouncing_disk_ros"}
    assert any("lost attachment parameters.yaml" in line for line in report.lines)
    assert "notes are those of metadata.yaml, where the files lack them" in report.lines
    with bag.open(report.output) as run:
        assert run.attachments == {}
        assert run.notes["version"] == "1.2.3"


def test_the_command_recovers(
    tmp_path: Path, whole: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = put(tmp_path / "run", whole[: len(whole) // 2])
    assert bag_recover.main([str(folder)]) == 0
    assert "messages saved" in capsys.readouterr().out
    assert bag_recover.main([str(folder)]) == 2  # the output is there already
    assert "a new folder" in capsys.readouterr().err
    assert bag_recover.main([str(tmp_path / "nothing")]) == 2
    (tmp_path / "junk.mcap").write_bytes(b"no bag at all" * 100)
    assert bag_recover.main([str(tmp_path / "junk.mcap")]) == 2
    assert "junk.mcap: not an .mcap file" in capsys.readouterr().err
    (tmp_path / "byte.mcap").write_bytes(b"\x89")
    assert bag_recover.main([str(tmp_path / "byte.mcap")]) == 2
    assert "byte.mcap: not an .mcap file" in capsys.readouterr().err
    (tmp_path / "none.mcap").touch()
    assert bag_recover.main([str(tmp_path / "none.mcap")]) == 2
    assert bag_recover.main([str(folder), "a\0b"]) == 2
    assert "output: got 'a\\x00b', allowed: the name of a new folder" in capsys.readouterr().err
    assert {path.name for path in tmp_path.glob("*_recovered")} == {"run_recovered"}


def fill(tmp_path: Path, limit: int) -> tuple[Path, list[Sent], int]:
    """Write a bag to a disk that takes no file above `limit`; folder, what was sent, what lost."""
    folder, sent = tmp_path / "run", list(messages(1000))
    writer = bag.Writer(folder, bag.Options(chunk_size=2000, compression="none"))
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))  # Python ignores SIGXFSZ
    try:
        with pytest.raises(bag.WriteError, match="recording ended: File too large"):  # noqa: PT012
            write(writer, sent)
            writer.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    return folder, sent, writer.lost_on_disk.total()


@pytest.mark.parametrize("limit", [170_000, 201_111, 252_345])
def test_a_full_disk_ends_in_a_whole_bag(tmp_path: Path, limit: int) -> None:
    folder, sent, lost = fill(tmp_path, limit)
    with bag.open(folder) as run:
        assert run.complete
        found = list(run.messages())
        assert run.notes["ended"] == "the disk took no more"
    assert found == sent[: len(found)]
    assert len(found) > 100
    assert 0 < lost <= len(sent) - len(found)
    assert rosbags_count(folder) == len(found)


@pytest.mark.parametrize("limit", [32_000, 36_000])
def test_a_disk_too_full_for_the_index_leaves_all_whole_chunks(tmp_path: Path, limit: int) -> None:
    folder, sent, _ = fill(tmp_path, limit)
    found = read(folder)
    assert found == sent[: len(found)]
    assert len(found) > 3
    report = bag.recover(folder)
    assert (report.saved, rosbags_count(report.output)) == (len(found), len(found))


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    refused(r"output: got .*Not a directory", bag.Writer, tmp_path / "file" / "run")
    bag.Writer(tmp_path / "run").close()
    refused("File exists", bag.Writer, tmp_path / "run")
    refused("compression: got 'rar', allowed: zstd, lz4, none", bag.Options, compression="rar")


def foreign(path: Path, sent: list[Sent], **options: object) -> Path:
    """A file as other programs write it, with mcap's own writer."""
    with path.open("wb") as stream:
        writer = McapWriter(stream, compression=CompressionType.ZSTD, **options)  # type: ignore[arg-type, unused-ignore]
        writer.start("ros2")
        channels = {}
        for topic, kind in TYPES.items():
            text = schema_of(kind).text.encode()
            schema = writer.register_schema(kind, "ros2msg", text)
            channels[topic] = writer.register_channel(topic, "cdr", schema)
        for row in sent:
            writer.add_message(channels[row.topic], row.log_time_ns, row.data, row.publish_time_ns,
                               row.sequence)  # fmt: skip
        writer.finish()
    return path


@pytest.mark.parametrize("chunked", [True, False])
def test_files_of_other_writers_are_read_and_mended(
    tmp_path: Path, sent: list[Sent], chunked: bool
) -> None:
    path = foreign(tmp_path / "other.mcap", sent, use_chunking=chunked)
    assert all_of(path) == (sent, {}, {})
    path.write_bytes(path.read_bytes()[: -400 if chunked else -2000])
    report = bag.recover(path)
    assert read(report.output) == sent[: report.saved]
    assert report.saved > (0 if chunked else 50) or chunked


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("relative_file_paths: [../a.mcap]", "got '../a.mcap', allowed: names of files within"),
        ("relative_file_paths: [/a.mcap]", "got '/a.mcap', allowed: names of files within the bag"),
        ("relative_file_paths: [], compression_mode: MESSAGE",
         "got 'compression mode MESSAGE', allowed: mcap .*ros2 bag convert"),
    ],
)  # fmt: skip
def test_metadata_yaml_of_what_is_not_read_is_refused(tmp_path: Path, text: str, said: str) -> None:
    head = "rosbag2_bagfile_information: {storage_identifier: mcap, "
    (tmp_path / "metadata.yaml").write_text(f"{head}{text}}}")
    refused(said, bag.open, tmp_path)


def test_a_file_that_becomes_shorter_while_it_is_read_is_told(
    tmp_path: Path, sent: list[Sent]
) -> None:
    file = foreign(tmp_path / "run.mcap", sent, use_chunking=False)
    size = file.stat().st_size - 100
    os.truncate(file, size)  # it has no index

    with pytest.raises(bag.BagError, match=r"run\.mcap: it has become shorter while it was read"):
        bag.open(file, lambda _, __: os.truncate(file, size // 2))


@pytest.mark.parametrize("summary", [True, False])
def test_a_disk_that_cannot_be_read_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, summary: bool
) -> None:
    def fails(_: RegularFile, __: int = -1) -> bytes:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    folder = put(tmp_path / "run", forged({}, short(summary=summary)))
    (folder / "metadata.yaml").symlink_to("/proc/self/mem")  # its first byte cannot be read
    assert "metadata.yaml cannot be used" in told(folder)
    refused("Input/output error", read_text, "preset", folder / "metadata.yaml", 10)
    with bag.open(folder) as run:
        monkeypatch.setattr(RegularFile, "read", fails)
        with pytest.raises(bag.BagError, match=r"run_0\.mcap cannot be read: Input/output error"):
            list(run.messages())
    with pytest.raises(bag.BagError, match=r"run_0\.mcap cannot be read: Input/output error"):
        bag.recover(folder)


def test_a_file_that_is_exchanged_before_it_is_opened_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.mkfifo(tmp_path / "preset.yaml")
    monkeypatch.setattr(regular_file, "irregular", lambda _: "")  # as it was before
    allowed = r"preset: got .*preset\.yaml', allowed: a regular file that can be read"
    refused(allowed, read_text, "preset", tmp_path / "preset.yaml", 10)


def test_more_files_than_are_allowed_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in range(2):
        shutil.copy(put(tmp_path / "one", forged({}, short())) / "run_0.mcap", tmp_path)
        (tmp_path / "run_0.mcap").rename(tmp_path / f"{number}.mcap")
    monkeypatch.setattr(limits, "FILES", 2)
    bag.open(tmp_path)
    monkeypatch.setattr(limits, "FILES", 1)
    refused("of 2 files', allowed: at most 1", bag.open, tmp_path)
    named = "  relative_file_paths: [run_0.mcap, run_1.mcap]\n  storage_identifier: mcap\n"
    (tmp_path / "one" / "metadata.yaml").write_text(f"rosbag2_bagfile_information:\n{named}")
    refused("got '2 files', allowed: at most 1", bag.open, tmp_path / "one")


def test_what_is_no_bag_of_ours_is_refused_with_what_to_do(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()

    refused("There is no file or folder of that name", bag.open, folder / "nothing")
    refused("one .mcap file. File name too long.", bag.open, folder / ("x" * 300))
    allowed = r"allowed: a rosbag2 bag in MCAP \(its folder\), or one .mcap file"
    refused(rf"^bag: got \S*, {allowed}\. It holds no .mcap file\.$", bag.open, folder)
    (tmp_path / "other" / "a.mcap").mkdir(parents=True)
    refused("one .mcap file. a.mcap is a folder.", bag.open, tmp_path / "other")
    (folder / "bag_0.db3").write_bytes(b"SQLite")
    refused(r"got 'bag_0.db3'.*ros2 bag convert -i .*bag -o out.yaml", bag.open, folder)
    (folder / "metadata.yaml").write_text(
        "rosbag2_bagfile_information: {storage_identifier: sqlite3, relative_file_paths: [a.db3]}"
    )
    refused("bag storage: got 'sqlite3', allowed: mcap", bag.open, folder)
    (folder / "run.bag").write_bytes(b"#ROSBAG V2.0")
    refused("rosbags-convert", bag.open, folder / "run.bag")
    refused("a readable .mcap file", bag.open, put(tmp_path / "empty", b""))
    with bag.Writer(tmp_path / "run", notes={"format": "99"}) as writer:
        writer.add_topic("/a", "std_msgs/msg/String")
        writer.write("/a", b"\0\1\0\0\2\0\0\0a\0", START_NS)
    refused(r"bag format: got 99, allowed: 1 to 1.*update", bag.open, tmp_path / "run")


def test_what_metadata_yaml_has_in_another_form_is_not_used(tmp_path: Path) -> None:
    folder = put(tmp_path / "run", forged({}, short()))
    head = "rosbag2_bagfile_information: {storage_identifier: mcap, relative_file_paths: "
    others = ("5", "rosbag2_bagfile_information: 5", "rosbag2_bagfile_information: {}",
              head + "run_0.mcap}", head + "[run_0.mcap], custom_data: [5]}")  # fmt: skip
    for text in others:
        (folder / "metadata.yaml").write_text(text)
        assert "metadata.yaml cannot be used" in told(folder), text
    notes = 'custom_data: {bouncing_disk_ros.version: "\\e[31m"}'
    (folder / "metadata.yaml").write_text(f"{head}[run_0.mcap], {notes}}}")
    assert bag.recover(folder).saved == 12


def test_metadata_yaml_that_cannot_be_written_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").mkdir()
    with pytest.raises(OSError, match="directory"):
        metadata.write(tmp_path, metadata.Metadata([], []))
    assert [path.name for path in tmp_path.iterdir()] == ["metadata.yaml"]


def test_a_file_that_metadata_yaml_does_not_name_is_read_and_told(
    tmp_path: Path, sent: list[Sent]
) -> None:
    folder = make(tmp_path / "run", sent[:50])
    more = make(tmp_path / "more", sent[50:])
    shutil.copy(more / "more_0.mcap", folder / "run_1.mcap")
    with bag.open(folder) as run:
        assert len(list(run.messages())) == len(sent)
        assert "run_1.mcap: metadata.yaml does not name it" in run.remarks[0]
    (folder / "run_0.mcap").unlink()
    with bag.open(folder) as run:
        assert "run_0.mcap is missing" in run.remarks


@pytest.mark.parametrize("content", [b"", b"\x89MCAP"])
def test_a_last_file_without_content_is_told(
    tmp_path: Path, sent: list[Sent], content: bytes
) -> None:
    folder = make(tmp_path / "run", sent)
    (folder / "metadata.yaml").unlink()  # killed when it began a new file
    (folder / "run_1.mcap").write_bytes(content)
    with bag.open(folder) as run:
        assert len(list(run.messages())) == len(sent)
        assert "run_1.mcap is empty" in run.remarks
    assert bag.recover(folder).saved == len(sent)


def test_a_file_of_which_only_the_beginning_is_there_is_mended(tmp_path: Path) -> None:
    report = bag.recover(put(tmp_path / "run", b"\x89MCAP0\r\n"))
    assert report.saved == rosbags_count(report.output) == 0


def test_what_is_told_of_a_bag_is_one_line_that_can_be_shown(tmp_path: Path, whole: bytes) -> None:
    """The name of a file comes from whoever made the bag."""
    assert str(bag.BagError("a\nb \x1b[31m")) == "a b ?[31m"
    folder = put(tmp_path / "run", whole[:-8])
    (folder / "run_0.mcap").rename(folder / "a\nb \x1b[31m.mcap")
    lines = [*told(folder).splitlines(), *bag.recover(folder).lines]
    assert any("a b ?[31m.mcap: " in line for line in lines)
    assert all(line.isprintable() for line in lines)


def test_without_rosbags_a_bag_is_read_and_decoding_it_says_what_to_install(
    tmp_path: Path, whole: bytes, sent: list[Sent], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    decoder.cache_clear()
    message_type.cache_clear()
    with bag.open(put(tmp_path / "run", whole)) as run:
        assert list(run.messages()) == sent
        with pytest.raises(bag.BagError, match="pip install rosbags"):
            run.columns("/joint_states")


def test_another_file_behind_the_end_is_told(
    tmp_path: Path, whole: bytes, sent: list[Sent]
) -> None:
    """Of two files joined by `cat` the second was left out, and nothing was said to be lost."""
    file = tmp_path / "run.mcap"
    file.write_bytes(2 * whole)
    said = f"bytes {len(whole)} to {2 * len(whole)}: another file begins here, which is not read"
    with bag.open(file) as run:
        assert said in run.remarks[-1]
        assert list(run.messages()) == sent
    report = bag.recover(file)
    assert (report.saved, report.exact) == (len(sent), False)
    assert said in report.lines[-1]


def test_recovery_puts_the_times_of_chunks_right(tmp_path: Path, sent: list[Sent]) -> None:
    """They have no checksum; copied as they were, they made a new index that was not true."""
    folder = make(tmp_path / "run", sent, chunk_size=CHUNK)
    (file,) = folder.glob("*.mcap")
    content = bytearray(file.read_bytes())
    for place in (row.chunk_start_offset for row in Source(file).index.chunks):
        content[place + 9 : place + 25] = bytes(8) + (1 << 62).to_bytes(8, "little")
    report = bag.recover(put(tmp_path / "run", bytes(content[:-8])), tmp_path / "mended")
    assert (report.saved, report.lost) == (len(sent), 0)
    with bag.open(tmp_path / "mended") as run:
        assert run.complete
        assert (run.start_ns, run.end_ns) == (sent[0].log_time_ns, sent[-1].log_time_ns)
        assert list(run.messages()) == sent


def test_a_chunk_that_contradicts_itself_is_lost_and_told(tmp_path: Path) -> None:
    """Two types of one number: whichever came last was taken, and the copy could not be read."""
    whole = content(messages=messages_of_a_run()[:12], per_chunk=100)
    file = tmp_path / "run.mcap"
    file.write_bytes(forged({"schema.id": 7}, whole)[:-8])
    with bag.open(file) as run:
        assert any("definition of number 7 differs from an earlier" in line for line in run.remarks)
        assert list(run.messages()) == []
    report = bag.recover(file, tmp_path / "mended")
    assert report.saved == 0
    assert read(tmp_path / "mended") == []


def test_messages_whose_definitions_are_lost_are_counted_and_told(
    tmp_path: Path, sent: list[Sent]
) -> None:
    """Other writers define topics in the first chunk only; without it no later one can be read."""
    file = foreign(tmp_path / "run.mcap", sent, chunk_size=1, repeat_channels=False)
    whole, first = file.read_bytes(), Source(file).index.chunks[0]
    begin, end = first.chunk_start_offset, first.chunk_start_offset + first.chunk_length
    file.write_bytes(whole[:begin] + whole[end:-8])
    report = bag.recover(file, tmp_path / "mended")
    assert (report.saved, report.lost) == (0, len(sent) - 1)
    told = [line for line in report.lines if "the definition of its topics is lost" in line]
    assert len(told) == len(sent) - 1

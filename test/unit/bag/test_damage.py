"""Cut, damaged and unfinished bags: what is whole is read, nothing is read wrong."""

from __future__ import annotations

import random
import re
import resource
import shutil
from pathlib import Path
from typing import Any

import pytest
from mcap.opcode import Opcode
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import Reader

from bouncing_disk_ros import bag, limits
from bouncing_disk_ros.bag.schema import schema_of
from bouncing_disk_ros.bag.source import Source
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.report import bag_recover
from reference.cases import examples
from support.bags import START_NS, TYPES, Sent, make, messages, read, write
from support.checks import refused
from support.hostile.base import content
from support.hostile.base import messages as messages_of_a_run
from support.mcap_bytes import forged

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
    short = content(messages=messages_of_a_run()[:12], per_chunk=5)
    with bag.open(put(tmp_path / "whole", forged({}, short))) as run:
        expected = list(run.messages())
        assert "index" not in "".join(run.remarks)
    with bag.open(put(tmp_path / "forged", forged({field: value}, short))) as run:
        assert said in "".join(run.remarks)
        assert list(run.messages()) == expected


@pytest.mark.parametrize(
    ("compression", "size", "said"),
    [
        ("zstd", limits.CHUNK + 1, f"at most {limits.CHUNK >> 20} MiB can be read"),
        *((name, lambda true: true - 1, "more data than its header says|lengths contradict each")
          for name in ("zstd", "lz4")),
    ],
)  # fmt: skip
def test_a_chunk_beyond_the_limit_or_of_more_than_it_says_is_not_taken(
    tmp_path: Path, compression: str, size: Any, said: str
) -> None:
    short = content(messages=messages_of_a_run()[:12], compression=compression, summary=False)
    with bag.open(put(tmp_path / "run", forged({"chunk.size": size}, short))) as run:
        assert re.search(said, "".join(run.remarks))


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
    assert "not an .mcap file" in capsys.readouterr().err


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


def test_what_is_no_bag_of_ours_is_refused_with_what_to_do(tmp_path: Path) -> None:
    folder = tmp_path / "bag"
    folder.mkdir()

    refused("There is no file or folder of that name", bag.open, folder / "nothing")
    refused("one .mcap file. File name too long.", bag.open, folder / ("x" * 300))
    refused("It holds no .mcap file", bag.open, folder)
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


def test_an_error_of_a_bag_is_one_line_that_can_be_shown() -> None:
    assert str(bag.BagError("a\nb \x1b[31m")) == "a b ?[31m"


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

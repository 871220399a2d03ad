"""Latched messages are repeated where a new file begins, and are counted once."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from rosbags.rosbag2 import Reader

from bouncing_disk_ros import bag
from bouncing_disk_ros.bag.writer import Latched
from support.bags import QOS, START_NS, TYPES, Sent, messages, read, write

KEPT = {"/disk/phase": 2, "/numbers": 1}
FILES = 4


@pytest.fixture
def sent() -> list[Sent]:
    return list(messages(80))


@pytest.fixture
def folder(tmp_path: Path, sent: list[Sent]) -> Path:
    """A bag of four files with as many messages each."""
    with bag.Writer(tmp_path / "run") as writer:
        write(writer, [])
        for topic, depth in KEPT.items():
            writer.repeat(topic, depth)
        for place, row in enumerate(sent):
            if place and place % (len(sent) // FILES) == 0:
                writer.split()
            writer.write(row.topic, row.data, *row[1:4])
    return tmp_path / "run"


def last(sent: list[Sent], topic: str, count: int) -> list[tuple[bytes, int, int]]:
    """Content, time of sending and number of the last messages of a topic."""
    return [(row.data, *row[2:4]) for row in sent if row.topic == topic][-count:]


def test_the_whole_bag_has_every_message_once_and_the_first_file_gives_its_repeats(
    folder: Path, sent: list[Sent]
) -> None:
    with bag.open(folder) as run:
        assert list(run.messages()) == sent
        assert run.message_count == len(sent)
        assert run.topics["/disk/phase"].count == len(sent) // 5
        assert len(run.columns("/disk/phase")["data"]) == len(sent) // 5
        assert run.complete
    (folder / "run_0.mcap").unlink()
    with bag.open(folder) as run:
        assert run.message_count == len(sent) * 3 // FILES + sum(KEPT.values())
        assert len(list(run.messages())) == run.message_count
        assert run.remarks == ["run_0.mcap is missing"]


@pytest.mark.parametrize("number", range(1, FILES))
def test_each_file_alone_begins_with_what_is_latched(
    folder: Path, sent: list[Sent], number: int
) -> None:
    first = number * len(sent) // FILES
    with bag.open(folder / f"run_{number}.mcap") as run:
        found = list(run.messages())
        assert run.topics["/disk/phase"].qos == [QOS.as_dict()]
        assert run.message_count == len(found)
    repeats, own = found[: sum(KEPT.values())], found[sum(KEPT.values()) :]
    assert own == sent[first : first + len(sent) // FILES]
    assert {row.log_time_ns for row in repeats} == {own[0].log_time_ns}
    for topic, count in KEPT.items():
        of_topic = [(r.data, r.publish_time_ns, r.sequence) for r in repeats if r.topic == topic]
        assert of_topic == last(sent[:first], topic, count)


def test_other_tools_see_each_message_once_and_files_alone(folder: Path, sent: list[Sent]) -> None:
    with Reader(folder) as reader:
        found = [(c.topic, time, bytes(data)) for c, time, data in reader.messages()]
        assert reader.message_count == len(sent)
    assert found == [(row.topic, row.log_time_ns, row.data) for row in sent]
    with Reader(folder / "run_2.mcap") as reader:
        alone = [c.topic for c, _, _ in reader.messages()]
    assert len(alone) == len(sent) // FILES + sum(KEPT.values())
    with (folder / "run_2.mcap").open("rb") as stream:
        topics = [channel.topic for _, channel, _ in make_reader(stream, True).iter_messages()]
    assert sorted(topics) == sorted(alone)
    content = yaml.safe_load((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert content["message_count"] == len(sent)
    assert [row["message_count"] for row in content["files"]] == [len(sent) // FILES] * FILES
    names = [row["topic_metadata"]["name"] for row in content["topics_with_message_count"]]
    assert sorted(names) == sorted(TYPES)


@pytest.mark.parametrize("first", [0, 1])
def test_recovery_keeps_repeats_apart(folder: Path, sent: list[Sent], first: int) -> None:
    (folder / "metadata.yaml").unlink()
    for number in range(first):
        (folder / f"run_{number}.mcap").unlink()
    before = read(folder)
    report = bag.recover(folder)
    assert (report.saved, report.lost, report.exact) == (len(before), 0, True)
    assert read(report.output) == before
    with bag.open(report.output) as run:
        assert run.message_count == len(before)
    with Reader(report.output) as reader:
        assert reader.message_count == len(before)


def test_a_cut_file_is_recovered_with_its_repeats_apart(folder: Path, sent: list[Sent]) -> None:
    (folder / "metadata.yaml").unlink()
    file = folder / f"run_{FILES - 1}.mcap"
    file.write_bytes(file.read_bytes()[:-100])
    report = bag.recover(folder)
    assert report.saved == len(sent)
    assert read(report.output) == sent


def test_a_full_message_makes_those_before_it_unnecessary() -> None:
    latched = Latched(10, lambda data: data.startswith(b"full"))
    for data in (b"a", b"b", b"full 1", b"c", b"full 2", b"d", b"e"):
        latched.take(data, 0, 0)
    assert [row.data for row in latched.messages] == [b"full 2", b"d", b"e"]
    latched.deepen(2)
    assert [row.data for row in latched.messages] == [b"d", b"e"]


def test_an_empty_file_repeats_nothing(tmp_path: Path, sent: list[Sent]) -> None:
    with bag.Writer(tmp_path / "run") as writer:
        writer.add_topic("/disk/phase", TYPES["/disk/phase"], [QOS])
        writer.repeat("/disk/phase", 1)
        writer.write("/disk/phase", sent[3].data, START_NS)
        writer.split()
        writer.split()
        writer.write("/disk/phase", sent[8].data, START_NS + 1)
    assert read(tmp_path / "run" / "run_1.mcap") == []
    found = read(tmp_path / "run" / "run_2.mcap")
    assert [row.data for row in found] == [sent[3].data, sent[8].data]

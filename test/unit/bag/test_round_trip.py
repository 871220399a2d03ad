"""What was written is read again: by our reader, by rosbags and by mcap-ros2-support."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, cast

import numpy as np
import psutil
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import JointState, PointCloud2

from bouncing_disk_ros import bag
from bouncing_disk_ros.bag import schema
from bouncing_disk_ros.bag.messages import message_type
from bouncing_disk_ros.bag.metadata import FileRow, Metadata, qos_from_text
from bouncing_disk_ros.bag.schema import schema_of
from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.errors import InputError
from bouncing_disk_ros.ros.from_messages import impacts_from_msg
from support.bags import (
    QOS,
    START_NS,
    STEP_NS,
    TYPES,
    Sent,
    impact_rows,
    make,
    message,
    messages,
    read,
    write,
)
from support.checks import refused

WAYS: list[dict[str, Any]] = [
    {},
    {"compression": "lz4", "chunk_size": 5000, "max_duration": 0.03},
    {"compression": "none", "chunk_size": 1, "max_size": 60_000},
]


@pytest.fixture(scope="module")
def sent() -> list[Sent]:
    return list(messages(100))


def test_an_array_of_bytes_that_its_caller_uses_again_is_written_as_it_was(tmp_path: Path) -> None:
    folder, used = tmp_path / "run", bytearray()
    sent = list(messages(10))
    with bag.Writer(folder, bag.Options()) as writer:
        write(writer, [])
        for one in sent:
            used[:] = one.data
            writer.write(one.topic, cast("bytes", used), *one[1:4])
        used[:] = bytes(len(used))
    assert read(folder) == sent


@pytest.fixture(params=WAYS, ids=str, scope="module")
def folder(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, sent: list[Sent]
) -> Path:
    return make(tmp_path_factory.mktemp("bags") / "run", sent, **request.param)


def test_our_reader_gives_every_message_again(folder: Path, sent: list[Sent]) -> None:
    assert read(folder) == sent
    with bag.open(folder) as run:
        assert run.complete
        assert run.message_count == len(sent)
        assert (run.start_ns, run.end_ns) == (sent[0].log_time_ns, sent[-1].log_time_ns)
        assert {name: topic.type for name, topic in run.topics.items()} == TYPES
        assert run.topics["/diagnostics"].count == 0
        assert run.topics["/disk/phase"].qos == [QOS.as_dict()]
        assert run.notes == {"format": "1", "version": "1.2.3"}
        assert run.attachments == {"parameters.yaml": b"friction: 0.6\n"}


def test_rosbags_gives_every_message_again(folder: Path, sent: list[Sent]) -> None:
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(folder) as reader:
        found = [(c.topic, time, bytes(data)) for c, time, data in reader.messages()]
        for connection, _, data in reader.messages():
            store.deserialize_cdr(data, connection.msgtype)
        digests = {row.topic: row.digest for row in reader.connections}
        assert {row.topic: row.msgtype for row in reader.connections} == TYPES
    assert found == [(row.topic, row.log_time_ns, row.data) for row in sent]
    assert digests == {topic: schema_of(kind).type_hash for topic, kind in TYPES.items()}


def test_mcap_ros2_support_gives_every_message_again(folder: Path, sent: list[Sent]) -> None:
    found = []
    for file in sorted(folder.glob("*.mcap"), key=lambda path: int(path.stem.split("_")[-1])):
        with file.open("rb") as stream:
            reader = make_reader(stream, True, [DecoderFactory()])
            found += list(reader.iter_decoded_messages())
    assert [(c.topic, m.log_time, m.sequence, m.data) for _, c, m, _ in found] == [
        (row.topic, row.log_time_ns, row.sequence, row.data) for row in sent
    ]
    texts = [content.data for _, c, _, content in found if c.topic == "/disk/phase"]
    assert texts == [f"flight ü {number}" for number in range(len(texts))]


def test_the_text_of_the_metadata_is_what_rosbag2_wants(folder: Path) -> None:
    content = yaml.safe_load((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert content["version"] == 9
    assert (content["compression_format"], content["compression_mode"]) == ("", "")
    assert content["message_count"] == sum(row["message_count"] for row in content["files"]) == 100
    assert [row["path"] for row in content["files"]] == content["relative_file_paths"]
    for row in content["topics_with_message_count"]:
        topic = row["topic_metadata"]
        assert topic["offered_qos_profiles"] == [QOS.as_dict()]
        assert topic["serialization_format"] == "cdr"
    for file in folder.glob("*.mcap"):
        with file.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            summary = reader.get_summary()
            assert reader.get_header().profile == "ros2"
            notes = {row.name: row.metadata for row in reader.iter_metadata()}
            times = [message.log_time for _, _, message in reader.iter_messages()]
        own = yaml.safe_load(notes["rosbag2"]["serialized_metadata"])
        assert own["relative_file_paths"] == [file.name]
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_start_time == times[0]
        assert summary.statistics.message_end_time == times[-1]
        for channel in summary.channels.values():
            assert qos_from_text(channel.metadata["offered_qos_profiles"]) == [QOS.as_dict()]
            assert summary.schemas[channel.schema_id].encoding == "ros2msg"


def test_rows_of_impacts_are_the_simulator_s_with_the_times_of_their_messages(
    folder: Path, sent: list[Sent]
) -> None:
    clouds = [row for row in sent if row.topic == "/disk/impacts"]
    expected = [impacts_from_msg(deserialize_message(row.data, PointCloud2)) for row in clouds]
    with bag.open(folder) as run:
        rows = run.rows("/disk/impacts")
        columns = run.columns("/disk/impacts", ["index", "axial_impulse"])
    assert rows.dtype == IMPACT_DTYPE
    assert rows.tobytes() == b"".join(some.tobytes() for some in expected)
    np.testing.assert_array_equal(columns["index"], np.arange(len(rows)))
    assert list(columns) == ["index", "axial_impulse"]
    counts = [deserialize_message(row.data, PointCloud2).width for row in clouds]
    with bag.open(folder) as run:
        timed = run.columns("/disk/impacts", ["index", "log_time_ns", "publish_time_ns"])
        none = run.columns("/disk/impacts", ["log_time_ns"], 0, 1)
    received = np.repeat([row.log_time_ns for row in clouds], counts)
    np.testing.assert_array_equal(timed["log_time_ns"], received)
    assert timed["publish_time_ns"].dtype == np.int64
    assert len(timed["publish_time_ns"]) == len(timed["index"])
    assert none["log_time_ns"].shape == (0,)


def test_columns_of_messages_and_what_cannot_be_asked(folder: Path) -> None:
    with bag.open(folder) as run:
        states = run.columns("/joint_states")
        speeds = run.columns(
            "/disk/rotor_speed", ["header.stamp", "twist.angular.z", "log_time_ns"]
        )
        texts = run.columns("/disk/phase", ["data"])["data"]
        empty = run.columns("/diagnostics", ["status"])
    numbers = np.arange(20)
    np.testing.assert_array_equal(states["position"], [(0.5 * n, 0.0) for n in numbers])
    assert states["name"][3] == ["a", "b"]
    assert states["header.stamp"].dtype == np.int64
    np.testing.assert_array_equal(speeds["header.stamp"], numbers * 10**9 + 7)
    np.testing.assert_array_equal(speeds["twist.angular.z"], 1.5 * numbers)
    np.testing.assert_array_equal(speeds["log_time_ns"], START_NS + (5 * numbers + 2) * STEP_NS)
    assert texts.tolist() == [f"flight ü {number}" for number in numbers]
    assert len(empty["status"]) == 0
    with bag.open(folder) as run:
        refused(r"topic: got '/joint_state', allowed: .*Did you mean", run.columns, "/joint_state")
        with pytest.raises(InputError, match=r"field: got 'positon'.*Did you mean position"):
            run.columns("/joint_states", ["positon"])
        refused(r"field: got 'indx'.*Did you mean index", run.columns, "/disk/impacts", ["indx"])
        refused("Use `columns`", run.rows, "/joint_states")


def test_a_range_of_time_includes_its_start_only(folder: Path, sent: list[Sent]) -> None:
    start, end = sent[17].log_time_ns, sent[60].log_time_ns
    with bag.open(folder) as run:
        assert list(run.messages(None, start, end)) == sent[17:60]
        rows = run.rows("/disk/impacts", start, end)
    assert len(rows) == 3 * [row.topic for row in sent[17:60]].count("/disk/impacts")


def test_messages_come_in_the_order_of_reception(tmp_path: Path, sent: list[Sent]) -> None:
    shuffled = [sent[place] for place in np.random.default_rng(1).permutation(len(sent))]
    folder = make(tmp_path / "run", shuffled, chunk_size=1000)
    assert read(folder) == sent
    with bag.open(folder) as run:
        decoded = [obj.data for _, obj in run.decoded("/disk/phase")]
    assert decoded == [f"flight ü {number}" for number in range(20)]


def test_clouds_whose_frame_changes_are_still_viewed(tmp_path: Path) -> None:
    clouds = [message("/disk/impacts", number) for number in range(4)]
    clouds[2].header.frame_id = "another, longer name"
    with bag.Writer(tmp_path / "run") as writer:
        writer.add_topic("/c", "sensor_msgs/msg/PointCloud2")
        for number, cloud in enumerate(clouds):
            writer.write("/c", serialize_message(cloud), START_NS + number)
    with bag.open(tmp_path / "run") as run:
        found = run.rows("/c").tobytes()
    assert found == b"".join(impact_rows(3 * number, 3).tobytes() for number in range(4))


@pytest.mark.parametrize("kind", sorted(set(TYPES.values())))
def test_a_type_has_each_dependency_once_and_is_known_without_its_package(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_file(name: str, _: str) -> Path:
        raise InputError("message type", name, "a type whose .msg file is installed")

    refused("Install the package nowhere_msgs", schema_of, "nowhere_msgs/msg/Nothing")
    installed = schema_of(kind)
    parts = installed.text.split("=" * 80 + "\nMSG: ")
    names = [part.splitlines()[0] for part in parts[1:]]
    assert len(names) == len(set(names))
    assert installed.type_hash.startswith("RIHS01_")
    monkeypatch.setattr(schema, "_file", no_file)
    known = schema_of.__wrapped__(kind)
    assert known.type_hash == installed.type_hash
    fields = [message_type(kind, one.text).types[kind][1] for one in (installed, known)]
    assert fields[0] == fields[1]
    refused("nowhere_msgs", schema_of, "nowhere_msgs/msg/Nothing")


@pytest.mark.parametrize("whole", [True, False])
def test_memory_stays_small_however_large_the_bag(tmp_path: Path, whole: bool) -> None:
    process, size = psutil.Process(), 80_000
    content = b"\0\1\0\0" + bytes(size)
    with bag.Writer(tmp_path / "run", bag.Options(compression="none")) as writer:
        writer.add_topic("/large", "std_msgs/msg/Float64MultiArray")
        for number in range(1500):  # 120 MB
            writer.write("/large", content, START_NS + number)
    file = tmp_path / "run" / "run_0.mcap"
    if not whole:
        os.truncate(file, file.stat().st_size - 100)
    before = process.memory_full_info().uss
    with bag.open(file) as run:
        count = sum(1 for _ in run.messages())
        grown = process.memory_full_info().uss - before
    assert count == 1500
    # by the index: some chunks of 1 MiB; by a walk: LET_GO between two releases
    assert grown < (20e6 if whole else 90e6)


def test_the_duration_is_from_the_first_to_the_last_message() -> None:
    files = [FileRow("a", 500, 700, 2), FileRow("b", 650, 900, 1), FileRow("c")]
    content = Metadata(files, [], {}).content()
    assert content["starting_time"] == {"nanoseconds_since_epoch": 500}
    assert content["duration"] == {"nanoseconds": 400}


@pytest.mark.parametrize("behind", [4, 12, 100])
def test_bytes_behind_a_message_are_not_looked_at(tmp_path: Path, behind: int) -> None:
    """Serialisation by rmw leaves some where a sequence is empty: joint states without efforts."""
    state = JointState(name=["a"], position=[1.5], velocity=[0.5])
    data = serialize_message(state)
    with bag.Writer(tmp_path / "run") as writer:
        writer.add_topic("/joint_states", TYPES["/joint_states"], [QOS])
        writer.write("/joint_states", data + bytes(range(1, behind + 1)), START_NS)
    with bag.open(tmp_path / "run") as run:
        ((_, found),) = run.decoded("/joint_states")
        assert found.position.tolist() == [1.5]
        assert found.effort.tolist() == []
        assert run.columns("/joint_states", ["velocity"])["velocity"].tolist() == [[0.5]]

"""Bags: our writer beside mcap's own, our columns beside other readers, the recorder.

Peers do the same work in the same round, so that noise hits all alike: look at the ratios.
"""

from __future__ import annotations

import shutil
import time
from array import array
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory
from rclpy.serialization import serialize_message
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore
from std_msgs.msg import Float64MultiArray

from bench.table import Aim, Row, compared, row
from bench.turns import Run, interleaved
from bouncing_disk_ros import bag
from bouncing_disk_ros.bag.schema import schema_of
from bouncing_disk_ros.bag.writer import COMPRESSIONS
from bouncing_disk_ros.core.model import IMPACT_DTYPE
from bouncing_disk_ros.ros.to_messages import impacts_to_msg
from support.bags import START_NS, impact_rows, message
from support.processes import Starter
from support.ros_peer import Talker

ROUNDS = 5
NUMBERS = "std_msgs/msg/Float64MultiArray"
#: name -> bytes of float64 in a message, messages in a run, messages a second to the recorder
SIZES = {"200 B": (168, 50_000, 3000), "80 kB": (80_000, 1000, 500)}
SECONDS = 4.0


def numbers(size: int) -> Any:
    """A message with so many bytes of random float64."""
    values = np.random.default_rng(1).normal(size=size // 8)
    return Float64MultiArray(data=array("d", values.tobytes()))


# --- writing --------------------------------------------------------------------------------------
def write_ours(folder: Path, compression: str, data: bytes, count: int) -> int:
    """A bag by our writer."""
    shutil.rmtree(folder, ignore_errors=True)
    with bag.Writer(folder, bag.Options(compression=compression)) as writer:
        writer.add_topic("/numbers", NUMBERS)
        for number in range(count):
            writer.write("/numbers", data, START_NS + number, START_NS + number, number)
    return count


def write_bare(file: Path, compression: str, data: bytes, count: int) -> int:
    """The same messages by mcap's own writer."""
    with file.open("wb") as stream:
        writer = McapWriter(stream, compression=CompressionType[compression.upper()])
        writer.start("ros2")
        schema = writer.register_schema(NUMBERS, "ros2msg", schema_of(NUMBERS).text.encode())
        channel = writer.register_channel("/numbers", "cdr", schema)
        for number in range(count):
            writer.add_message(channel, START_NS + number, data, START_NS + number, number)
        writer.finish()
    return count


def measure_writing(folder: Path) -> list[Row]:
    """What a message costs our writer, beside mcap's own."""
    rows = []
    for name, (size, count, _) in SIZES.items():
        data = serialize_message(numbers(size))
        for way in COMPRESSIONS:
            works: dict[str, Run] = {
                "ours": partial(write_ours, folder / "ours", way, data, count),
                "bare": partial(write_bare, folder / "bare.mcap", way, data, count),
            }
            times = interleaved(works, ROUNDS, time.process_time_ns)
            ratio = ("ours", "bare", "CPU / bare mcap writer", Aim(at_most=1.25))
            rows += compared("bag writer", f"{name}, {way}", "ns a message", times, [ratio])
    return rows


# --- reading --------------------------------------------------------------------------------------
def decode_bag(folder: Path) -> tuple[int, int]:
    """A bag of joint states and of clouds of 625 impacts (80 kB); how many of each."""
    state = serialize_message(message("/joint_states", 1))
    cloud = serialize_message(impacts_to_msg(impact_rows(0, 625), START_NS))
    states, clouds = 5000, 60
    with bag.Writer(folder) as writer:
        writer.add_topic("/joint_states", "sensor_msgs/msg/JointState")
        writer.add_topic("/disk/impacts", "sensor_msgs/msg/PointCloud2")
        for number in range(states):
            writer.write("/joint_states", state, START_NS + number)
        for number in range(clouds):
            writer.write("/disk/impacts", cloud, START_NS + number)
    return states, clouds


def by_us(folder: Path, topic: str) -> int:
    """All fields as columns; points of clouds as one array."""
    with bag.open(folder) as run:
        columns = run.columns(topic)
    return len(next(iter(columns.values())))


def by_rosbags(folder: Path, topic: str) -> int:
    """One object each by rosbags; points of clouds viewed and joined by numpy."""
    store, found = get_typestore(Stores.ROS2_JAZZY), []
    with Reader(folder) as reader:
        rows = [connection for connection in reader.connections if connection.topic == topic]
        for connection, _, data in reader.messages(rows):
            found.append(store.deserialize_cdr(bytes(data), connection.msgtype))
    return points([content.data for content in found]) if "impacts" in topic else len(found)


def by_mcap_ros2(folder: Path, topic: str) -> int:
    """The same by mcap-ros2-support."""
    (file,) = folder.glob("*.mcap")
    with file.open("rb") as stream:
        reader = make_reader(stream, True, [DecoderFactory()])
        found = [row.decoded_message for row in reader.iter_decoded_messages([topic])]
    return points([content.data for content in found]) if "impacts" in topic else len(found)


def points(data: list[Any]) -> int:
    """Rows in the bytes of clouds, joined into one array."""
    return len(np.concatenate([np.frombuffer(bytes(some), IMPACT_DTYPE) for some in data]))


def measure_reading(folder: Path) -> list[Row]:
    """What a message or a row costs to read, beside two other readers of the same bag."""
    states, clouds = decode_bag(folder / "read")
    rows = []
    for topic, count, what in (
        ("/joint_states", states, "messages of JointState"),
        ("/disk/impacts", 625 * clouds, "rows of impacts"),
    ):
        peers = {"columns": by_us, "rosbags": by_rosbags, "mcap-ros2-support": by_mcap_ros2}
        works: dict[str, Run] = {}
        for name, peer in peers.items():
            works[name] = partial(peer, folder / "read", topic)
            assert works[name]() == count, name
        times = interleaved(works, ROUNDS, time.perf_counter_ns)
        ratios = [(name, "columns", f"speed / {name}", None) for name in (*peers,)[1:]]
        rows += compared("bag reader", what, "ns", times, ratios)
    return rows


# --- the recorder ---------------------------------------------------------------------------------
def measure_recorder(start: Starter, folder: Path) -> list[Row]:
    """CPU, memory and loss of the recorder as a process, beside what it is sent."""
    talker, rows = Talker(), []
    try:
        for name, (size, _, rate) in SIZES.items():
            rows += record(start, talker, folder / f"of_{size}", numbers(size), rate, name)
    finally:
        talker.close()
    return rows


def record(
    start: Starter, talker: Talker, target: Path, content: Any, rate: int, name: str
) -> list[Row]:
    """One recording of messages at a rate."""
    topic = f"/{target.name}"
    process = start("recorder", str(target), "--ros-args", "-p", f"topics:={topic}")
    process.wait_for("recording to")
    publisher, watched = talker.publisher(topic, Float64MultiArray), psutil.Process(process.pid)
    before, begin, sent, most = watched.cpu_times(), time.monotonic(), 0, 0
    start_size = watched.memory_info().rss
    while (now := time.monotonic() - begin) < SECONDS:
        for _ in range(int(now * rate) - sent):
            publisher.publish(content)
            sent += 1
        most = max(most, watched.memory_info().rss)
        time.sleep(0.001)
    publisher.wait_for_all_acked()
    used, elapsed = sum(watched.cpu_times()[:2]) - sum(before[:2]), time.monotonic() - begin
    assert process.end() == 0, process.output
    with bag.open(target) as run:
        recorded = run.message_count
    what = f"zstd, {name} at {rate} Hz"
    return [
        row("recorder", f"CPU of one core, {what}", "%", [100.0 * used / elapsed]),
        row("recorder", f"memory taken while it records, {what}", "MiB",
            [(most - start_size) / 2**20]),
        row("recorder", f"recorded / sent, {what}", "1", [recorded / sent], Aim(at_least=1.0)),
    ]  # fmt: skip


def measure(start: Starter, folder: Path) -> list[Row]:
    """All rows of this part."""
    return measure_writing(folder) + measure_reading(folder) + measure_recorder(start, folder)

"""Writers and recorders of bags that are killed at random moments.

make soak                                                       # a thousand writers
BOUNCING_DISK_SOAK_KILLS=100 make soak

KILLS: of writers; a hundredth of it of recorders.
"""

from __future__ import annotations

import os
import random
import shutil
import struct
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rosbags.rosbag2 import Reader
from std_msgs.msg import String

from bouncing_disk_ros import bag
from bouncing_disk_ros.errors import InputError
from soak import killed_writer
from support.processes import Starter
from support.ros_peer import Talker

KILLS = int(os.environ.get("BOUNCING_DISK_SOAK_KILLS", "1000"))
HERE = Path(__file__).parent

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]

Row = tuple[object, ...]
Content = tuple[list[Row], dict[str, bytes], dict[str, str], dict[str, bag.Topic]]


def read(path: Path) -> tuple[Content, bool]:
    """All that a bag holds, and whether it claims to be whole."""
    with bag.open(path) as run:
        rows = [tuple(row) for row in run.messages()]
        return (rows, run.attachments, run.notes, run.topics), run.complete


def mended(folder: Path, number: int | None = None) -> list[Row]:
    """The messages of the bag that recovery makes; what it says of them must be so.

    `number` is how many messages were written, where that is known.
    """
    target = folder.with_name("mended")
    shutil.rmtree(target, ignore_errors=True)
    report = bag.recover(folder, target)
    (rows, *_), complete = read(target)
    assert complete
    assert report.saved == len(rows)
    assert not report.exact or number in (None, report.saved + report.lost)
    return rows


def test_writers_killed_at_random_moments(tmp_path: Path) -> None:
    command = [sys.executable, str(HERE / "killed_writer.py"), str(tmp_path), str(KILLS), "7"]
    bags = messages = open_files = 0
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            folder = tmp_path / line.strip()
            (least,) = struct.unpack("<Q", (tmp_path / f"{folder.name}.told").read_bytes())
            try:
                (rows, *_), _ = read(folder)
            except InputError:  # killed before there was anything
                assert least == 0
                continue
            assert len(rows) >= least, "a finished chunk is not there"
            assert rows == expected(len(rows))
            assert mended(folder) == rows
            with Reader(folder.with_name("mended")) as reader:
                assert sum(1 for _ in reader.messages()) == len(rows) == reader.message_count
            bags, messages = bags + 1, messages + len(rows)
            open_files += len(list(folder.glob("*.mcap"))) > 1
            shutil.rmtree(folder)
    assert process.returncode == 0
    print(f"\n{KILLS} kills, {bags} bags, {open_files} of several files, {messages} messages")
    assert bags > KILLS / 2
    assert messages > bags


def expected(count: int) -> list[Row]:
    """The first messages of every writer that is killed."""
    numbers = range(count)
    return [(killed_writer.TOPIC, n + 1, n + 1, n, killed_writer.content(n)) for n in numbers]


def test_recorders_killed_at_random_moments(start: Starter, talker: Talker, tmp_path: Path) -> None:
    dice, saved = random.Random(3), 0
    for place in range(max(1, KILLS // 100)):
        folder, topic = tmp_path / str(place), f"/text_{place}"  # a name that no dead one hears
        options = ("-p", f"topics:={topic}", "-p", "chunk_period:=0.05", "-p", "max_size:=0.01")
        process = start("recorder", str(folder), "--ros-args", *options)
        process.wait_for("recording to")
        publisher = talker.publisher(topic)
        number, end = 0, time.monotonic() + dice.uniform(0.1, 1.0)
        while time.monotonic() < end:
            publisher.publish(String(data=str(number)))
            number += 1
            time.sleep(0.0005)
        process.kill()
        talker.node.destroy_publisher(publisher)
        with bag.open(folder) as run:
            texts = run.columns(topic, ["data"])["data"].tolist() if run.topics else []
        assert texts == [str(n) for n in range(len(texts))]
        assert len(mended(folder)) == len(texts)
        saved += len(texts)
    print(f"\n{saved} messages saved of {max(1, KILLS // 100)} recorders")
    assert saved > 0

"""Bags cut at every length, with every single bit flipped, and killed a thousand times.

make soak                                                       # every length, bit and kill
BOUNCING_DISK_SOAK_STEP=50 BOUNCING_DISK_SOAK_KILLS=100 make soak

STEP: one in so many lengths and bits is tried. KILLS: of writers; a hundredth of it of recorders.
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
from support.bags import START_NS
from support.processes import Starter
from support.talker import Talker

STEP = int(os.environ.get("BOUNCING_DISK_SOAK_STEP", "1"))
KILLS = int(os.environ.get("BOUNCING_DISK_SOAK_KILLS", "1000"))
HERE = Path(__file__).parent

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]

Row = tuple[object, ...]
Content = tuple[list[Row], dict[str, bytes], dict[str, str], dict[str, bag.Topic]]


def sample(folder: Path, compression: str) -> tuple[bytes, list[Row]]:
    """The bytes of a small bag with several chunks, and its messages."""
    options = bag.Options(compression=compression, chunk_size=150)
    sent: list[Row] = []
    with bag.Writer(folder, options, notes={"a": "note"}) as writer:
        writer.attach("a.yaml", "text/yaml", b"friction: 0.6\n")
        for topic in ("/one", "/two"):
            writer.add_topic(topic, killed_writer.KIND, [killed_writer.QOS])
        for number in range(12):
            time_ns = START_NS + number
            row = (("/one", "/two")[number % 2], time_ns, time_ns - 5, number)
            sent.append((*row, killed_writer.content(number)))
            writer.write(row[0], killed_writer.content(number), *row[1:])
    return (folder / f"{folder.name}_0.mcap").read_bytes(), sent


def put(folder: Path, content: bytes) -> Path:
    """A folder with one file of this content and no metadata.yaml."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    (folder / "run_0.mcap").write_bytes(content)
    return folder


def read(path: Path) -> tuple[Content, bool]:
    """All that a bag holds, and whether it claims to be whole."""
    with bag.open(path) as run:
        rows = [tuple(row) for row in run.messages()]
        return (rows, run.attachments, run.notes, run.topics), run.complete


def read_or_refused(path: Path) -> tuple[Content, bool] | str:
    """The same, or the one line that says why not."""
    try:
        return read(path)
    except (bag.BagError, InputError) as error:
        line = str(error)
    assert len(line.splitlines()) == 1
    return line


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


@pytest.fixture(params=["zstd", "lz4", "none"])
def whole(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[bytes, list[Row]]:
    return sample(tmp_path / "whole", request.param)


def test_a_bag_cut_at_every_length(tmp_path: Path, whole: tuple[bytes, list[Row]]) -> None:
    content, sent = whole
    refused = most = 0
    for length in range(0, len(content), STEP):
        folder = put(tmp_path / "run", content[:length])
        found = read_or_refused(folder)
        if isinstance(found, str):
            refused += 1
            continue
        (rows, *_), complete = found
        assert not complete
        assert rows == sent[: len(rows)]
        assert len(rows) >= most, "a longer file gave less"
        most = len(rows)
        assert mended(folder) == rows
    print(f"\n{len(content)} B: {refused} lengths refused, up to {most} of {len(sent)} messages")
    assert refused < 30, "only a file without its first record is to be refused"
    assert most == len(sent)


def test_every_single_flipped_bit(tmp_path: Path, whole: tuple[bytes, list[Row]]) -> None:
    content, sent = whole
    file = put(tmp_path / "run", content) / "run_0.mcap"
    right, complete = read(file)
    assert (complete, right[0]) == (True, sent)
    refused = told = harmless = 0
    for place in range(0, 8 * len(content), STEP):
        file.write_bytes(flipped(content, place))
        found = read_or_refused(file)
        if isinstance(found, str):
            refused += 1
        else:
            assert found[0] == right, f"bit {place % 8} of byte {place // 8}"
            told, harmless = told + (not found[1]), harmless + found[1]
        if (place // 8 + place) % 8 == 0:  # one bit of each byte
            rows = mended(file.parent, len(sent))
            assert rows == [row for row in sent if row in rows], f"byte {place // 8}"
    print(f"\n{8 * len(content)} bits: {refused} refused, {told} told, {harmless} harmless")
    assert refused > 0


def test_every_single_flipped_bit_of_an_unfinished_bag(
    tmp_path: Path, whole: tuple[bytes, list[Row]]
) -> None:
    content, sent = whole[0][:-8], whole[1]
    file = put(tmp_path / "run", content) / "run_0.mcap"
    (_, attachments, notes, _), _ = read(file)
    lost = 0
    for place in range(0, 8 * len(content), STEP):
        file.write_bytes(flipped(content, place))
        found = read_or_refused(file)
        if isinstance(found, str):
            continue
        with bag.open(file) as run:
            rows, remarks = [tuple(row) for row in run.messages()], run.remarks
            assert run.attachments.items() <= attachments.items()
            assert run.notes.items() <= notes.items()
        assert rows == [row for row in sent if row in rows], f"byte {place // 8}"
        if rows != sent:
            lost += 1
            assert any("bytes" in remark for remark in remarks), f"byte {place // 8}"
    print(f"\n{8 * len(content)} bits: {lost} cost messages, and it was told")
    assert lost > 0


def test_every_single_flipped_bit_of_metadata_yaml(tmp_path: Path) -> None:
    _, sent = sample(tmp_path / "run", "zstd")
    file = tmp_path / "run" / "metadata.yaml"
    content, refused = file.read_bytes(), 0
    for place in range(0, 8 * len(content), STEP):
        file.write_bytes(flipped(content, place))
        found = read_or_refused(file.parent)
        if isinstance(found, str):
            refused += 1
        else:
            assert found[0][0] == sent
    print(f"\n{8 * len(content)} bits: {refused} refused")


def flipped(content: bytes, place: int) -> bytes:
    """The same with one bit changed."""
    damaged = bytearray(content)
    damaged[place // 8] ^= 1 << place % 8
    return bytes(damaged)


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

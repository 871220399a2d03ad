"""Bags of gigabytes are read and recorded in little memory.

make soak                                                       # 2 GB
BOUNCING_DISK_SOAK_GB=0.3 make soak
"""

from __future__ import annotations

import os
import shutil
import time
from array import array
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from std_msgs.msg import Float64MultiArray

from bouncing_disk_ros import bag
from support import large_bag
from support.processes import Starter
from support.ros_peer import Talker

GIGABYTES = float(os.environ.get("BOUNCING_DISK_SOAK_GB", "2"))
#: messages the middleware may hold besides: `max_samples` of Fast DDS by default, not verified
HISTORY = 5000
#: Hz; when 80 kB come twice as fast, the middleware repairs its own losses for a minute
RATE = 1000.0
#: B; what interpreter, libraries and allocators may take besides what is derived
SLACK = 48 * 2**20

pytestmark = [pytest.mark.soak, pytest.mark.timeout(3600)]


@pytest.fixture(scope="module")
def large(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, int]]:
    """The bag, and how many messages each of its topics has."""
    folder = tmp_path_factory.mktemp("large") / "run"
    yield folder, large_bag.make(folder, GIGABYTES)
    shutil.rmtree(folder)


@pytest.mark.parametrize("way", large_bag.WAYS)
@pytest.mark.parametrize("whole", [True, False])  # the outer loop: the file is cut only once
def test_reading_takes_little_memory(large: tuple[Path, int], way: str, whole: bool) -> None:
    folder, count = large
    if not whole:
        cut(folder)
    before, after, found = large_bag.read(folder, way)
    expected = {
        "messages": 2 * count,
        "decoded": 2 * count,
        "columns": count,
        "rows": large_bag.ROWS * count,
    }
    print(f"\n{way}: {GIGABYTES:g} GB with {(after - before) / 2**20:.0f} MiB")
    assert found == expected[way]
    # a range of columns twice: as it is gathered and as one array; a walk holds 64 MiB of the file
    in_range = 0 if way in ("messages", "decoded") else 2 * large_bag.RANGE_NS * large_bag.MESSAGE
    assert after - before < in_range + SLACK + (0 if whole else 64 * 2**20)


def cut(folder: Path) -> None:
    """Leave the file without its index, as a killed recorder does."""
    (folder / "metadata.yaml").unlink(missing_ok=True)
    (file,) = folder.glob("*.mcap")
    if file.read_bytes()[-8:] == b"\x89MCAP0\r\n":
        os.truncate(file, file.stat().st_size - 8)


def test_recording_takes_no_more_memory_than_its_queues(
    start: Starter, talker: Talker, tmp_path: Path
) -> None:
    queue = 64_000_000
    options = ("-p", "topics:=/large", "-p", "compression:=none", "-p", "queue_size:=64.0")
    process = start("recorder", str(tmp_path / "run"), "--ros-args", *options)
    process.wait_for("recording to")
    watched, largest = psutil.Process(process.pid), 0
    count = round(GIGABYTES * 1e9 / large_bag.MESSAGE)
    publisher = talker.publisher("/large", Float64MultiArray)
    message = Float64MultiArray(data=array("d", range(large_bag.MESSAGE // 8)))
    before = watched.memory_info().rss
    begin = time.monotonic()
    for number in range(count):
        publisher.publish(message)
        if number % 100 == 0:
            largest = max(largest, watched.memory_info().rss)
            time.sleep(max(0.0, begin + number / RATE - time.monotonic()))
    publisher.wait_for_all_acked()
    assert process.end() == 0, process.output
    with bag.open(tmp_path / "run") as run:
        print(f"\n{run.message_count} of {count} with {(largest - before) / 2**20:.0f} MiB")
        assert run.message_count > 0
    assert largest - before < queue + HISTORY * large_bag.MESSAGE + SLACK

"""Read a large bag in one way and print its memory before, at most, and the count.

python large_bag.py FOLDER {messages,decoded,columns,rows}
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from bouncing_disk_ros import bag

CLOUD = "/cloud"
NUMBERS = "/numbers"
MESSAGE = 80_000  # B
ROWS = 625  # impacts in a cloud of this size
RANGE_NS = 1000  # one message each ns: 80 MB in a range


def memory(field: str) -> int:
    """VmRSS (now) or VmHWM (at most) in bytes; ru_maxrss begins with that of the parent."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(f"{field}:"))


def ranges(run: bag.Bag) -> Iterator[tuple[int, int]]:
    """The time of the bag in parts."""
    for start in range(run.start_ns, run.end_ns + 1, RANGE_NS):
        yield start, start + RANGE_NS


WAYS: dict[str, Callable[[bag.Bag], int]] = {
    "messages": lambda run: sum(1 for _ in run.messages()),
    "decoded": lambda run: sum(1 for _ in run.decoded()),
    "columns": lambda run: sum(
        len(run.columns(NUMBERS, ["data"], *part)["data"]) for part in ranges(run)
    ),
    "rows": lambda run: sum(len(run.rows(CLOUD, *part)) for part in ranges(run)),
}


def make(folder: Path, gigabytes: float) -> int:
    """Write a large bag, half clouds of 625 impacts, half rows of numbers; how many of each."""
    from array import array

    import numpy as np
    from rclpy.serialization import serialize_message
    from std_msgs.msg import Float64MultiArray

    from bouncing_disk_ros.ros.to_messages import impacts_to_msg
    from support.bags import START_NS, impact_rows

    cloud = serialize_message(impacts_to_msg(impact_rows(0, ROWS), START_NS))
    values = np.random.default_rng(1).normal(size=MESSAGE // 8)
    numbers = serialize_message(Float64MultiArray(data=array("d", values.tobytes())))
    count = round(gigabytes * 1e9 / (len(cloud) + len(numbers)))
    with bag.Writer(folder, bag.Options(compression="none")) as writer:
        writer.add_topic(CLOUD, "sensor_msgs/msg/PointCloud2")
        writer.add_topic(NUMBERS, "std_msgs/msg/Float64MultiArray")
        for number in range(count):
            writer.write(CLOUD, cloud, START_NS + number)
            writer.write(NUMBERS, numbers, START_NS + number)
    return count


def read(folder: Path, way: str) -> tuple[int, int, int]:
    """Read it in a process of its own; memory before and at most in bytes, and what was read."""
    command = [sys.executable, __file__, str(folder), way]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    before, after, count = (int(word) for word in done.stdout.split())
    return before, after, count


def main(folder: str, way: str) -> None:
    """Read it."""
    Path("/proc/self/clear_refs").write_text("5")  # VmHWM begins anew
    before = memory("VmRSS")
    with bag.open(folder) as run:
        count = WAYS[way](run)
    print(before, memory("VmHWM"), count)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])

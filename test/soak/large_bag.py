"""Read a large bag in one way and print its memory before, at most, and the count.

python large_bag.py FOLDER {messages,decoded,columns,rows}
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path

from bouncing_disk_ros import bag

CLOUD = "/cloud"
NUMBERS = "/numbers"
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


def main(folder: str, way: str) -> None:
    """Read it."""
    Path("/proc/self/clear_refs").write_text("5")  # VmHWM begins anew
    before = memory("VmRSS")
    with bag.open(folder) as run:
        count = WAYS[way](run)
    print(before, memory("VmHWM"), count)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])

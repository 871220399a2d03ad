"""Read a large bag in one way and print the peak memory in bytes before and after, and the count.

python large_bag.py FOLDER {messages,decoded,columns,rows}
"""

from __future__ import annotations

import resource
import sys
from collections.abc import Callable, Iterator

from bouncing_disk_ros import bag

CLOUD = "/cloud"
NUMBERS = "/numbers"
RANGE_NS = 1000  # one message each ns: 80 MB in a range


def peak() -> int:
    """The most memory that this process has had so far, in bytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


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
    before = peak()
    with bag.open(folder) as run:
        count = WAYS[way](run)
    print(before, peak(), count)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])

"""Messages of several blocks in the order of their times, with few of the blocks in memory."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.bag_topic import Message
from bouncing_disk_ros.bag.formats import BagError


class Part(NamedTuple):
    """A block to be opened when its time has come."""

    start_ns: int  # no message in it is earlier
    size: int  # bytes in memory once it is open
    open: Callable[[], Iterator[Message]]  # its messages in the order of their times


def in_order(parts: Iterable[Part]) -> Iterator[Message]:
    """Messages of parts that come in the order of their start; of equal times the first part's.

    Raises BagError when too many parts overlap in time.
    """
    heap: list[tuple[int, int, Message, Iterator[Message], int]] = []
    held = 0
    for number, part in enumerate(parts):
        while heap and heap[0][0] < part.start_ns:
            yield heap[0][2]
            held -= _advance(heap)
        rest = part.open()
        first = next(rest, None)
        if first is None:
            continue
        held += part.size
        if held > limits.OVERLAP:
            most = limits.OVERLAP // limits.MIB
            raise BagError(
                f"chunks of more than {most} MiB overlap in time: the messages cannot be brought "
                "into order. `columns` and `rows` read them as stored"
            )
        heapq.heappush(heap, (first.log_time_ns, number, first, rest, part.size))
    while heap:
        yield heap[0][2]
        _advance(heap)


def _advance(heap: list[tuple[int, int, Message, Iterator[Message], int]]) -> int:
    """Replace the first message by the next of its part; the size of a part that is at its end."""
    _, number, _, rest, size = heap[0]
    following = next(rest, None)
    if following is None:
        heapq.heappop(heap)
        return size
    heapq.heapreplace(heap, (following.log_time_ns, number, following, rest, size))
    return 0

"""Latched messages, repeated where a new file of a split bag begins: so each file stands alone.

Repeats have a channel of their own, marked in its metadata and without quality of service, beside
the topic's ordinary one. Our reader skips them when it has read the file before, and so does
`rosbags`; a single file shows them to every tool as messages of the topic.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import NamedTuple

from mcap.records import Channel

MARK = "repeated"
"""The key in a channel's metadata."""


def without_repeats(channels: Mapping[int, Channel]) -> dict[int, Channel]:
    """The ordinary ones of some channels by number."""
    return {number: row for number, row in channels.items() if MARK not in row.metadata}


class Kept(NamedTuple):
    """A message that a later file may repeat."""

    data: bytes
    publish_time_ns: int
    sequence: int


class Latched:
    """What a late joiner of a topic is to be given: the last `depth` messages.

    Where `begins` is true of a message, those before it are not needed any more.
    """

    def __init__(self, depth: int, begins: Callable[[bytes], bool] | None = None) -> None:
        self.messages: deque[Kept] = deque(maxlen=depth)
        self._begins = begins

    def deepen(self, depth: int) -> None:
        """Keep more messages from now on (or fewer)."""
        self.messages = deque(self.messages, maxlen=depth)

    def take(self, data: bytes, publish_time_ns: int, sequence: int) -> None:
        """A message was written."""
        if self._begins is not None and self._begins(data):
            self.messages.clear()
        self.messages.append(Kept(data, publish_time_ns, sequence))

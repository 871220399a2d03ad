"""The order in which messages of a bag were sent, and what their numbers say of losses."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.bag_topic import Message
from bouncing_disk_ros.bag.loss import SequenceLoss
from bouncing_disk_ros.units import NS

WINDOW_NS = NS
"""Messages of one node come at most so much later than others that were sent after them."""
_OVERHEAD = 400
"""Bytes that a message takes besides its content."""


def in_order_of_sending(messages: Iterable[Message]) -> Iterator[Message]:
    """Messages as they were sent, of each topic in the order of reception.

    At most limits.WAITING bytes wait: where more come within a window, the first are let go.
    """
    waiting: list[tuple[int, int, Message]] = []
    latest: dict[str, int] = {}
    held = 0
    for counter, message in enumerate(messages):
        sent = min(message.publish_time_ns or message.log_time_ns, message.log_time_ns)
        sent = latest[message.topic] = max(sent, latest.get(message.topic, 0))
        heapq.heappush(waiting, (sent, counter, message))
        held += len(message.data) + _OVERHEAD
        # latched messages may have been sent long ago, and come in any order
        while waiting and (
            waiting[0][2].log_time_ns < message.log_time_ns - WINDOW_NS or held > limits.WAITING
        ):
            first = heapq.heappop(waiting)[2]
            held -= len(first.data) + _OVERHEAD
            yield first
    while waiting:
        yield heapq.heappop(waiting)[2]


class Losses:
    """Gaps in the numbers of the messages of each topic."""

    def __init__(self) -> None:
        self._topics: dict[str, SequenceLoss] = {}
        self._falls: dict[str, int] = {}

    def note(self, message: Message) -> None:
        """A message, in the order of reception."""
        loss = self._topics.setdefault(message.topic, SequenceLoss())
        if message.sequence == 0:
            loss.why_not = "the recorder did not number them"
        if loss.gap(message.sequence) < 0:
            self._falls[message.topic] = self._falls.get(message.topic, 0) + 1
            loss.restart()
        loss.take(message.sequence)

    def of(self, topic: str, runs: int) -> str:
        """How many messages were lost, in words."""
        loss = self._topics.get(topic, SequenceLoss())
        if not loss.why_not and self._falls.get(topic, 0) >= max(2, runs):
            loss.why_not = "several publishers on the topic"
        return str(loss)

"""The order in which messages of a bag were sent, and what their numbers say of runs and losses."""

from __future__ import annotations

import heapq
from collections import OrderedDict, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from enum import Enum

from bouncing_disk_ros import limits
from bouncing_disk_ros.bag.reader import Message
from bouncing_disk_ros.report.run_record_builder import Count
from bouncing_disk_ros.running_numbers import UNKNOWN, UNNUMBERED, Gaps
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
        before = latest.get(message.topic, 0)
        if sent < before - WINDOW_NS:  # its clock was set back, or another node sent it long ago
            sent = message.log_time_ns
        sent = latest[message.topic] = max(sent, before)
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


LATCHED = ("disk/inputs", "platform/motion", "platform/offset", "disk/phase")
"""Topics whose next number is no sign: the newest message of another run may have it."""
_REMEMBERED = 1000
_PUBLISHERS = 10_000
"""Next numbers of publishers of a topic that are kept. With more of them nothing is counted."""
REPEAT = -1
"""Stands for the run of a message that is there a second time."""


class Sign(Enum):
    """What a message shows of the run under way."""

    BEGINS = "begins"
    GOES_ON = "goes on"
    NOTHING = "nothing"


class RunOrder:
    """Which run each message of a simulator belongs to: that under way when it was sent.

    A run begins where a topic begins anew: its publisher's numbers, its running index or its
    simulated time fall behind those of a message of the same topic and the same run. Where they
    rise and no number is missing, the run goes on; but the next number of a latched topic is no
    sign, for the newest message of another run may have it. A message that shows neither is of the
    run that was under way before and after it; between two runs nobody knows. Messages are to be
    given in the order of sending.
    """

    def __init__(self) -> None:
        self.run = 0  # of the newest message that shows it, from 1
        # by topic: run, number and counts of the newest message
        self._latest: dict[str, tuple[int, int, list[float]]] = {}
        self._seen: dict[str, OrderedDict[tuple[int, int, int], None]] = {}

    def is_repeat(self, short: str, message: Message) -> bool:
        """Whether a message has been there before, with the number and the time of the first.

        A recorder may be given latched ones a second time, and two recordings may be joined.
        """
        seen = self._seen.setdefault(short, OrderedDict())
        sent = message.publish_time_ns or message.log_time_ns
        key = sent, message.sequence, hash(message.data)
        if key in seen:
            return True
        seen[key] = None
        if len(seen) > _REMEMBERED:
            seen.popitem(last=False)
        return False

    def take(self, short: str, number: int, counts: Sequence[Count]) -> Sign:
        """What a message shows; `number`: of its publisher, 0: it has none."""
        run, before, latest = self._latest.get(short, (0, 0, []))
        shown = Sign.NOTHING
        if self.run == 0:
            shown = Sign.BEGINS
        elif run == self.run and ((counts and latest) or (number and before)):
            pairs = list(zip(counts, latest, strict=False))
            is_next = short not in LATCHED and (not (number and before) or number == before + 1)
            if 0 < number <= before or any(one.follows_not(last) for one, last in pairs):
                shown = Sign.BEGINS
            elif is_next or any(one.is_next(last) for one, last in pairs):
                shown = Sign.GOES_ON
        self.run += shown is Sign.BEGINS
        self._latest[short] = self.run, number, [one.last for one in counts]
        return shown


class Losses:
    """Gaps in the numbers of the messages of each topic.

    `mixed`: the topics that had several publishers at once.
    """

    def __init__(self) -> None:
        self.mixed: set[str] = set()
        self._topics: dict[str, Gaps] = {}
        # by topic: the next numbers of publishers, where a lower number came instead
        self._left: defaultdict[str, set[int | None]] = defaultdict(set)
        self._why_not = dict[str, str]()

    def note(self, message: Message) -> None:
        """A message that is no repeat, in the order of reception on its topic."""
        name, number = message.topic, message.sequence
        if number in (0, UNKNOWN):
            why_not = UNNUMBERED if number else "the recorder did not number them"
            self._why_not[name] = why_not
            return
        gaps, left = self._topics.setdefault(name, Gaps()), self._left[name]
        before = gaps.next
        missing = gaps.take(number)
        # a number goes on where another publisher's was lower
        if missing and (number in left or len(left) == _PUBLISHERS):
            self.mixed.add(name)
        elif missing < 0:
            left.add(before)

    def of(self, topic: str) -> str:
        """How many messages were lost, in words."""
        several = topic in self.mixed and "several publishers on the topic"
        if why_not := self._why_not.get(topic) or several:
            return f"not countable: {why_not}"
        return str(self._topics[topic].lost if topic in self._topics else 0)

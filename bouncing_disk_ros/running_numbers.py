"""Running numbers of messages and rows: what is missing, and who has published a message.

A publisher numbers its messages from 1 on. The middleware does not say whose a message is.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import chain

Gids = frozenset[bytes]
"""The identities of the publishers of a topic."""
UNKNOWN = (1 << 32) - 1
"""The number, as a bag has it, of a message that the middleware did not number."""
UNNUMBERED = "the middleware does not number messages"


class Gaps:
    """Gaps in a running number, which begins anywhere: a subscriber may join late."""

    def __init__(self) -> None:
        self.lost = 0
        self.next: int | None = None

    def take(self, first: int, last: int | None = None, count: int = 1) -> int:
        """So many numbers came, from `first` to `last`; how many are missing before and in them.

        Below 0: the number has fallen, something else is counted from here on.
        """
        last = first if last is None else last
        gap = 0 if self.next is None else first - self.next
        self.next = last + 1
        missing = max(gap, 0) + max(last - first + 1 - count, 0)
        self.lost += missing
        return missing or min(gap, 0)

    def restart(self) -> None:
        """After a pause: the next number is a first one."""
        self.next = None


class Publishers:
    """The publishers of a topic, told apart by the number that each gives its next message."""

    def __init__(self) -> None:
        self._next: list[int] = []  # of each publisher

    def take(self, number: int, likely: Iterable[int] = ()) -> tuple[int, bool]:
        """A message came with this number: the index of its publisher, and whether that is new.

        New is a publisher whose number continues no count. `likely`: those that are meant where the
        counts of several have come as far.
        """
        places = chain(likely, range(len(self._next)))
        found = next((one for one in places if self._next[one] == number), None)
        if found is None:
            self._next.append(number + 1)
            return len(self._next) - 1, True
        self._next[found] += 1
        return found, False


class MessageLoss(Gaps):
    """Messages of one topic that did not arrive, by the numbers that its publisher gives.

    `publishers` asks the graph. The numbers of several publishers mix: while there are several,
    nothing can be counted, and `why_not` says from then on why the count may be too small.
    """

    def __init__(self, publishers: Callable[[], Gids]) -> None:
        super().__init__()
        self.why_not = ""
        self._publishers = publishers
        self._known: Gids = frozenset()
        self._mixed = False

    def note(self, number: int | None) -> None:
        """A message came with this number; None: the middleware does not number them."""
        if self._mixed:
            return
        if number is None or number != self.next:  # the first one, a gap, or another publisher
            found = self._publishers()
            self._mixed = len(found) > 1 or number is None
            if self._mixed:
                several = f"{len(found)} publishers on the topic"
                self.why_not = UNNUMBERED if number is None else several
                return
            if not found <= self._known:
                self.restart()
            self._known = found
        assert number is not None
        self.take(number)

    def look(self) -> None:
        """Look again, once in a while, whether there is one publisher only."""
        if self._mixed and len(self._publishers()) < 2:
            self._mixed = False
            self.restart()

    def __str__(self) -> str:
        return f"not countable: {self.why_not}" if self.why_not else str(self.lost)

"""Counts of lost messages and rows: gaps in a number that grows by one with each of them."""

from __future__ import annotations

from collections.abc import Callable

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

"""Which of several publishers of /clock stops, decided by each of them from what it sees alone."""

from __future__ import annotations

import math

from bouncing_disk_ros.units import NS

YOUNG_NS = 4 * NS
"""Discovery has been seen to take up to 3.1 s: publishers that were started together see each other
within this time."""
TURN_NS = 4 * NS
"""Longer than one of two may see the other before it is seen, and than it takes to see it leave."""


class ClockClaim:
    """The claim of one publisher to /clock. The older one of two stays.

    None knows how old another is. So each waits for the other to leave: one that is young not at
    all, or for a turn where its identity is the greater one; one that is old for two turns, or for
    good. No two wait equally long.
    """

    def __init__(self, own: bytes, now_ns: int) -> None:
        """`own`: the identity of the publisher in the graph."""
        self._own, self._begin_ns = own, now_ns
        self._seen_ns: int | None = None

    def is_lost(self, publishers: frozenset[bytes], now_ns: int) -> bool:
        """Whether to stop, with these publishers of the topic in the graph."""
        others = publishers - {self._own}
        if not others:
            self._seen_ns = None
            return False
        if self._seen_ns is None:
            self._seen_ns = now_ns
        is_greater = self._own > max(others)
        if self.is_silent:
            patience: float = TURN_NS if is_greater else 0
        else:
            patience = math.inf if is_greater else 2 * TURN_NS
        return now_ns - self._seen_ns >= patience

    def is_young(self, now_ns: int) -> bool:
        """Whether publishers that were started together may still be unseen."""
        return now_ns - self._begin_ns <= YOUNG_NS

    @property
    def is_silent(self) -> bool:
        """Whether to publish nothing: another one is there, and may have been before."""
        return self._seen_ns is not None and self._seen_ns - self._begin_ns <= YOUNG_NS

"""True counts of lost messages: from gaps in the publisher's numbering, or in that of the rows."""

from __future__ import annotations

UNKNOWN = (1 << 64) - 1
"""The number that a middleware without numbering gives."""


class SequenceLoss:
    """Gaps in the sequence numbers of one publisher.

    A late joiner's first number is any. With two publishers on a topic their numbers mix, and the
    loss cannot be counted: then `why_not` says so.
    """

    def __init__(self) -> None:
        self.lost = 0
        self.why_not = ""
        self._last: int | None = None

    @property
    def begun(self) -> bool:
        """Whether there is a number to go on from."""
        return self._last is not None

    def gap(self, sequence: int) -> int:
        """How many numbers lie between the last one and this; below 0: another publisher."""
        if sequence == UNKNOWN:
            self.why_not = "the middleware does not number messages"
            return 0
        return 0 if self._last is None else sequence - self._last - 1

    def take(self, sequence: int) -> None:
        """Number `sequence` came; what lies before it is lost."""
        if self._last is not None:
            self.lost += max(0, sequence - self._last - 1)
        self._last = sequence

    def restart(self) -> None:
        """Another publisher, or a pause: the next number is a first one."""
        self._last = None

    def __str__(self) -> str:
        return f"not countable: {self.why_not}" if self.why_not else str(self.lost)


class IndexLoss:
    """Gaps in a gapless running index of rows; an index that falls is that of a new run."""

    def __init__(self) -> None:
        self.lost = 0
        self._next: int | None = None

    def take(self, first: int, last: int, rows: int) -> None:
        """A message came with `rows` rows, from index `first` to `last`."""
        if self._next is not None and first >= self._next:
            self.lost += first - self._next
        self.lost += last - first + 1 - rows
        self._next = last + 1

    def restart(self) -> None:
        """A pause: the next index is a first one."""
        self._next = None

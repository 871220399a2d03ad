"""When to send a page the next frame: only as fast as it draws.

Bokeh's browser side tells the end of an axis that follows the data once it has drawn them: that is
the acknowledgement. A page that draws slowly, or lies in a hidden tab and draws nothing, gets fewer
frames instead of a queue that grows.
"""

from __future__ import annotations

from collections import deque

MOST_AHEAD = 3
"""Frames that may be on their way."""
PATIENCE = 1.0
"""Seconds after which a frame goes out though nothing was acknowledged: the word may be lost.
Doubled each time, up to LONGEST."""
LONGEST = 64.0


class FlowControl:
    """Counts the frames on their way to one page. Times of the clock in s, `end`s of the axis."""

    def __init__(self) -> None:
        self.sent = 0
        self.drawn = 0
        self._ahead: deque[float] = deque()
        self._last = -LONGEST
        self._patience = PATIENCE

    def may_send(self, now: float) -> bool:
        """Whether the page has room for another frame."""
        if len(self._ahead) < MOST_AHEAD:
            return True
        return now - self._last >= self._patience

    def note_sent(self, now: float, end: float) -> None:
        """A frame has gone out that moves the axis to an end."""
        if len(self._ahead) >= MOST_AHEAD:
            self._ahead.popleft()
            self._patience = min(2.0 * self._patience, LONGEST)
        self._ahead.append(end)
        self._last = now
        self.sent += 1

    def note_drawn(self, end: float) -> None:
        """The page has drawn an axis up to an end."""
        self._patience = PATIENCE
        while self._ahead and (self._ahead[0] <= end + 1e-9 or self._ahead[-1] < end):
            self._ahead.popleft()
            self.drawn += 1

    def restart(self) -> None:
        """The axis begins anew: nothing is on its way."""
        self._ahead.clear()
